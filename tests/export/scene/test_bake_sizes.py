# SPDX-License-Identifier: Apache-2.0
"""How fine a bake is: about as fine as the picture shows the surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from blender_addon.export.camera.camera_model import Camera
from blender_addon.export.meshes.mesh_arrays import CornerMesh, Piece
from blender_addon.export.scene.scene_bakes import LEAST_SIZE, MOST_SIZE, TEXELS_A_PIXEL, USED, _texels

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
