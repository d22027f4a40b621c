# SPDX-License-Identifier: Apache-2.0
"""Files that Blender saves: whole ones, and those that a full disk cuts, which Blender says it has saved."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.process import saved_file  # noqa: E402
from blender_addon.process.saved_file import save_copy, save_over  # noqa: E402

SMALL = 30_000  # bytes a file may have; Blender's start-up scene has 90,000, and a third of it packed
FULL = """
import resource, signal, sys
from pathlib import Path

import bpy

from blender_addon.process.saved_file import save_copy, save_over

{setting}
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, ({most}, {most}))
try:
    {save}(Path(sys.argv[1]))
except OSError as error:
    print("refused:", error.strerror)
"""
PACKED = "bpy.context.preferences.filepaths.use_file_compression = True"


def saved_with_little_space(path: Path, save: str, setting: str = "", most: int = SMALL) -> str:
    words = [sys.executable, "-c", FULL.format(save=save, setting=setting, most=most), str(path)]
    return subprocess.run(words, capture_output=True, text=True, timeout=120, check=True).stdout


@pytest.mark.parametrize("packed", [False, True])
def test_what_is_saved_can_be_opened(packed: bool, tmp_path: Path) -> None:
    path, filepaths = tmp_path / "scene.blend", bpy.context.preferences.filepaths
    filepaths.use_file_compression = packed
    try:
        save_over(path)
        save_copy(path)
    finally:
        filepaths.use_file_compression = False
    assert path.read_bytes().startswith(b"\x28\xb5\x2f\xfd") == packed
    with bpy.data.libraries.load(str(path)) as (found, _):
        assert found.scenes
    assert sorted(each.name for each in tmp_path.iterdir()) == ["scene.blend", "scene.blend1"]  # Blender's own backup


@pytest.mark.skipif(sys.platform == "win32", reason="there is no limit on the size of files")
@pytest.mark.parametrize(("setting", "most"), [("", SMALL), (PACKED, SMALL // 4)])
def test_half_of_a_file_is_an_error(setting: str, most: int, tmp_path: Path) -> None:
    path = tmp_path / "scene.blend"
    assert "refused: No space left on device" in saved_with_little_space(path, "save_copy", setting, most)
    assert not path.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="there is no limit on the size of files")
def test_a_full_disk_takes_nothing_of_the_file_before(tmp_path: Path) -> None:
    path = tmp_path / "scene.blend"
    path.write_bytes(b"an hour of work")
    assert "refused: No space left on device" in saved_with_little_space(path, "save_over")
    assert [each.name for each in tmp_path.iterdir()] == ["scene.blend"]
    assert path.read_bytes() == b"an hour of work"


def test_a_file_is_whole_by_its_last_block_and_not_by_a_text_of_its_name(tmp_path: Path) -> None:
    path, filepaths = tmp_path / "scene.blend", bpy.context.preferences.filepaths
    before, filepaths.use_file_compression = filepaths.use_file_compression, False
    bpy.context.scene["ENDB"] = "ENDB"
    try:
        save_copy(path)
    finally:
        filepaths.use_file_compression = before
        del bpy.context.scene["ENDB"]
    whole = path.read_bytes()
    last = whole.rindex(b"ENDB")
    assert whole[:last].count(b"ENDB") > 0
    assert saved_file._is_whole(path)
    path.write_bytes(whole[:last])
    assert not saved_file._is_whole(path)
