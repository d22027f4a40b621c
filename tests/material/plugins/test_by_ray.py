# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba BSDF that is another to rays of other kinds, against those it is made of."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

WHITE, GREY = ({"type": "diffuse", "reflectance": {"type": "rgb", "value": v}} for v in (1.0, 0.25))


def surface(kind: int) -> Any:
    si = dr.zeros(mi.SurfaceInteraction3f, 64)
    si.wi, si.sh_frame = dr.normalize(mi.Vector3f(0.3, 0.2, 0.9)), mi.Frame3f(mi.Vector3f(0, 0, 1))
    si.duv_dy = mi.Point2f(0, kind)
    return si


def by_ray(**looks: Any) -> Any:
    from mfo_backend.material.plugins.by_ray import register

    register()
    return mi.load_dict({"type": "by_ray"} | looks)


def assert_equal(found: Any, wanted: Any) -> None:
    """One number may stand for as many as there are."""
    assert np.abs(np.array(found, np.float64) - np.array(wanted, np.float64)).max() == 0.0


def test_each_kind_finds_its_own() -> None:
    from mfo_backend.material.plugins.ray_kinds import RAYS, SHADOW

    found = by_ray(scattered=WHITE, glossy=GREY, shadow={"type": "null"})
    rng, ctx = mi.PCG32(64), mi.BSDFContext()
    u1, u2 = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    of_kinds = {"glossy": mi.load_dict(GREY), "shadow": mi.load_dict({"type": "null"})}
    for number, name in enumerate(RAYS):
        si, alone = surface(number), of_kinds.get(name) or mi.load_dict(WHITE)
        wo = mi.warp.square_to_cosine_hemisphere(u2)
        assert_equal(found.eval(ctx, si, wo), alone.eval(ctx, si, wo))
        assert_equal(found.pdf(ctx, si, wo), alone.pdf(ctx, si, wo))
        for one, other in zip(found.eval_pdf(ctx, si, wo), alone.eval_pdf(ctx, si, wo), strict=True):
            assert_equal(one, other)
        (bs, weight), (own, own_weight) = (each.sample(ctx, si, u1, u2) for each in (found, alone))
        assert_equal(bs.wo, own.wo)
        assert_equal(weight, own_weight)
        clear = np.array(found.eval_null_transmission(si))
        assert_equal(clear, 1.0 if number == SHADOW else 0.0)
    assert mi.has_flag(found.flags(), mi.BSDFFlags.Null)
    assert mi.has_flag(found.flags(), mi.BSDFFlags.DiffuseReflection)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_any_ray_finds_the_back_that_there_is(side: float) -> None:
    from mfo_backend.material.plugins.ray_kinds import RAYS

    found = by_ray(scattered=WHITE, shadow=WHITE, behind={"type": "null"})
    for number in range(len(RAYS)):
        si = surface(number)
        si.n = mi.Normal3f(0, 0, side)
        assert_equal(found.eval_null_transmission(si), 0.0 if side > 0.0 else 1.0)


@pytest.mark.parametrize(
    ("flag", "kind"),
    [
        ("DiffuseReflection", "scattered"),
        ("DiffuseTransmission", "scattered"),
        ("GlossyReflection", "glossy"),
        ("DeltaReflection", "glossy"),
        ("GlossyTransmission", "transmission"),
        ("DeltaTransmission", "transmission"),
    ],
)
def test_what_a_lobe_sends_out(flag: str, kind: str) -> None:
    from mfo_backend.material.plugins.ray_kinds import RAYS, kind_of_ray

    sampled = mi.UInt32(+getattr(mi.BSDFFlags, flag))
    assert kind_of_ray(sampled)[0] == RAYS.index(kind)
