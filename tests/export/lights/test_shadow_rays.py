# SPDX-License-Identifier: Apache-2.0
"""What shadow rays pass by: lights and objects without shadows, and surfaces that alpha cuts out. Oracle: Cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

SEED = 1  # a fine ball, which no sentence names


@pytest.mark.parametrize(
    "settings",
    [
        ("lamp shadow",),
        ("lamp shadow", "lamp radius"),
        ("box without shadow", "target without shadow"),
        ("box cut-out",),
        ("box cut-out", "full shadow"),
        ("cut-out", "film transparent", "glowing box"),
        ("stack",),
    ],
    ids=" and ".join,
)
def test_the_picture_is_that_of_cycles_without_a_note(settings: tuple[str, ...], mitsuba: Any, tmp_path: Path) -> None:
    from studies.differential.study import try_scene

    outcome = try_scene(settings, SEED, tmp_path, size=32, samples=64)
    if settings == ("stack",) and bpy.app.version < (5, 0, 0):  # which goes through one surface more
        assert [note[:35] for note in outcome.notes] == ["The limit of transparent bounces is"]
        return
    assert outcome.notes == ()
    assert outcome.difference is not None
    assert not outcome.difference.is_failure


@pytest.mark.skipif(bpy.app.version < (5, 0, 0), reason="older Blenders go through one surface more")
def test_the_last_surface_that_may_be_met_shows_its_own_light(mitsuba: Any, tmp_path: Path) -> None:
    """Half a ball that glows, behind panes: it was 12 % too dark."""
    from studies.differential.study import try_scene

    outcome = try_scene(("stack", "glowing", "two-sided target"), 30033, tmp_path, size=32, samples=64)
    assert outcome.difference is not None
    assert not outcome.difference.is_failure
    assert abs(outcome.difference.level) < 0.01


@pytest.mark.parametrize(
    ("settings", "seed"),
    [(("max bounces", "box cut-out"), 40242), (("cut-out", "scaled scene", "glowing room"), 60084)],
    ids=["behind its last bounce", "to the end of what the camera sees"],
)
def test_a_path_goes_straight_on(settings: tuple[str, ...], seed: int, mitsuba: Any, tmp_path: Path) -> None:
    """0.4 % of all light was missing behind a box that is cut out, and 0.5 % too much beyond the camera's far end."""
    from studies.differential.study import try_scene

    outcome = try_scene(settings, seed, tmp_path, size=32, samples=256)
    assert outcome.difference is not None
    assert not outcome.difference.is_failure
    assert abs(outcome.difference.level) < 0.0015


def test_a_glowing_object_without_shadow_is_named(tmp_path: Path) -> None:
    from blender_addon.export.job import check_export
    from studies.differential.random_scene import build

    rig = build(("box without shadow", "glowing box"), SEED, tmp_path, size=32, samples=1)
    (said,) = check_export(bpy.context, rig.target)[1]
    assert said.startswith("An object of the glowing material 'Box' casts no shadows")


@pytest.mark.parametrize(("other", "is_said"), [("glowing box", True), ("world picture", True), ("lamp radius", False)])
def test_light_that_samples_and_rays_find_alike_is_named_where_an_object_casts_no_shadow(
    other: str, is_said: bool, tmp_path: Path
) -> None:
    from blender_addon.export.job import check_export
    from studies.differential.random_scene import build

    rig = build(("target without shadow", other), SEED, tmp_path, size=32, samples=1)
    notes = check_export(bpy.context, rig.target)[1]
    assert any(note.startswith("An object of material 'Ball' casts no shadows") for note in notes) == is_said


def test_recorded_paths_see_the_same(mitsuba: Any, tmp_path: Path) -> None:
    """The floor, in the shadow of a box that is cut out."""
    from blender_addon.export.job import export_job
    from mfo_backend.job.folder.job_folder import JobFolder
    from mfo_backend.job.folder.request import read_request
    from mfo_backend.job.run.fit_scene import request_materials
    from mfo_backend.render.paths.recorded_scene import RecordedScene
    from mfo_backend.render.pictures.renderer import load_renderer
    from studies.differential.random_scene import build

    rig = build(("box cut-out",), SEED, tmp_path, size=32, samples=4)
    bpy.context.scene.render.filepath = str(tmp_path / "cycles.exr")
    bpy.ops.render.render(write_still=True)
    report = export_job(bpy.context, rig.floor, tmp_path / "job", reference=tmp_path / "cycles.exr", fit={})
    folder = JobFolder.open(report.folder)
    request = read_request(folder)
    renderer: Any = load_renderer(
        report.folder / request.scene,
        request.target.shape_id,
        model="blender_principled",
        parameters=["roughness"],
        materials=request_materials(folder, request),
        light_paths=request.light_paths,
    )
    recorded = RecordedScene(renderer, int(renderer.target_mask().sum()))
    paths = recorded.record(renderer.start, grid=8, seed=3, near=False)
    groups = paths.tile_groups()
    picture = groups.average(renderer.image(renderer.start, seed=7, spp=256))
    got = recorded.evaluator(paths, groups)(renderer.start)[:, :, 0]
    assert abs(got.mean() / picture.mean() - 1.0) < 0.01  # 0.005 without any shadow to pass
    assert np.abs(got - picture).mean() / picture.mean() < 0.035
