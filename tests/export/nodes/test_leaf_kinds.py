# SPDX-License-Identifier: Apache-2.0
"""Shader nodes that are held as the nearest model there is, and so are no target of a fit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.nodes.leaf_kinds import only_nearest, why_not_fitted  # noqa: E402

METALLIC = "ShaderNodeBsdfMetallic"


@pytest.fixture
def tree() -> Iterator[Any]:
    material = bpy.data.materials.new("Leaves")
    if material.node_tree is None:
        material.use_nodes = True
    yield material.node_tree
    bpy.data.materials.remove(material)


@pytest.mark.parametrize(("kind", "nearest"), [("Diffuse", False), ("Glossy", False), ("Glass", False), ("Hair", True)])
def test_other_lobes_than_a_fit_has(kind: str, nearest: bool, tree: Any) -> None:
    node = tree.nodes.new(f"ShaderNodeBsdf{kind}")
    assert only_nearest(node) == nearest
    assert (why_not_fitted(node) is not None) == nearest


@pytest.mark.skipif(not hasattr(bpy.types, METALLIC), reason="this Blender has no metal")
@pytest.mark.parametrize(("fresnel", "film", "nearest"), [
    ("PHYSICAL_CONDUCTOR", 0.0, False), ("PHYSICAL_CONDUCTOR", 300.0, True), ("F82", 300.0, False),
])  # fmt: skip
def test_a_film_on_a_metal_by_index(fresnel: str, film: float, nearest: bool, tree: Any) -> None:
    node = tree.nodes.new(METALLIC)
    node.fresnel_type = fresnel
    thickness = node.inputs.get("Thin Film Thickness")
    if thickness is None:
        pytest.skip("metals of this Blender have no film")
    thickness.default_value = film
    assert only_nearest(node) == nearest
    assert (why_not_fitted(node) is not None) == nearest
