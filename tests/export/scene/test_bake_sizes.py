# SPDX-License-Identifier: Apache-2.0
"""How fine a bake is: about as fine as the picture shows the surface."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.bake.unwrap import unwrapped
from blender_addon.export.camera.camera_model import Camera
from blender_addon.export.meshes.mesh_arrays import CornerMesh, Piece
from blender_addon.export.scene.scene_bakes import LEAST_SIZE, MOST_SIZE, TEXELS_A_PIXEL, USED, _texels

from ..baked_shapes import at_vertices, shape_of, texture
from ..scenes import add_quad, new_material
from .test_baked_surfaces import Nodes, stage

__all__ = ["stage"]  # a fixture

ABOVE = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]])
CAMERA = Camera(
    kind="ORTHO", world=ABOVE, width=256, height=256, fit="AUTO", sensor_width=36.0, sensor_height=24.0, lens=50.0,
    ortho_scale=2.0, shift_x=0.0, shift_y=0.0, clip_start=0.1, clip_end=100.0,
)  # fmt: skip


def square(side: float, x: float = 0.0) -> Piece:
    """A horizontal square around (x, 0, 0)."""
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32) * side / 2
    index = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    mesh = CornerMesh(
        corners[index].astype(np.float32),
        np.tile(np.array([0.0, 0.0, 1.0], np.float32), (2, 3, 1)),
        np.zeros((2, 3, 2), np.float32),
        np.zeros(2, np.int32),
        index,
    )
    matrix = np.eye(4)
    matrix[0, 3] = x
    return Piece(mesh, np.ones(2, np.bool_), matrix)


@pytest.mark.parametrize(
    ("pixels", "side", "expected"), [(64, 1.0, LEAST_SIZE), (256, 1.0, 512), (512, 1.0, 1024), (4096, 2.0, MOST_SIZE)]
)
def test_a_bake_is_the_power_of_two_above_its_share_of_the_picture(pixels: int, side: float, expected: int) -> None:
    camera = replace(CAMERA, width=pixels, height=pixels)
    wanted = TEXELS_A_PIXEL * (pixels / 2.0) * side / USED
    texels = _texels(camera, square(side))
    assert texels == expected
    assert wanted <= texels < 2 * wanted or texels in (LEAST_SIZE, MOST_SIZE)


def test_what_is_not_in_the_picture_or_has_no_area_is_coarse() -> None:
    camera = replace(CAMERA, width=1024, height=1024)
    assert _texels(camera, square(1.0, x=9.0)) == LEAST_SIZE
    assert _texels(camera, square(0.0)) == LEAST_SIZE


@pytest.mark.parametrize("width", [64, 512], ids=["square", "wide"])
def test_a_pictures_shape_does_not_stretch_the_map_of_a_bake(scene: Any, width: int) -> None:
    """Smart UV Project took the shape of the picture of the active node: a square had one column of texels."""
    material = new_material("Logo")
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("Logo", width, 64)
    material.node_tree.nodes.active = node
    uv = unwrapped(add_quad("Sign", 1.0, 0.0, material).data, np.ones(1, np.bool_), bpy.context.scene, LEAST_SIZE)
    sides = np.ptp(uv, axis=0)
    assert sides[0] == pytest.approx(sides[1], rel=1e-3)
    assert sides.min() > 0.45


@pytest.mark.parametrize("across", [1, 4])
def test_a_border_of_a_map_takes_nothing_from_the_faces_beside_it(stage: Any, export: Any, across: int) -> None:
    """Boxes in one bake, whose faces have their normals for colours: beside a texel of one lay a mean of two."""
    target, item, _ = stage
    bpy.ops.mesh.primitive_cube_add(size=0.4)
    box = bpy.context.object
    bpy.data.objects.remove(item)
    box.data.materials.append(new_material("Boxes"))
    nodes = Nodes(box.data.materials[0])
    for axis in range(2):
        row = box.modifiers.new("Row", "ARRAY")
        row.count, row.relative_offset_displace = across, (1.2 * (axis == 0), 1.2 * (axis == 1), 0.0)
    color = nodes.place()
    nodes.tree.links.new(nodes.new("NewGeometry").outputs["True Normal"], color.node.inputs[0])
    nodes.tree.links.new(color, nodes.principled.inputs["Base Color"])
    report = export(target)
    bsdf, _, uv = shape_of(report)
    picture = texture(report, bsdf, "Base Color")
    nearest = np.array([(x, y) for x in (-0.5, 0.5) for y in (-0.5, 0.5)]) / len(picture)  # what filtering takes
    around = [at_vertices(picture, uv + place) for place in nearest]
    assert np.ptp(around, axis=0).max() < 0.01
    assert np.sort(np.abs(around[0] - 0.5), axis=1) == pytest.approx(np.tile((0.0, 0.0, 0.5), (len(uv), 1)), abs=0.01)
