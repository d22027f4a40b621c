# SPDX-License-Identifier: Apache-2.0
"""Render Region: where its pixels lie, which pictures show it alone, and the fit's picture of it against Cycles'."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.camera.render_region import (
    picture_size,
    pictured_region,
    pictured_size,
    region_settings,
    render_as,
    render_region,
    square_size,
)
from blender_addon.export.job import ExportError, check_export, export_job

from ..scenes import add_camera, add_mesh, add_quad, emission_material, new_material, world_color


def put_region(render: Any, left: float, right: float, bottom: float, top: float, *, crop: bool) -> None:
    """Parts of the frame, as Blender counts them: from below."""
    render.use_border, render.use_crop_to_border = True, crop
    render.border_min_x, render.border_max_x = left, right
    render.border_min_y, render.border_max_y = bottom, top


def white_triangle(scene: Any) -> Any:
    """An uneven white shape that fills most of the frame, and a small target in its middle."""
    corners = [(-2.0, -1.2, 0), (2.2, -0.9, 0), (0.1, 1.3, 0.4)]
    add_mesh("Triangle", corners, [(0, 1, 2)], emission_material("White", (0.8, 0.8, 0.8)))
    return add_quad("Target", 0.02, 0.5, new_material("Target"))


@pytest.mark.parametrize(
    "edges", [(0.21, 0.77, 0.31, 0.93), (0.1, 0.9, 0.0, 0.8), (1 / 3, 2 / 3, 0.4999, 1.0), (0.15, 0.85, 0.1, 0.95)]
)
@pytest.mark.parametrize("size", [(64, 48), (97, 61), (60, 160)])  # 95 % of 160 end below a pixel in double precision
def test_the_pixels_are_those_that_blender_renders(scene: Any, render_cycles: Any, edges: Any, size: Any) -> None:
    render = scene.render
    render.resolution_x, render.resolution_y = size
    scene.cycles.samples = 1
    world_color(scene, 1.0)
    add_camera("PERSP", (0, 0, 5))
    put_region(render, *edges, crop=True)
    region = render_region(render)
    assert region is not None
    assert render_cycles().shape[:2] == region.size[::-1]
    render.use_crop_to_border = False
    rows, columns = np.nonzero(render_cycles().sum(axis=-1) > 0.0)
    found = (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)
    assert found == (region.left, region.top, region.right, region.bottom)
    for name, value in region_settings(region, size).items():
        setattr(render, name, value)
    assert render_region(render) == region


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "THIN LENS"])
def test_a_cropped_picture_equals_that_of_cycles(
    kind: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """With a shift, where there is one: the region's edges against the shape tell half a pixel."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 128, 96, 50
    scene.cycles.samples = 64
    target = white_triangle(scene)
    lens = {"shift_x": 0.1, "shift_y": -0.05} if kind != "THIN LENS" else {}
    camera = add_camera(kind if kind != "THIN LENS" else "PERSP", (0.3, -1.0, 4.0), (0.3, 0.1, 0.2), **lens)
    camera.data.ortho_scale, camera.data.lens = 4.0, 40.0
    if kind == "THIN LENS":
        camera.data.dof.use_dof, camera.data.dof.aperture_fstop, camera.data.dof.focus_distance = True, 0.2, 4.0
    put_region(scene.render, 0.21, 0.77, 0.31, 0.93, crop=True)
    expected = render_cycles()
    report = export(target)
    assert report.notes == ()
    found = render_mitsuba(report)
    assert found.shape == expected.shape == (30, 36, 3)
    assert 0.2 < (expected[..., 0] > 0.4).mean() < 0.9
    assert np.abs(found - expected).mean() < 0.008
    for axis in (0, 1):
        ramp = np.arange(expected.shape[axis])
        centroids = [(p.sum(axis=(1 - axis, 2)) * ramp).sum() / p.sum() for p in (expected, found)]
        assert centroids[0] == pytest.approx(centroids[1], abs=0.05)  # pixels
    assert report.request["image"]["frame"] == {"width": 64, "height": 48, "left": 13, "top": 4}


def test_the_size_of_a_picture_says_whether_it_shows_the_region_alone(scene: Any) -> None:
    render = scene.render
    render.resolution_x, render.resolution_y = 64, 48
    frame, alone = (64, 48), (32, 24)
    assert [pictured_region(render, size) for size in (None, frame, alone)] == [None] * 3
    put_region(render, 0.25, 0.75, 0.25, 0.75, crop=True)
    found = [pictured_size(render, size) for size in (None, frame, alone, (10, 10))]
    assert found == [alone, frame, alone, alone]
    render.use_crop_to_border = False
    found = [pictured_size(render, size) for size in (None, frame, alone, (10, 10))]
    assert found == [frame, frame, alone, frame]
    put_region(render, 0.0, 1.0, 0.0, 1.0, crop=True)
    assert pictured_region(render, frame) is None


@pytest.mark.parametrize("crop", [False, True])
def test_a_picture_of_the_frame_has_the_region_as_the_part_that_may_count(scene: Any, export: Any, crop: bool) -> None:
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    add_camera("PERSP", (0, 0, 5))
    put_region(scene.render, 0.26, 0.75, 0.25, 0.5, crop=crop)
    picture = bpy.data.images.new("Frame", 32, 32, float_buffer=True)
    request = export(target, reference=picture).request
    assert request["reference"]["region"] == [8 / 32, 16 / 32, 24 / 32, 24 / 32]
    assert request["image"] == {"width": 32, "height": 32, "film_transparent": False}
    picture.scale(16, 8)
    request = export(target, "alone", reference=picture).request
    assert "region" not in request["reference"]
    assert request["image"]["frame"] == {"width": 32, "height": 32, "left": 8, "top": 16}


def test_what_a_region_cannot_show_is_refused(scene: Any, tmp_path: Any) -> None:
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    add_camera("ORTHO", (0, 0, 5), ortho_scale=2.0)
    put_region(scene.render, 0.0, 0.2, 0.0, 0.2, crop=True)
    assert check_export(bpy.context, target)[0] == ["The camera does not see 'Target': move it into the frame."]
    put_region(scene.render, 0.3, 0.8, 0.3, 0.8, crop=True)
    assert check_export(bpy.context, target)[0] == []
    scene.render.pixel_aspect_x = 2.0
    assert check_export(bpy.context, target)[0] == [
        "Render Region cuts pictures whose pixels are not square: turn Render Region off."
    ]
    scene.render.pixel_aspect_x = 1.0
    wrong = bpy.data.images.new("Wrong", 10, 10)
    with pytest.raises(ExportError, match=r"'Wrong' is 10x10, but the Render Region is 16x16: turn Render Region off"):
        export_job(bpy.context, target, tmp_path / "job", reference=wrong, fit={})


def test_a_check_renders_what_the_job_shows(scene: Any) -> None:
    render = scene.render
    put_region(render, 0.1, 0.3, 0.1, 0.3, crop=False)
    render_as(render, (40, 20), {})
    assert (render.resolution_x, render.resolution_y, render.use_border) == (40, 20, False)
    render_as(render, (40, 20), {"width": 100, "height": 50, "left": 7, "top": 3})
    region = render_region(render)
    assert region is not None
    assert (region.left, region.top, region.right, region.bottom) == (7, 3, 47, 23)
    assert (render.resolution_x, render.resolution_y, render.use_crop_to_border) == (100, 50, True)


@pytest.mark.parametrize(("aspect", "size"), [((2.0, 1.0), (40, 15)), ((1.0, 1.25), (32, 30))])
def test_a_check_shows_the_frame_of_pixels_that_are_not_square(
    scene: Any, aspect: tuple[float, float], size: tuple[int, int]
) -> None:
    render, lens = scene.render, add_camera("PERSP", (0, 0, 5)).data
    render.resolution_x, render.resolution_y, render.resolution_percentage = 40, 30, 100
    render.pixel_aspect_x, render.pixel_aspect_y = aspect
    assert square_size(render) == size
    framed = np.array(lens.view_frame(scene=scene))
    render_as(render, size, {})
    assert picture_size(render) == square_size(render) == size
    np.testing.assert_allclose(lens.view_frame(scene=scene), framed, atol=1e-6)
