# SPDX-License-Identifier: Apache-2.0
"""The check follows the files that are chosen, which nobody tells Blender of."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from .found import stopping


def test_a_picture_that_is_written_anew_moved_or_back_is_checked_again(
    scene: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from blender_addon.check import preflight

    asked: list[bool] = []

    def check() -> None:
        asked.append(True)
        preflight.check_now(scene.bpy.context.scene, scene.bpy.context.view_layer)

    monkeypatch.setattr(preflight, "request", check)
    settings, second = scene.bpy.context.scene.mfo, tmp_path / "second.png"
    shutil.copy(scene.reference, second)
    settings.reference_path = scene.reference
    assert scene.bpy.ops.mfo.add_picture() == {"FINISHED"}
    settings.pictures[0].path = str(second)

    def looked() -> int:
        asked.clear()
        preflight.look_at_files()
        return len(asked)

    check()
    assert looked() == 0
    os.utime(second, (1.0, 1.0))
    assert (looked(), looked()) == (1, 0)
    os.rename(scene.reference, tmp_path / "gone.png")
    assert any("reference.png" in sentence for sentence in stopping(scene))
    assert (looked(), looked()) == (1, 0)
    os.rename(tmp_path / "gone.png", scene.reference)
    assert (looked(), looked()) == (1, 0)
