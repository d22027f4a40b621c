# SPDX-License-Identifier: Apache-2.0
"""Shader nodes other than the Principled BSDF as lobes of its model, case by case against the Cycles of `bpy`."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest

from mfo_backend.material.cycles_model import DISTRIBUTIONS, cycles_model
from mfo_backend.material.principled.blender_principled import blender_principled

from .. import parity

pytestmark = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="the bpy module is not installed")
MATERIALS = 60
COLOUR = {"base_color": "Color", "roughness": "Roughness"}
CLEAR = {**COLOUR, "ior": "IOR"}
GLASS = ({**parity.BASE, "ior": (1.05, 2.5)}, {"transmission_weight": 1.0})


@dataclass(frozen=True)
class Node:
    """A node, what it calls our values, and what our model has to be told."""

    kind: str
    names: dict[str, str]
    group: parity.Group
    distribution: str = "MULTI_GGX"
    shader: str = "principled"
    choices: dict[str, str] = field(default_factory=dict)


TURNED = {**COLOUR, "anisotropic": "Anisotropy", "anisotropic_rotation": "Rotation"}
METALLIC = {**TURNED, "base_color": "Base Color", "specular_tint": "Edge Tint"}
GLOSSY = (parity.BASE, {"metallic": 1.0})
STRETCHED = {"anisotropic": (0.0, 1.108), "anisotropic_rotation": (0.0, 1.0)}
STREAKED = ({**parity.BASE, **STRETCHED}, {"metallic": 1.0})
# Cycles takes 1 - (N.H)^2 in single precision, here into an exponent; ours in single and double agree to 1e-6
SINGLE = {"most": 1e-4, "worst": 3e-4}
BENT = (*GLASS, True)
CLOTH = {"sheen_tint": "Color", "sheen_roughness": "Roughness"}
FIBRES = (
    {"sheen_roughness": (0.1, 1.0), "sheen_tint": (0.0, 1.0)},
    {"sheen_weight": 1.0, "base_color": 0.0, "specular_ior_level": 0.0},
)
INDEX = (
    {"metal_ior": (0.1, 4.0), "metal_extinction": (0.5, 6.0), "roughness": (0.15, 1.0), **parity.TURN},
    {"metallic": 1.0},
)
MEASURED = {**TURNED, "metal_ior": "IOR", "metal_extinction": "Extinction"}
CONE = {"sheen_tint": "Color", "toon_size": "Size", "toon_smooth": "Smooth"}
CONES = (
    {"toon_size": (0.2, 1.0), "toon_smooth": (0.1, 1.0), "sheen_tint": (0.0, 1.0)},
    {"sheen_weight": 1.0, "base_color": 0.0, "specular_ior_level": 0.0},
)
METAL = {**parity.BASE, "specular_tint": (0.0, 1.0), **parity.TURN}
NODES = (
    Node("BsdfAnisotropic", COLOUR, parity.Group("glossy", parity.BASE, {"metallic": 1.0}), shader="glossy"),
    Node("BsdfAnisotropic", COLOUR, parity.Group("glossy, GGX", parity.BASE, {"metallic": 1.0}), "GGX", "glossy"),
    Node(
        "BsdfAnisotropic",
        TURNED,
        parity.Group("glossy, stretched", *STREAKED),
        shader="glossy",
    ),
    Node("BsdfMetallic", METALLIC, parity.Group("metallic", METAL, {"metallic": 1.0})),
    Node("BsdfSheen", CLOTH, parity.Group("sheen", *FIBRES), "MICROFIBER"),
    Node("BsdfGlass", CLEAR, parity.Group("glass", *GLASS), shader="glass"),
    Node("BsdfGlass", CLEAR, parity.Group("glass, through", *GLASS, refracted=True), "GGX", "glass"),
    Node("BsdfRefraction", CLEAR, parity.Group("refraction", *GLASS, refracted=True), "GGX", "refraction"),
    Node("BsdfRefraction", CLEAR, parity.Group("refraction, above", *GLASS), "GGX", "refraction"),
    Node(
        "BsdfTranslucent",
        {"base_color": "Color"},
        parity.Group("translucent", {"base_color": (0.0, 1.0)}, {}, refracted=True),
        shader="translucent",
    ),
    Node("BsdfAnisotropic", COLOUR, parity.Group("glossy, Beckmann", *GLOSSY, **SINGLE), "BECKMANN", "glossy"),
    Node("BsdfAnisotropic", COLOUR, parity.Group("glossy, Ashikhmin", *GLOSSY), "ASHIKHMIN_SHIRLEY", "glossy"),
    Node("BsdfAnisotropic", TURNED, parity.Group("stretched, Beckmann", *STREAKED, **SINGLE), "BECKMANN", "glossy"),
    Node("BsdfAnisotropic", TURNED, parity.Group("stretched, Ashikhmin", *STREAKED), "ASHIKHMIN_SHIRLEY", "glossy"),
    Node("BsdfMetallic", METALLIC, parity.Group("metallic, Beckmann", METAL, {"metallic": 1.0}, **SINGLE), "BECKMANN"),
    Node("BsdfSheen", CLOTH, parity.Group("velvet", *FIBRES), "ASHIKHMIN"),
    Node("BsdfGlass", CLEAR, parity.Group("glass, Beckmann", *GLASS, **SINGLE), "BECKMANN", "glass"),
    Node("BsdfGlass", CLEAR, parity.Group("through, Beckmann", *BENT, **SINGLE), "BECKMANN", "glass"),
    Node("BsdfRefraction", CLEAR, parity.Group("bent, Beckmann", *BENT, **SINGLE), "BECKMANN", "refraction"),
    Node(
        "BsdfMetallic",
        MEASURED,
        parity.Group("metal by index", *INDEX),
        shader="conductor",
        choices={"fresnel_type": "PHYSICAL_CONDUCTOR"},
    ),
    Node("BsdfToon", CONE, parity.Group("toon", *CONES), shader="toon"),
    Node("BsdfToon", CONE, parity.Group("toon, glossy", *CONES), shader="toon_glossy", choices={"component": "GLOSSY"}),
)  # fmt: skip


@cache
def answers() -> dict[str, tuple[parity.Cases, Any]]:
    cases = [parity.random_cases(node.group, MATERIALS, seed) for seed, node in enumerate(NODES)]
    batches = []
    for node, drawn in zip(NODES, cases, strict=True):
        sockets = {node.names[name]: value for name, value in drawn.values.items() if name in node.names}
        if node.names is TURNED:  # its own measure: along the tangent below 0
            sockets["Anisotropy"] = np.sqrt(1.0 - 0.9 * sockets["Anisotropy"]) - 1.0
        asked = {"view": drawn.view, "light": drawn.light, "sockets": sockets}
        asked |= {"node": f"ShaderNode{node.kind}", "distribution": node.distribution, "choices": node.choices}
        batches.append(asked)
    found = parity.ask_cycles(batches)
    return {node.group.name: (c, a) for node, c, a in zip(NODES, cases, found, strict=True)}


def values(node: Node, cases: parity.Cases, vector: Any, number: Any) -> np.ndarray:
    """Ours (cases, 3) in the precision of these types."""
    parameters = {
        name: vector(*(number(value[:, k]) for k in range(3))) if value.ndim == 2 else number(value)
        for name, value in cases.values.items()
    }
    view, light = (vector(*(number(d[:, k]) for k in range(3))) for d in (cases.view, cases.light))
    distribution = node.distribution if node.distribution in DISTRIBUTIONS else "MULTI_GGX"
    model = cycles_model((5, 0), distribution, node.shader)
    return np.array(blender_principled(parameters, view, light, model=model), float).T


@pytest.mark.parametrize("node", NODES, ids=lambda node: node.group.name)
def test_value_is_that_of_cycles(node: Node) -> None:
    import drjit as dr

    cases, theirs = answers()[node.group.name]
    single = values(node, cases, dr.llvm.ad.Array3f, dr.llvm.ad.Float)
    # ours in double: how single precision rounds is the processor's, of glass seen through up to 2e-5
    double = values(node, cases, dr.llvm.ad.Array3f64, dr.llvm.ad.Float64)
    error = parity.relative_difference(double, theirs)
    assert np.quantile(error, 0.99) < max(node.group.most, 3e-5), np.sort(error)[-20:]
    assert np.quantile(parity.relative_difference(single, double), 0.99) < 3e-5
    assert max(error.max(), parity.relative_difference(single, theirs).max()) < 3e-4
    assert (theirs.max() > 0.0) == (node.group.name != "refraction, above")
