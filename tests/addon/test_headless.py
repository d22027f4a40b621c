# SPDX-License-Identifier: Apache-2.0
"""The commands of `headless.py` in a process of the bpy module: answer, exit code, and a clean end."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("bpy", reason="the bpy module is not installed for this Python")
ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("arguments", "code", "status"),
    [
        (("demo-scene", "{}/scene", "--size", "16"), 0, "ok"),
        (("render", "{}/no.blend", "--out", "{}/a.exr"), 2, "bad_input"),
    ],
    ids=["ok", "bad input"],
)
def test_the_process_ends_with_its_code_and_leaves_no_files(
    arguments: tuple[str, ...], code: int, status: str, tmp_path: Path
) -> None:
    (temporary := tmp_path / "temporary").mkdir()
    words = [word.format(tmp_path) for word in arguments]
    done = subprocess.run(
        [sys.executable, "-m", "blender_addon.headless", *words],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT), "TMPDIR": str(temporary)},
        timeout=60,
    )
    assert done.returncode == code
    assert json.loads(done.stdout.strip().splitlines()[-1])["status"] == status
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(("name", "words"), [("", "is a folder"), ("none.blend", "does not exist")])
def test_what_is_no_blend_file_is_called_what_it_is(addon: object, tmp_path: Path, name: str, words: str) -> None:
    from blender_addon.headless import HeadlessError, _open

    with pytest.raises(HeadlessError, match=f"{words}: give a .blend file"):
        _open(tmp_path / name)


def test_a_material_of_a_library_is_made_local_in_the_slot_that_it_is_in(
    scene: SimpleNamespace, tmp_path: Path
) -> None:
    """Another slot may be the active one; the check in Cycles goes the same way."""
    from blender_addon import headless

    from .check.test_libraries import from_library

    bpy, file, saved = scene.bpy, tmp_path / "linked.blend", tmp_path / "fitted.blend"
    assert bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job) == {"FINISHED"}
    target = bpy.data.objects["Väse"]
    target.active_material = from_library(scene, tmp_path, "materials", "Glaze")
    target.data.materials.append(bpy.data.materials.new("Other"))
    target.active_material_index = 1
    bpy.ops.wm.save_as_mainfile(filepath=str(file), copy=True)
    words = [str(file), "--job", scene.job, "--make-local", "--force", "--save-as", str(saved)]
    chosen = headless._parser().parse_args(["apply", *words])
    answer = chosen.run(chosen)
    bpy.ops.wm.open_mainfile(filepath=str(saved))
    material = bpy.data.objects["Väse"].material_slots[0].material
    assert (material.name, material.library) == (answer["material"], None)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    assert shader.inputs["Roughness"].default_value == pytest.approx(answer["sockets"]["Roughness"], abs=1e-6)
