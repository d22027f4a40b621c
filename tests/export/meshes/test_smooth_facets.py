# SPDX-License-Identifier: Apache-2.0
"""Coarse meshes shaded smoothly, whose facets would shadow themselves. Oracle: Cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.job import check_export
from blender_addon.versions import shadow_terminator

from ..scenes import add_camera, add_light, new_material

SIZE = 48


def coarse_ball(scene: Any, geometry_offset: float, shading_offset: float, **sockets: Any) -> Any:
    """A sphere of twelve by six facets under a lamp from the side, whose terminator and outline are in view."""
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=6)
    item = bpy.context.object
    bpy.ops.object.shade_smooth()
    item.data.materials.append(new_material("Target", **sockets))
    on_object = hasattr(item, "shadow_terminator_shading_offset")  # before Blender 5 in Cycles' settings of it
    owner, name = (item, "shadow_terminator_shading_offset") if on_object else (item.cycles, "shadow_terminator_offset")
    owner.shadow_terminator_geometry_offset = geometry_offset
    setattr(owner, name, shading_offset)
    assert shadow_terminator(item) == pytest.approx((geometry_offset, shading_offset))
    add_light("POINT", (3, -1, 2), energy=600.0, shadow_soft_size=0.0)
    add_camera("PERSP", (0, -5.5, 0), rotation=(np.pi / 2, 0, 0))
    return item


def our_renderer(report: Any) -> Any:
    from mfo_backend.job.folder.job_folder import JobFolder
    from mfo_backend.job.folder.request import read_request
    from mfo_backend.job.run.job_scene import request_materials
    from mfo_backend.render.pictures.renderer import load_renderer

    folder = JobFolder.open(report.folder)
    request = read_request(folder)
    return load_renderer(
        report.folder / request.scene,
        request.target.shape_id,
        model="blender_principled",
        parameters=["roughness"],
        materials=request_materials(folder, request),
        light_paths=request.light_paths,
    )


PLASTIC = {"Base_Color": (0.6, 0.3, 0.15), "Roughness": 0.4}
METAL = {"Base_Color": (0.6, 0.3, 0.15), "Metallic": 1.0, "Roughness": 0.6}


@pytest.mark.parametrize(
    ("geometry_offset", "shading_offset", "sockets"),
    [(0.1, 0.0, PLASTIC), (0.0, 0.0, PLASTIC), (0.5, 0.6, METAL)],
    ids=["default", "off", "both"],
)
def test_light_is_where_cycles_has_it(
    geometry_offset: float,
    shading_offset: float,
    sockets: dict[str, Any],
    scene: Any,
    export: Any,
    render_cycles: Any,
    mitsuba: Any,
    tmp_path: Path,
) -> None:
    item = coarse_ball(scene, geometry_offset, shading_offset, **sockets)
    theirs = render_cycles()
    renderer = our_renderer(export(item, reference=tmp_path / "cycles.exr"))
    ours = renderer.image(renderer.start, seed=1, spp=64)
    assert abs(ours.mean() / theirs.mean() - 1.0) < 0.01
    assert np.abs(ours - theirs).mean() / theirs.mean() < 0.03  # without it 0.06: facets at the terminator are black


def test_recorded_paths_see_the_same(scene: Any, export: Any, render_cycles: Any, mitsuba: Any, tmp_path: Path) -> None:
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    item = coarse_ball(scene, 0.1, 0.6, **PLASTIC)
    render_cycles()
    renderer = our_renderer(export(item, reference=tmp_path / "cycles.exr"))
    recorded = RecordedScene(renderer, int(renderer.target_mask().sum()))
    paths = recorded.record(renderer.start, grid=8, seed=3, near=False)
    groups = paths.tile_groups()
    picture = groups.average(renderer.image(renderer.start, seed=7, spp=256))
    got = recorded.evaluator(paths, groups)(renderer.start)[:, :, 0]
    assert np.abs(got - picture).mean() / picture.mean() < 0.02


@pytest.mark.parametrize(("segments", "is_named"), [(12, True), (48, False)])
def test_meshes_whose_normals_turn_far_are_named(segments: int, is_named: bool, scene: Any) -> None:
    coarse_ball(scene, 0.1, 0.0, **PLASTIC)
    bpy.data.objects.remove(bpy.context.object)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments // 2)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(new_material("Other"))
    errors, notes = check_export(bpy.context, bpy.context.object)
    assert not errors
    assert any("smooth over few faces" in note for note in notes) == is_named


@pytest.mark.parametrize("smooth", [0, 5, 6])
def test_other_objects_with_smooth_faces_are_named(smooth: int, scene: Any) -> None:
    """A box with flat faces too was up to a fifth of the picture's mean too bright in places, a smooth one a sixth."""
    item = coarse_ball(scene, 0.1, 0.0, **PLASTIC)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.mesh.primitive_cube_add(size=0.5, location=(1.2, 0.0, 0.0))
    bpy.context.object.name = "Box"
    for polygon in bpy.context.object.data.polygons[:smooth]:
        polygon.use_smooth = True
    notes = check_export(bpy.context, item)[1]
    assert any("Object 'Box' is smooth over few faces" in note for note in notes) == bool(smooth)
