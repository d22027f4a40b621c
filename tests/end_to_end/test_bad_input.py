# SPDX-License-Identifier: Apache-2.0
"""Every wrong input gives one sentence with what was given and what to do, exit code 2, and leaves no trace."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.cli.main import main
from mfo_backend.scene.image_file import write_exr

from .conftest import SIZE, Done, Scene, run_bpy, run_mfo

HEAD = "bpy.data.objects['Suzanne']"
# name -> (what is done to the .blend, words of the sentence)
BROKEN_SCENES = {
    "no camera": ("bpy.data.objects.remove(bpy.data.objects['Camera'])", ("camera",)),
    "no material": (f"{HEAD}.data.materials.clear()", ("material", "Suzanne")),
    "no principled": (
        f"t = {HEAD}.active_material.node_tree\nt.nodes.remove(t.nodes['Principled BSDF'])",
        ("Principled", "Head"),
    ),
    "behind the camera": (f"{HEAD}.location = (0, -40, 0)", ("camera", "Suzanne")),
    "no light": ("bpy.context.scene.world = None", ("light",)),
    "group without output": (
        f"t = {HEAD}.active_material.node_tree\ng = bpy.data.node_groups.new('Wear', 'ShaderNodeTree')\n"
        "g.interface.new_socket('Value', in_out='OUTPUT', socket_type='NodeSocketFloat')\n"
        "n = t.nodes.new('ShaderNodeGroup')\nn.node_tree = g\n"
        "t.links.new(n.outputs[0], t.nodes['Principled BSDF'].inputs['Roughness'])",
        ("Roughness", "group"),
    ),
}
SAVE = "bpy.ops.wm.save_as_mainfile(filepath=argv[{number}], copy=True)\n"
Blend = Callable[..., Done]


@pytest.fixture
def blend(scene: Scene, capsys: pytest.CaptureFixture[str], blender_here: None) -> Blend:
    """Run `mfo blend` on the start with further arguments, in this process; so does Blender's part."""

    def call(reference: Path, *arguments: object, file: Path = scene.start) -> Done:
        words = ["blend", file, "--object", scene.object, "--reference", reference, *arguments]
        code = main([str(word) for word in words])
        return Done(code, *capsys.readouterr())

    return call


@pytest.fixture(scope="module")
def broken_scenes(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A file for each of `BROKEN_SCENES`."""
    folder = tmp_path_factory.mktemp("broken")
    files = {name: folder / f"{name}.blend" for name in BROKEN_SCENES}
    steps = [
        f"bpy.ops.wm.open_mainfile(filepath=argv[0])\n{change}\n{SAVE.format(number=number)}"
        for number, (change, _) in enumerate(BROKEN_SCENES.values(), start=1)
    ]
    run_bpy("".join(steps), scene.start, *files.values())
    return files


def refused(done: Done, job: Path, *words: str) -> None:
    assert done.code == 2, done.stderr
    assert done.sentence.startswith("mfo: ")
    assert "Traceback" not in done.stderr
    for word in words:
        assert word.lower() in done.sentence.lower()
    assert not job.exists()


@pytest.mark.parametrize("name", BROKEN_SCENES)
def test_scene_that_cannot_be_fitted(
    name: str, scene: Scene, blend: Blend, broken_scenes: dict[str, Path], tmp_path: Path
) -> None:
    broken, words = broken_scenes[name], BROKEN_SCENES[name][1]
    before = hashlib.sha256(broken.read_bytes()).hexdigest()
    refused(blend(scene.exr, "--out", tmp_path / "job", file=broken), tmp_path / "job", *words)
    assert hashlib.sha256(broken.read_bytes()).hexdigest() == before


@pytest.mark.parametrize("kind", ["size", "unreadable", "missing", "black", "nan", "infinite"])
def test_reference_that_cannot_be_used(kind: str, scene: Scene, blend: Blend, tmp_path: Path) -> None:
    reference = tmp_path / "reference.exr"
    pixels = np.full((SIZE, SIZE, 3), 0.3, np.float32)
    words = {
        "size": ("32x32", f"{SIZE}x{SIZE}"),
        "unreadable": ("reference.exr",),
        "missing": ("reference.exr", "not exist"),
        "black": ("black",),
        "nan": ("NaN",),
        "infinite": ("infinite",),
    }[kind]
    if kind == "size":
        pixels = pixels[:32, :32]
    elif kind == "black":
        pixels[:] = 0
    elif kind == "nan":
        pixels[3, 4] = np.nan
    elif kind == "infinite":
        pixels[3, 4] = np.inf
    if kind == "unreadable":
        reference.write_bytes(b"not a picture")
    elif kind != "missing":
        write_exr(reference, pixels)
    refused(blend(reference, "--out", tmp_path / "job"), tmp_path / "job", *words)


def test_unknown_parameter(scene: Scene, blend: Blend, tmp_path: Path) -> None:
    done = blend(scene.exr, "--out", tmp_path / "job", "--parameters", "shininess")
    refused(done, tmp_path / "job", "shininess", "roughness")


def test_unknown_object(scene: Scene, tmp_path: Path) -> None:
    done = run_mfo("blend", scene.start, "--object", "Teapot", "--reference", scene.exr, "--out", tmp_path / "job")
    refused(done, tmp_path / "job", "Teapot", "Suzanne")


def test_job_folder_that_cannot_be_written(scene: Scene, blend: Blend, tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    done = blend(scene.exr, "--out", file / "job")
    refused(done, file / "job", str(file))
    assert file.read_text() == "mine"


def test_foreign_folder_is_left_alone(scene: Scene, blend: Blend, tmp_path: Path) -> None:
    (tmp_path / "job").mkdir()
    (tmp_path / "job" / "mine.txt").write_text("mine")
    done = blend(scene.exr, "--out", tmp_path / "job")
    assert done.code == 2
    assert [path.name for path in (tmp_path / "job").iterdir()] == ["mine.txt"]


def test_missing_blender_program(scene: Scene, tmp_path: Path) -> None:
    done = run_mfo(
        "blend", scene.start, "--object", "Suzanne", "--reference", scene.exr, "--blender", tmp_path / "no-blender"
    )
    assert done.code == 3
    assert "no-blender" in done.sentence
