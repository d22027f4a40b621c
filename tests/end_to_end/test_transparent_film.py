# SPDX-License-Identifier: Apache-2.0
"""Display pictures over a transparent film, in which Blender writes half-clear colours as if they were opaque."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from .conftest import Done, Scene, run_bpy

BUILD = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
scene = bpy.context.scene
scene.render.film_transparent = True
bpy.ops.wm.save_as_mainfile(filepath=argv[1])
if argv[2]:
    render(argv[2], 256, "TIFF" if argv[2].endswith(".tif") else "PNG", "RGBA")
"""


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_its_edges_do_not_count(suffix: str, scene: Scene, mfo_here: Callable[..., Done], tmp_path: Path) -> None:
    """They were *close*: *the difference lies at edges: check the camera and the shape*."""
    start, truth, reference = tmp_path / "start.blend", tmp_path / "truth.blend", tmp_path / f"reference{suffix}"
    run_bpy(BUILD, scene.start, start, "")
    run_bpy(BUILD, scene.truth, truth, reference)
    words = ("--object", scene.object, "--reference", reference, "--preset", "fast", "--out", tmp_path / "job")
    done = mfo_here("blend", start, *words)
    assert done.code == 0, done.stderr
    assert done.answer["verdict"] == "same", done.answer["notes"]
    assert any("Half-clear" in note for note in done.answer["notes"])
