# SPDX-License-Identifier: Apache-2.0
"""Fits in places and at moments that are unusual: long and foreign paths, unsaved files, two Blenders, no room."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from .conftest import HEIGHT, WIDTH
from .fake_backend import RECOVERED, png

ROOT = Path(__file__).resolve().parents[2]
FOREIGN = "Ünïcode 材质 со скобкой (1) 'quoted' %20 $HOME"


def fit(scene: SimpleNamespace, **options: object) -> set[str]:
    return scene.bpy.ops.mfo.fit(**{"reference": scene.reference, "job_folder": scene.job, "object": "Väse"} | options)


def roughness(bpy, material: str = "Glaze") -> float:
    nodes = bpy.data.materials[material].node_tree.nodes
    return next(n for n in nodes if n.type == "BSDF_PRINCIPLED").inputs["Roughness"].default_value


def test_foreign_names_everywhere(scene: SimpleNamespace, tmp_path: Path) -> None:
    """In the paths of .blend, reference and job, in the names of object and material."""
    bpy = scene.bpy
    folder = tmp_path / FOREIGN
    folder.mkdir()
    shutil.copy(scene.reference, folder / "Referenz ß.png")
    bpy.data.objects["Väse"].name, bpy.data.materials["Glaze"].name = "花瓶/\\:*?", "Глазурь \"'/..\\"
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "Szene ñ.blend"))
    assert fit(scene, object="花瓶/\\:*?", reference="//Referenz ß.png", job_folder="//Auftrag é") == {"FINISHED"}
    assert (folder / "Auftrag é" / "result.json").is_file()
    assert bpy.ops.mfo.apply() == {"FINISHED"}
    assert roughness(bpy, "Глазурь \"'/..\\") == pytest.approx(RECOVERED["roughness"], abs=1e-6)  # float32
    assert bpy.ops.mfo.show_pictures() == {"FINISHED"}


def test_a_very_long_path(scene: SimpleNamespace, tmp_path: Path) -> None:
    """700 characters: far over the 260 of old systems, below the 1024 that Blender keeps for a path."""
    folder = tmp_path
    while len(str(folder)) < 600:
        folder = folder / ("long name " * 9).strip()
    job = folder / ("j" * 90)
    assert fit(scene, job_folder=str(job)) == {"FINISHED"}
    assert (job / "result.json").is_file()
    assert scene.bpy.ops.mfo.apply() == {"FINISHED"}
    assert scene.bpy.data.materials["Glaze"].mfo.job_folder == str(job)


def test_a_file_that_was_never_saved(scene: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bpy = scene.bpy
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert not bpy.data.filepath
    assert fit(scene, job_folder="") == {"FINISHED"}  # into the add-on's own folder
    folder = Path(bpy.context.window_manager.mfo_runtime.job_folder)
    assert folder.parent == tmp_path / "material_fit_jobs"
    assert bpy.ops.mfo.apply() == {"FINISHED"}


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="needs a folder that even root cannot write to")
def test_a_folder_for_temporary_files_that_is_read_only(
    scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", "/proc/self")
    with pytest.raises(RuntimeError, match=r"/proc/self/material_fit_jobs/.* cannot be written"):
        fit(scene, job_folder="")
    assert scene.bpy.context.window_manager.mfo_runtime.state == "FAILED"
    assert fit(scene) == {"FINISHED"}  # a folder of the user's choice still works


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_disk_that_is_full_when_the_backend_starts(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    import builtins

    real_open = builtins.open

    def full(file, mode="r", *rest, **named):
        is_log = str(file).endswith("backend.log") and "w" in mode
        if is_log:
            raise OSError(28, os.strerror(28), str(file))
        return real_open(file, mode, *rest, **named)

    monkeypatch.setattr(builtins, "open", full)
    with pytest.raises(RuntimeError, match=r"could not be started .*No space left on device"):
        fit(scene)
    assert not Path(scene.job).exists()


def test_two_blenders_choose_two_folders(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.backend.preferences import new_job_folder

    context, first = scene.bpy.context, os.getpid()
    names = set()
    for pid in (first, first + 1):
        monkeypatch.setattr(os, "getpid", lambda pid=pid: pid)
        names.add(new_job_folder(context, "Glaze").name[20:])  # after the time
    assert names == {f"Glaze_{first}", f"Glaze_{first + 1}"}


def test_jobs_lie_among_temporary_files_where_blender_has_no_folder_for_them(scene, monkeypatch) -> None:
    from blender_addon.backend.preferences import new_job_folder

    monkeypatch.setattr(scene.bpy.utils, "extension_path_user", lambda *_, **__: "")
    folder = new_job_folder(scene.bpy.context, "Glaze")
    assert folder.parent == Path(tempfile.gettempdir()) / "material_fit_jobs"


def test_two_blenders_at_once(scene: SimpleNamespace, tmp_path: Path) -> None:
    """Same material, same default folder, about the same time: two jobs, two results."""
    png(tmp_path / "reference.png", (180, 60, 40), WIDTH, HEIGHT)
    code = (
        "import bpy, os, pathlib, sys, tempfile, time, blender_addon; blender_addon.register();"
        f"tempfile.tempdir = {str(tmp_path)!r}; bpy.context.scene.view_settings.view_transform = 'Standard';"
        f"bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = {WIDTH}, {HEIGHT};"
        f"folder = pathlib.Path({str(tmp_path)!r}); (folder / f'ready{{os.getpid()}}').touch()\n"
        "while len(list(folder.glob('ready*'))) < 2: time.sleep(0.01)\n"
        f"assert bpy.ops.mfo.fit(reference={str(tmp_path / 'reference.png')!r}) == {{'FINISHED'}};"
        "assert bpy.ops.mfo.apply() == {'FINISHED'};"
        "print(bpy.context.window_manager.mfo_runtime.job_folder, flush=True); os._exit(0)"
    )
    environment = os.environ | {"MFO_FAKE": json.dumps({"seconds": 1}), "PYTHONPATH": str(ROOT)}
    both = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment)
        for _ in range(2)
    ]
    folders = [process.communicate(timeout=200)[0].splitlines()[-1] for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert len(set(folders)) == 2
    for folder in folders:
        assert json.loads(Path(folder, "result.json").read_text("utf-8"))["status"] == "stale"
