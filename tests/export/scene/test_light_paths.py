# SPDX-License-Identifier: Apache-2.0
"""Light over other surfaces as Blender's settings change it. Oracle: Cycles' render of the same scene."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from ..materials.test_node_graphs import recorded_and_cycles
from ..scenes import add_camera, add_light, add_mesh, add_quad, diffuse_material, new_material

SETTINGS = {
    "filter glossy": {"blur_glossy": 1.0},
    "strong filter glossy": {"blur_glossy": 5.0},
    "few bounces": {"diffuse_bounces": 0, "glossy_bounces": 0},
    "clamp": {"sample_clamp_indirect": 0.02},
}


def corner(scene: Any) -> Any:
    """A matt floor beside a metal wall that throws the light of a small sun on it."""
    add_camera("ORTHO", (-1.5, 0, 5), (0, -0.3, 0), ortho_scale=3.0)
    add_quad("Floor", 4.0, 0.0, diffuse_material("Floor", (0.8, 0.8, 0.8)))
    wall = add_quad("Wall", 4.0, 0.0, new_material("Wall", Base_Color=(0.9, 0.6, 0.4), Metallic=1.0, Roughness=0.2))
    wall.location, wall.rotation_euler = (1.5, 0, 1.0), (0, -1.57, 0)
    add_light("SUN", rotation=(0.2, -0.7, 0), energy=3.0, angle=0.4)
    return wall


def picture_of(report: Any, rounds: int = 6) -> np.ndarray:
    from studies.parity.cycles_parity import render_job

    halves = render_job(report.folder, rounds * 64)
    return (halves[0] + halves[1]) / 2


@pytest.mark.parametrize("name", SETTINGS)
def test_equals_cycles(scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any, name: str) -> None:
    scene.render.resolution_x = scene.render.resolution_y = 16
    cycles = scene.cycles
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 4
    cycles.samples = 1024
    wall = corner(scene)
    plain = render_cycles()
    for setting, value in SETTINGS[name].items():
        setattr(cycles, setting, value)
    cycles_picture = render_cycles()
    reference = scene_reference(cycles_picture)
    ours = picture_of(export(wall, reference=reference))
    difference = np.abs(ours.mean(axis=(0, 1)) / cycles_picture.mean(axis=(0, 1)) - 1).max()
    effect = np.abs(plain.mean(axis=(0, 1)) / cycles_picture.mean(axis=(0, 1)) - 1).max()
    assert difference < 0.003  # noise of both; the lobe choice, by which Filter Glossy goes, is not exactly Cycles'
    assert effect > 0.2


def scene_reference(pixels: np.ndarray) -> Any:
    """An image of Blender with these pixels: a job needs a reference."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("Reference", width, height, float_buffer=True, is_data=True)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[:, :, :3] = pixels[::-1]
    image.pixels.foreach_set(rgba.ravel())
    return image


@pytest.mark.parametrize(("diffuse", "glossy"), [(4, 4), (1, 1), (0, 4)])
def test_walls_that_light_each_other_are_recorded_as_in_cycles(
    scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any, diffuse: int, glossy: int
) -> None:
    """A white room with a lamp in it. Without the bounce at the wall itself it was 10 to 64 % too bright."""
    scene.render.resolution_x = scene.render.resolution_y = 16
    cycles = scene.cycles
    cycles.samples, cycles.sample_clamp_indirect = 1024, 0.0
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = 12, diffuse, glossy
    paint = new_material("Paint", Base_Color=(0.85, 0.8, 0.7), Roughness=0.4)
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    room = add_mesh("Room", corners, [face[::-1] for face in faces], paint)
    add_camera("PERSP", (0.8, -0.8, 0.4), (1.2, 0, 0.7), lens=20.0)
    add_light("AREA", location=(0, 0, 0.9), energy=10.0, size=0.5)
    found, truth = recorded_and_cycles(export, render_cycles, room)
    np.testing.assert_allclose(found.mean(axis=0), truth.mean(axis=0), rtol=0.005)


def test_what_stays_different_is_said(scene: Any, export: Any) -> None:
    wall = corner(scene)
    scene.cycles.blur_glossy, scene.cycles.sample_clamp_indirect, scene.cycles.film_exposure = 1.0, 10.0, 2.0
    scene.cycles.caustics_reflective = False
    report = export(wall)
    assert report.request["light_paths"] == {
        "filter_glossy": 1.0,
        "clamp_indirect": 20.0,
        "diffuse_bounces": 4,
        "glossy_bounces": 4,
        "transmission_bounces": 12,
        "transparent_bounces": 8,
        "min_light_bounces": 0,
        "min_transparent_bounces": 0,
    }
    assert report.notes == ("Cycles removes caustics; the fit does not.",)
    assert report.request["left_out"] == ["Cycles removes caustics; the fit does not."]
    assert report.request["film_exposure"] == 2.0


def test_clamping_is_said_where_it_is_low_for_the_lights(scene: Any, export: Any) -> None:
    wall = corner(scene)
    scene.cycles.film_exposure = 2.0
    scene.cycles.sample_clamp_indirect = 10.0  # Blender's default
    assert export(wall).notes == ()
    scene.cycles.sample_clamp_indirect = 0.01
    (said,) = export(wall).notes
    assert said.startswith("Clamping of indirect light (0.01) is low for the lights of this scene: ")


def test_clamping_is_said_sooner_of_lamps_whose_nodes_the_light_tree_does_not_know(scene: Any, export: Any) -> None:
    """A Light Falloff that changes nothing; the tree has no choice where there is one light."""
    wall = corner(scene)
    other = next(item for item in scene.objects if item.type == "LIGHT")
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy = 3000.0
    scene.collection.objects.link(bpy.data.objects.new("Lamp", lamp))

    def is_said(clamp: float) -> bool:
        scene.cycles.sample_clamp_indirect = clamp
        return any("is low for the lights" in note for note in export(wall).notes)

    least = next(clamp for clamp in 2.0 ** np.arange(-8, 8) if not is_said(clamp))
    lamp.use_nodes = True
    tree = lamp.node_tree
    emission = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    fall = tree.nodes.new("ShaderNodeLightFalloff")
    fall.inputs["Strength"].default_value = 1.0
    tree.links.new(fall.outputs["Quadratic"], emission.inputs["Strength"])
    assert is_said(least)
    assert not is_said(16.0 * least)
    scene.cycles.use_light_tree = False
    assert not is_said(least)
    scene.cycles.use_light_tree = True
    bpy.data.objects.remove(other)
    assert not is_said(least)


@pytest.mark.parametrize(
    ("glossy", "total", "is_said"), [(0, 4, True), (1, 4, True), (2, 4, False), (1, 1, False), (0, 0, False)]
)
def test_few_glossy_bounces_are_said(scene: Any, export: Any, glossy: int, total: int, is_said: bool) -> None:
    """Unless the limit of all bounces is as low, where that of glossy ones takes nothing away."""
    wall = corner(scene)
    scene.cycles.glossy_bounces, scene.cycles.max_bounces = glossy, total
    said = [note for note in export(wall).notes if note.startswith(f"The limit of glossy bounces is {glossy}: ")]
    assert len(said) == is_said


@pytest.mark.parametrize("fewest", [0, 8])
def test_what_chance_leaves_of_dim_paths_is_clamped_as_in_cycles(
    scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any, fewest: int
) -> None:
    """Light of a dark pit, whose dim paths Cycles ends by chance: those that go on are brighter, and clamped sooner.

    How bright a sample is hangs on how often its lobe is drawn: by its Fresnel term alone 0.8 % too bright.
    """
    scene.render.resolution_x = scene.render.resolution_y = 16
    cycles = scene.cycles
    cycles.max_bounces = cycles.diffuse_bounces = 8
    cycles.samples = 1024
    dark = diffuse_material("Dark", (0.3, 0.3, 0.3))
    add_camera("ORTHO", (0, 0, 0.9), (0, 0, 0), ortho_scale=1.6)
    floor = add_quad("Floor", 2.0, 0.0, new_material("Bottom", Base_Color=(0.3, 0.3, 0.3)))
    for number in range(4):
        wall = add_quad(f"Wall {number}", 2.0, 0.0, dark)
        angle = number * math.pi / 2
        wall.location, wall.rotation_euler = (math.cos(angle), math.sin(angle), 1.0), (0, -math.pi / 2, angle)
    add_quad("Lid", 2.0, 2.0, dark)
    add_light("SPOT", (0, 0, 1.0), (math.pi, 0, 0), energy=100.0, spot_size=0.8, shadow_soft_size=0.01)
    plain = render_cycles()
    cycles.sample_clamp_indirect, cycles.min_light_bounces, cycles.samples = 0.1, fewest, 8192
    expected = render_cycles()
    ours = picture_of(export(floor, reference=scene_reference(expected)), rounds=192)
    assert ours.mean() == pytest.approx(expected.mean(), rel=0.005)  # two and a half deviations of the noise of both
    assert plain.mean() > 1.5 * expected.mean()
