# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba plugin of a mix: the sum of its leaves by their weights, and what of it may change."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from ..directions import unit

LIGHT = unit(40, 150)


@pytest.fixture(autouse=True)
def _closure_tree(plugin) -> None:
    from mfo_backend.material.plugins import closure_tree

    closure_tree.register()


def leaf(colour: float, roughness: float = 0.5, **free: Any) -> dict[str, Any]:
    return {
        "type": "blender_principled",
        "base_color": {"type": "rgb", "value": [colour] * 3},
        "roughness": roughness,
    } | free


def tree(**properties: Any) -> mi.BSDF:
    return mi.load_dict({"type": "closure_tree", "fitted": leaf(0.8), "weight": 0.6} | properties)


def seen() -> mi.SurfaceInteraction3f:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.uv = mi.Vector3f(*unit(30, 0)), mi.Point2f(0.25, 0.25)
    return si


def value_of(bsdf: mi.BSDF) -> np.ndarray:
    return np.array(bsdf.eval(mi.BSDFContext(), seen(), mi.Vector3f(*LIGHT))).ravel()


def test_the_value_is_the_sum_of_the_leaves_by_weights_and_factors() -> None:
    own, other = value_of(mi.load_dict(leaf(0.8))), value_of(mi.load_dict(leaf(0.2, 0.2)))
    held = {"leaf_0": leaf(0.2, 0.2), "weight_0": 0.3}
    np.testing.assert_allclose(value_of(tree(**held)), 0.6 * own + 0.3 * other, rtol=1e-5)
    ways = {"factor_0": 0.25, "ways": "1.0 -0", "ways_0": "2.0 +0"}
    np.testing.assert_allclose(value_of(tree(**held, **ways)), 0.6 * 0.75 * own + 0.3 * 2.0 * 0.25 * other, rtol=1e-5)


@pytest.mark.parametrize(
    ("properties", "is_open", "names"),
    [
        ({}, False, set()),
        ({"leaf_0": leaf(0.2)}, False, set()),
        ({"varies": 1.0}, True, {"weight"}),
        ({"factor_0": 0.5, "ways": "1.0 +0"}, True, {"weight"}),
        ({"leaf_0": leaf(0.2), "varies_0": 1.0}, True, {"weight", "leaf_0.weight", "leaf_0.roughness"}),
    ],
    ids=["alone", "held", "fitted varies", "factor", "leaf varies"],
)
def test_more_is_free_where_a_factor_a_leaf_or_a_texture_changes(properties, is_open, names) -> None:
    bsdf = tree(**properties)
    assert bsdf.is_open is is_open
    found = bsdf.values_at(seen(), True)
    assert names <= set(found)
    assert ("weight" in found) is is_open
    assert any(name.startswith("leaf_") for name in found) is ("varies_0" in properties)


def test_what_passes_straight_is_the_sum_of_clear_colours_by_weights() -> None:
    clear = {"clear_0": 0.5, "clear_weight_0": 0.4, "clear_1": [1.0, 0.5, 0.0], "clear_weight_1": 0.1}
    passed = np.array(tree(**clear).eval_null_transmission(seen(), True)).ravel()
    np.testing.assert_allclose(passed, [0.4 * 0.5 + 0.1 * c for c in (1.0, 0.5, 0.0)], rtol=1e-6)
    assert not tree(**clear).is_held_in_lanes
    assert tree(clear_0=0.5).is_held_in_lanes
    assert tree().is_held_in_lanes


def test_samples_have_the_density_and_the_albedo_of_the_sum() -> None:
    bsdf = tree(leaf_0=leaf(0.2, 0.2), weight_0=0.3, clear_0=0.5, clear_weight_0=0.1)
    count = 200_000
    random = mi.PCG32(count)
    si = seen()
    sampled, weight = bsdf.sample(
        mi.BSDFContext(), si, random.next_float32(), mi.Point2f(random.next_float32(), random.next_float32())
    )
    straight = mi.has_flag(sampled.sampled_type, mi.BSDFFlags.Null)
    density = bsdf.pdf(mi.BSDFContext(), si, sampled.wo, ~straight)
    np.testing.assert_allclose(
        np.array(sampled.pdf)[~np.array(straight)], np.array(density)[~np.array(straight)], rtol=1e-4
    )
    # over the hemisphere, by the midpoint rule in cosine and azimuth
    side = 1000
    cosine, azimuth = np.meshgrid((np.arange(side) + 0.5) / side, 2.0 * np.pi * (np.arange(side) + 0.5) / side)
    sine = np.sqrt(1.0 - cosine**2)
    wo = mi.Vector3f(
        *(np.ravel(c).astype(np.float32) for c in (sine * np.cos(azimuth), sine * np.sin(azimuth), cosine))
    )
    reflected = 2.0 * np.pi * float(np.array(bsdf.eval(mi.BSDFContext(), si, wo)).mean())
    assert float(np.array(weight).mean()) == pytest.approx(reflected + 0.1 * 0.5, rel=0.01)
