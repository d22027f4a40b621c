# SPDX-License-Identifier: Apache-2.0
"""Two pictures of one material through `mfo blend`: another camera, another frame, another size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from .conftest import Done, Scene, run_bpy, run_mfo

SIDE = """
import mathutils
for source, target in ((argv[0], argv[2]), (argv[1], argv[3])):
    bpy.ops.wm.open_mainfile(filepath=source)
    scene = bpy.context.scene
    side = bpy.data.objects.new("Side", scene.camera.data)
    side.location = (4.6, -1.2, 1.0)
    side.rotation_euler = (-mathutils.Vector(side.location)).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(side)
    head = scene.objects["Suzanne"]
    head.keyframe_insert("rotation_euler", frame=1)
    head.rotation_euler[2] += 0.6
    head.keyframe_insert("rotation_euler", frame=9)
    scene.frame_end = 10
    scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=target)
settings = scene.render.image_settings
if hasattr(settings, "media_type"):
    settings.media_type = "IMAGE"
settings.file_format, settings.color_depth, scene.cycles.samples = "OPEN_EXR", "32", 64
scene.camera, scene.render.resolution_x, scene.render.resolution_y, scene.render.filepath = side, 64, 48, argv[4]
scene.frame_set(9)
bpy.ops.render.render(write_still=True)
"""


@dataclass(frozen=True)
class Turned:
    """A file with a second camera and frames, and a picture of the truth from there."""

    start: Path
    side: Path


@pytest.fixture(scope="module")
def turned(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Turned:
    folder = tmp_path_factory.mktemp("turned")
    files = [folder / name for name in ("start.blend", "truth.blend", "side.exr")]
    run_bpy(SIDE, scene.start, scene.truth, *files)
    return Turned(files[0], files[2])


def blend(turned: Turned, scene: Scene, *words: object) -> Done:
    return run_mfo("blend", turned.start, "--object", scene.object, "--preset", "fast", *words)


def test_two_pictures_are_fitted_at_once_and_each_has_its_verdict(turned: Turned, scene: Scene, tmp_path: Path) -> None:
    job = tmp_path / "job"
    second = f"{turned.side}@camera=Side,frame=9"
    done = blend(turned, scene, "--reference", scene.exr, "--reference", second, "--out", job, "--json")
    assert done.code == 0, done.stderr
    first, side = done.answer["pictures"]
    assert [(p["number"], p["name"], p["frame"]) for p in (first, side)] == [
        (1, scene.exr.name, 1),
        (2, turned.side.name, 9),
    ]
    assert (first["verdict"], side["verdict"], side["camera"]) == ("same", "same", "Side")
    for picture in (first, side):
        start, result = picture["errors"]["flip"]
        assert result < start / 4
        assert (job / picture["folder"] / "pictures" / "result.png").is_file()
    report = (job / "index.html").read_text("utf-8")
    assert report.count("<h3>Picture ") == 2
    assert f"Picture 2 ({turned.side.name})" in report


def test_what_is_wrong_with_a_picture_is_said_before_the_fit(
    turned: Turned, scene: Scene, mfo_here: Callable[..., Done], tmp_path: Path
) -> None:
    late = f"{turned.side}@frame=99"
    words = ("--object", scene.object, "--reference", scene.exr, "--reference", late, "--out", tmp_path / "job")
    done = mfo_here("blend", turned.start, *words)
    assert done.code == 2
    assert "Picture 2 (side.exr): Frame 99 is outside of the frames 1 to 10" in done.sentence
    assert not (tmp_path / "job").exists()
