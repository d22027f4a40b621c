# SPDX-License-Identifier: Apache-2.0
"""Names, sockets and properties of the material."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import pytest

from mfo_backend.material.cycles_model import cycles_model
from mfo_backend.material.principled.principled_dict import blender_principled_dict
from mfo_backend.material.principled.principled_parameters import (
    BLENDER_PRINCIPLED,
    PARAMETER_OF_SOCKET,
    SOCKET_OF_PARAMETER,
    parameter_to_socket,
)
from mfo_backend.types.errors import BadInputError


@pytest.mark.parametrize(
    ("name", "socket"),
    [
        ("base_color", "Base Color"),
        ("ior", "IOR"),
        ("specular_ior_level", "Specular IOR Level"),
        ("thin_film_ior", "Thin Film IOR"),
        ("coat_ior", "Coat IOR"),
        ("anisotropic_rotation", "Anisotropic Rotation"),
        ("emission_strength", "Emission Strength"),
    ],
)
def test_socket_names_are_those_of_blender(name: str, socket: str) -> None:
    assert parameter_to_socket(name) == SOCKET_OF_PARAMETER[name] == socket
    assert PARAMETER_OF_SOCKET[socket] == name


def test_socket_map_is_one_to_one() -> None:
    assert len(PARAMETER_OF_SOCKET) == len(BLENDER_PRINCIPLED)


def test_unknown_parameter_has_no_socket() -> None:
    with pytest.raises(KeyError):
        parameter_to_socket("clearcoat")


@pytest.mark.parametrize("parameter", BLENDER_PRINCIPLED, ids=lambda p: p.name)
def test_default_lies_within_the_bounds_of_a_fit(parameter) -> None:  # type: ignore[no-untyped-def]
    default = parameter.default if isinstance(parameter.default, tuple) else (parameter.default,)
    assert len(default) == parameter.size
    # A white coat tint and base colour may end on the bound
    assert all(parameter.lower <= v <= parameter.upper for v in default)


def test_importing_the_parameters_loads_neither_mitsuba_nor_drjit() -> None:
    code = (
        "import sys, mfo_backend.material, mfo_backend.material.principled.principled_parameters, "
        "mfo_backend.material.principled.principled_dict, mfo_backend.material.principled.needed_lobes;"
        "sys.exit(bool({'mitsuba', 'drjit'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_dict_keeps_what_differs_from_the_default() -> None:
    sockets = {
        "Base Color": {"value": [0.8, 0.1, 0.1], "linked": False},
        "Roughness": {"value": 0.5, "linked": True, "texture": "textures/tex_0001.exr"},
        "Metallic": {"value": 0.0, "linked": False},
        "IOR": {"value": 1.45},
        "Subsurface Radius": {"value": [1.0, 0.2, 0.1]},
    }
    assert blender_principled_dict(sockets, version=(4, 5, 3)) == {
        "type": "blender_principled",
        "distribution": "MULTI_GGX",
        "blender_version": "4.5",
        "base_color": {"type": "rgb", "value": [0.8, 0.1, 0.1]},
        "roughness": {"type": "bitmap", "filename": "textures/tex_0001.exr", "raw": True},
        "ior": 1.45,
    }


def test_dict_names_what_will_change() -> None:
    sockets = {"Metallic": {"value": 0.0}}
    result = blender_principled_dict(sockets, distribution="GGX", free=["roughness", "metallic"])
    assert result["free"] == "metallic,roughness"
    assert result["metallic"] == 0.0
    assert result["distribution"] == "GGX"


@pytest.mark.parametrize(
    ("sockets", "message"),
    [
        ({"Clearcoat": {"value": 1.0}}, "Unknown socket 'Clearcoat'"),
        ({"Roughness": {"value": [0.1, 0.2]}}, "'Roughness' has 2 components, allowed are 1: give one number"),
        ({"Base Color": {"value": 0.1}}, "'Base Color' has 1 components, allowed are 3: give linear red"),
    ],
)
def test_dict_refuses_what_it_does_not_know(sockets: dict, message: str) -> None:
    with pytest.raises(BadInputError, match=message):
        blender_principled_dict(sockets)


def test_versions_differ_as_documented() -> None:
    old, middle, new = cycles_model((4, 2)), cycles_model((4, 5, 3)), cycles_model((5, 2))
    assert (old.coat_compensation, old.diffuse_roughness, old.film_fourier) == (False, False, False)
    assert (middle.coat_compensation, middle.diffuse_roughness, middle.film_fourier) == (True, True, False)
    assert (cycles_model((4, 4)).bumps_shade, middle.bumps_shade) == (False, True)
    assert new == replace(cycles_model((5, 0)), radius_is_path=True, samples_see_layers=True)
    legacy = cycles_model((5, 2), subsurface_method="RANDOM_WALK_LEGACY")
    assert legacy == replace(cycles_model((5, 0)), samples_see_layers=True)
    assert (middle.walks_again, cycles_model((5, 0)).walks_again) == (False, True)
    assert cycles_model(subsurface_method="RANDOM_WALK_SKIN").skin
    assert cycles_model(subsurface_method="BURLEY").disk
    assert not cycles_model(subsurface_method="BURLEY").walks_again
    assert not cycles_model((5, 0), "GGX").multiple_scattering


@pytest.mark.parametrize(
    ("version", "distribution", "message"),
    [
        ((4, 1, 0), "GGX", "Blender 4.1.0 has another Principled BSDF"),
        ((5, 0), "PHONG", "choose one of MULTI_GGX, GGX, BECKMANN"),
    ],
)
def test_unknown_models_are_refused(version: tuple[int, ...], distribution: str, message: str) -> None:
    with pytest.raises(BadInputError, match=message):
        cycles_model(version, distribution)
