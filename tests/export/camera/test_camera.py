# SPDX-License-Identifier: Apache-2.0
"""Cameras: where Blender puts known points, against the rays Mitsuba shoots through those places."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view  # pyright: ignore[reportMissingImports]
from mathutils import Vector  # pyright: ignore[reportMissingImports]

from blender_addon.export.camera.camera_model import PixelFilter, sensor_element
from blender_addon.export.camera.read_camera import read_camera
from blender_addon.export.files.xml_scene import scene_text
from blender_addon.export.findings import Findings
from blender_addon.export.job import check_export

from ..scenes import add_camera, add_mesh, add_quad, emission_material, new_material, world_color

POINTS = [(0, 0, 0), (0.4, 0.2, -0.3), (-0.5, 0.3, 0.2), (0.2, -0.4, 0.5), (-0.3, -0.2, -0.6)]
SIZES = {"wide": (64, 32), "tall": (24, 48)}


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("aspect", [(1.0, 1.0), (2.0, 1.0), (1.0, 1.6)])
def test_points_lie_on_the_rays_of_their_pixels(
    kind: str, fit: str, size: str, aspect: Any, scene: Any, mitsuba: Any
) -> None:
    scene.render.resolution_x, scene.render.resolution_y = SIZES[size]
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    settings = {"lens": 35.0, "sensor_width": 30.0, "sensor_height": 20.0, "ortho_scale": 3.0}
    item = add_camera(kind, (3, -2, 2), (1.0, 0.2, 0.9), sensor_fit=fit, shift_x=0.13, shift_y=-0.21, **settings)
    item.scale = (2.0, 0.5, 3.0)  # to be ignored
    bpy.context.view_layer.update()
    camera = read_camera(scene, bpy.context.evaluated_depsgraph_get(), Findings())
    assert camera is not None
    sensor = mitsuba.load_string(scene_text([sensor_element(camera, PixelFilter("BOX", 1.5), 4)])).sensors()[0]
    item.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    points = np.array(POINTS, dtype=np.float64)
    x, y = np.array([world_to_camera_view(scene, item, Vector(point))[:2] for point in POINTS]).T
    # all at once: a number becomes part of its kernel, an array does not
    ray, _ = sensor.sample_ray(0.0, 0.5, mitsuba.Point2f(x, 1.0 - y), mitsuba.Point2f(0.5, 0.5))
    origins, directions = np.array(ray.o).T, np.array(ray.d).T
    misses = np.linalg.norm(np.cross(points - origins, directions), axis=1)
    # float32 through Blender's and Mitsuba's matrices at a distance of 4 m; a pixel is 0.05 m there
    assert misses.max() < 2e-4
    # the same places by our own projection, which decides what is in the frame
    places, depths = camera.project(points)
    np.testing.assert_allclose(places, np.stack([x * camera.width, (1.0 - y) * camera.height], axis=1), atol=2e-3)
    assert depths.min() > 0.0


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_picture_equals_that_of_cycles(
    kind: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """Resolution percentage, shift and orientation at once: an asymmetric white shape on black."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 64, 50
    scene.cycles.samples = 64
    corners = [(-0.8, -0.5, 0), (0.9, -0.6, 0), (0.1, 0.7, 0.4)]
    add_mesh("Triangle", corners, [(0, 1, 2)], emission_material("White", (0.8, 0.8, 0.8)))
    target = add_quad("Target", 0.02, 0.3, new_material("Target"))
    add_camera(kind, (0.3, -1.0, 4.0), (0.3, 0.1, 0.2), shift_x=0.1, shift_y=-0.05, ortho_scale=3.0, lens=40.0)
    expected = render_cycles()
    found = render_mitsuba(export(target))
    assert found.shape == expected.shape == (32, 48, 3)
    assert expected.mean() > 0.05
    # edges are anti-aliased with 64 random samples in each renderer: 5 % of 0.8 for the half-covered pixels along them
    assert np.abs(found - expected).mean() < 0.002
    for axis in (0, 1):
        ramp = np.arange(expected.shape[axis])
        centroids = [(p.sum(axis=(1 - axis, 2)) * ramp).sum() / p.sum() for p in (expected, found)]
        assert centroids[0] == pytest.approx(centroids[1], abs=0.03)  # pixels


@pytest.mark.parametrize("by_object", [False, True])
def test_depth_of_field_equals_that_of_cycles(
    by_object: bool, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """One white square on the plane that is sharp, one far behind it; the focus by distance or by an object."""
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    scene.cycles.samples = 256
    white = emission_material("White", (0.8, 0.8, 0.8))
    for x, z in ((-0.7, 0.0), (0.8, -3.0)):
        corners = [(x - 0.4, -0.4, z), (x + 0.4, -0.4, z), (x + 0.4, 0.4, z), (x - 0.4, 0.4, z)]
        add_mesh(f"At {z}", corners, [(0, 1, 2, 3)], white)
    target = add_quad("Target", 0.02, 0.3, new_material("Target"))
    camera = add_camera("PERSP", (0.0, 0.0, 4.0), lens=40.0)
    dof = camera.data.dof
    dof.use_dof, dof.aperture_fstop, dof.focus_distance = True, 0.1, 9.0 if by_object else 4.0
    if by_object:  # at the side: the distance is along the view
        dof.focus_object = bpy.data.objects.new("Focus", None)
        scene.collection.objects.link(dof.focus_object)
        dof.focus_object.location = (1.5, 0.7, 0.0)
    expected = render_cycles()
    report = export(target)
    assert report.notes == ()
    found = render_mitsuba(report, 256)
    assert ((expected[..., 0] > 0.05) & (expected[..., 0] < 0.7)).sum() > 60  # it is blurred
    assert np.abs(found - expected).mean() < 0.005


def test_what_of_a_lens_the_fit_does_not_have_is_said(scene: Any) -> None:
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    camera = add_camera("PERSP", (0, 0, 5))
    camera.data.dof.use_dof, camera.data.dof.aperture_blades = True, 5
    circle = "Camera 'Camera': the aperture is taken for a circle (Blades 0, Ratio 1)."
    assert check_export(bpy.context, target) == ([], [circle])
    camera.data.shift_x = 0.1
    sharp = "its depth of field is left out, everything is sharp."
    assert check_export(bpy.context, target) == ([], [f"Camera 'Camera' has a shift: {sharp}"])
    camera.data.type = "ORTHO"
    assert check_export(bpy.context, target) == ([], [f"Camera 'Camera' is orthographic: {sharp}"])


@pytest.mark.parametrize(("kind", "width"), [("BOX", 1.0), ("BLACKMAN_HARRIS", 1.5), ("GAUSSIAN", 1.5)])
def test_pixel_filter_blurs_an_edge_alike(
    kind: str, width: float, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    scene.render.resolution_x, scene.render.resolution_y = 16, 8
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = kind, width
    scene.cycles.samples = 2048
    edge = 0.13  # between the middles of two pixels, which are 0.125 wide
    white = emission_material("White", (1, 1, 1))
    add_mesh("Half", [(-2, -2, 0), (edge, -2, 0), (edge, 2, 0), (-2, 2, 0)], [(0, 1, 2, 3)], white)
    target = add_quad("Target", 0.05, 0.1, new_material("Target"))
    target.location = (0.9, 0.4, 0)
    add_camera("ORTHO", ortho_scale=2.0)
    rows = np.s_[3:, :12]
    expected, found = (
        render_cycles()[rows].mean(axis=(0, 2)),
        render_mitsuba(export(target), 2048)[rows].mean(axis=(0, 2)),
    )
    assert 0.0 < expected[9] < 0.9
    # box: noise only. Others: a Gaussian against Cycles' table of the filter, cut at its width
    assert np.abs(found - expected).max() < (0.01 if kind == "BOX" else 0.02)


@pytest.mark.parametrize("kind", ["BLACKMAN_HARRIS", "GAUSSIAN"])
@pytest.mark.parametrize("width", [0.01, 0.3])
def test_a_filter_narrower_than_a_pixel_shows_its_middle(
    kind: str, width: float, scene: Any, export: Any, render_cycles: Any
) -> None:
    """No sample of hundreds fell into one of Cycles' least width: the picture was black."""
    from ..scene.test_light_paths import picture_of, scene_reference

    scene.render.resolution_x, scene.render.resolution_y = 16, 8
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = kind, width
    white = emission_material("White", (1, 1, 1))
    # its edge is just before the middle of a pixel
    add_mesh("Half", [(-2, -2, 0), (0.055, -2, 0), (0.055, 2, 0), (-2, 2, 0)], [(0, 1, 2, 3)], white)
    target = add_quad("Target", 0.05, 0.1, new_material("Target"))
    target.location = (0.9, 0.4, 0)
    add_camera("ORTHO", ortho_scale=2.0)
    rows = np.s_[3:, :12]
    expected = render_cycles()
    found = picture_of(export(target, reference=scene_reference(expected)))[rows]
    expected = expected[rows]
    np.testing.assert_allclose(found.mean(axis=(0, 2)), expected.mean(axis=(0, 2)), atol=0.03)
    assert expected[:, :8].min() > 0.9


def test_what_a_camera_loses_is_said(scene: Any) -> None:
    add_camera("PERSP", (0, 0, 5))
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    world_color(scene, 1.0)
    scene.render.use_motion_blur = True
    assert check_export(bpy.context, target) == (
        [],
        ["Motion blur is left out: the scene is exported at the current frame."],
    )
    scene.render.use_multiview = True
    assert check_export(bpy.context, target)[0] == ["Stereoscopy is on: turn it off to fit a single picture."]


def test_depth_and_size(scene: Any, export: Any) -> None:
    """N bounces are N + 2 segments; the resolution percentage is cut as Blender cuts it."""
    add_camera("ORTHO", ortho_scale=2.0)
    world_color(scene, 1.0)
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 101, 33, 50
    scene.cycles.max_bounces, scene.cycles.diffuse_bounces, scene.cycles.glossy_bounces = 12, 2, 3
    scene.cycles.transmission_bounces = 1
    report = export(add_quad("Target", 1.0, 0.0, new_material("Target")))
    assert '<integer name="max_depth" value="5" />' in (report.folder / "scene.xml").read_text("utf-8")
    assert (report.request["image"]["width"], report.request["image"]["height"]) == (50, 16)
    assert report.request["light_paths"]["diffuse_bounces"] == 2
    assert report.notes == ()
