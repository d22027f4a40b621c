# SPDX-License-Identifier: Apache-2.0
"""Values of Cycles in Blender 5.0.1, measured once without noise, so that the model is held without Blender too."""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np
import pytest

from mfo_backend.material.cycles_model import cycles_model
from mfo_backend.material.principled.blender_principled import blender_principled
from mfo_backend.material.principled.needed_lobes import needed_lobes

from ..directions import unit

BASE = {"base_color": (0.8, 0.3, 0.1)}
FILM = {"base_color": (0.1, 0.1, 0.1), "roughness": 0.4, "thin_film_thickness": 450.0, "thin_film_ior": 1.38}
COAT = {"coat_weight": 0.5, "coat_roughness": 0.2, "coat_ior": 1.8, "coat_tint": (0.5, 0.8, 0.9)}
BRUSHED = {"metallic": 0.6, "roughness": 0.4, "anisotropic": 0.8, "anisotropic_rotation": 0.1}
# Pair 1: view (30, 0), light (40, 180); pair 2: view (70, 20), light (55, 150); degrees from normal and tangent
GOLDEN: list[tuple[str, dict[str, Any], tuple[float, float, float], tuple[float, float, float]]] = [
    ("default", {}, (0.237967, 0.120885, 0.074053), (0.135846, 0.0537099, 0.0208556)),
    (
        "specular tint",
        {"roughness": 0.2, "specular_ior_level": 0.8, "specular_tint": (1.0, 0.5, 0.2)},
        (0.299963, 0.130511, 0.0516211),
        (0.117909, 0.0442774, 0.0148104),
    ),
    ("ior 2", {"roughness": 0.9, "ior": 2.0}, (0.199415, 0.0843749, 0.0383588), (0.151346, 0.0679522, 0.0345946)),
    ("rough diffuse", {"diffuse_roughness": 0.7}, (0.193060, 0.0970161, 0.0657803), (0.0811065, 0.0314953, 0.0133748)),
    ("metal", {"metallic": 1.0, "roughness": 0.4}, (1.77164, 0.652246, 0.216109), (0.0282767, 0.0102961, 0.00360708)),
    (
        "edge tint",
        {"metallic": 1.0, "roughness": 0.7, "specular_tint": (0.9, 0.6, 0.3)},
        (0.365497, 0.113898, 0.0354456),
        (0.130527, 0.0414699, 0.0122938),
    ),
    ("brushed", BRUSHED, (0.982086, 0.381399, 0.146875), (0.0570864, 0.0215262, 0.00740405)),
    (
        "coat",
        {"coat_weight": 1.0, "coat_roughness": 0.3},
        (0.358997, 0.246803, 0.201926),
        (0.116088, 0.0463449, 0.0184477),
    ),
    ("tinted coat", COAT, (0.243771, 0.178178, 0.141622), (0.0878363, 0.0426386, 0.0176971)),
    (
        "sheen",
        {"sheen_weight": 1.0, "sheen_roughness": 0.4, "sheen_tint": (0.2, 0.6, 1.0)},
        (0.235825, 0.120311, 0.0743523),
        (0.115987, 0.0579598, 0.0403245),
    ),
    ("glass", {"transmission_weight": 1.0}, (0.0507694, 0.0505489, 0.0504041), (0.0046247, 0.00452117, 0.00445323)),
    ("film", FILM, (0.103940, 0.110605, 0.0594972), (0.0164818, 0.0174194, 0.0170603)),
    (
        "film on metal",
        {"metallic": 1.0, "roughness": 0.4, "thin_film_thickness": 350.0, "thin_film_ior": 1.6},
        (1.62187, 0.737000, 0.0547451),
        (0.0225792, 0.0123247, 0.00190655),
    ),
]
# Six digits are given, half a unit of the last is up to 5e-6; the film's blue is the small rest of an extinction
TOLERANCE = {"film": 5e-5, "film on metal": 3e-4}


def value(parameters: dict[str, Any], view: Any, light: Any, distribution: str = "MULTI_GGX") -> np.ndarray:
    vector = dr.llvm.ad.Array3f
    lobes = needed_lobes(parameters)
    model = cycles_model((5, 0), distribution)
    directions = (vector(*map(float, direction)) for direction in (view, light))
    return np.array(blender_principled(parameters, *directions, lobes, model)).ravel()


@pytest.mark.parametrize(("name", "parameters", "first", "second"), GOLDEN, ids=[row[0] for row in GOLDEN])
def test_value_is_that_of_cycles(name: str, parameters: dict[str, Any], first: Any, second: Any) -> None:
    tolerance = TOLERANCE.get(name, 1e-5)
    pairs = [(unit(30, 0), unit(40, 180), first), (unit(70, 20), unit(55, 150), second)]
    for view, light, expected in pairs:
        np.testing.assert_allclose(value({**BASE, **parameters}, view, light), expected, rtol=tolerance)


def test_distribution_without_multiple_scattering() -> None:
    result = value(BASE, unit(30, 0), unit(40, 180), "GGX")
    np.testing.assert_allclose(result, (0.236787, 0.120176, 0.0735318), rtol=1e-5)


def test_light_through_glass() -> None:
    result = value({**BASE, "transmission_weight": 1.0}, unit(30, 0), unit(150, 175))
    np.testing.assert_allclose(result, (1.86748, 1.13863, 0.655504), rtol=1e-5)


def test_opaque_back_side_equals_the_front() -> None:
    view, light = np.array(unit(30, 40)), np.array(unit(50, 200))
    mirror = np.array([1, 1, -1])
    np.testing.assert_allclose(value(BASE, view * mirror, light * mirror), value(BASE, view, light), rtol=1e-6)
    np.testing.assert_array_equal(value(BASE, view, light * mirror), 0)


def test_mirrored_anisotropy_turns_the_other_way_seen_from_behind() -> None:
    view, light, mirror = np.array(unit(30, 40)), np.array(unit(50, 200)), np.array([1, 1, -1])
    turned = {**BRUSHED, "anisotropic_rotation": 0.9}
    np.testing.assert_allclose(value(BRUSHED, view * mirror, light * mirror), value(turned, view, light), rtol=1e-5)
