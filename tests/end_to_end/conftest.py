# SPDX-License-Identifier: Apache-2.0
"""Files of one small scene for all tests here, made by the Blender in this process; `mfo` has processes of its own."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mfo_backend.cli import blender_host
from mfo_backend.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
SIZE = 64


@dataclass(frozen=True)
class Done:
    """A finished `mfo` command."""

    code: int
    stdout: str
    stderr: str

    @property
    def answer(self) -> dict[str, Any]:
        """The object that --json printed."""
        return json.loads(self.stdout)

    @property
    def sentence(self) -> str:
        """The last line on stderr."""
        return self.stderr.strip().splitlines()[-1]


def run_mfo(*arguments: object, environment: dict[str, str] | None = None) -> Done:
    """Run `mfo` from this checkout."""
    words = [sys.executable, "-m", "mfo_backend", *map(str, arguments)]
    env = os.environ | {"PYTHONPATH": str(ROOT)} | (environment or {})
    done = subprocess.run(words, capture_output=True, text=True, env=env, timeout=280)
    return Done(done.returncode, done.stdout, done.stderr)


def run_bpy(code: str, *arguments: object) -> Any:
    """Run a script that opens or builds its scene with the bpy module in this process; returns what it calls `found`.

    `argv` are its arguments, and `render` is `_render`.
    """
    import bpy

    names: dict[str, Any] = {"bpy": bpy, "argv": [str(each) for each in arguments], "render": _render}
    exec(compile(code, "<script>", "exec"), names)
    return names.get("found")


def _render(path: str, samples: int, file_format: str = "OPEN_EXR", color_mode: str = "RGB") -> None:
    """Have Cycles write a picture of the scene."""
    import bpy

    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.seed, scene.render.filepath = samples, 5, path
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode = file_format, color_mode
    bpy.ops.render.render(write_still=True)


def run_headless(*words: object) -> Done:
    """Run a command of the add-on's `headless.py` with the bpy module in this process."""
    from blender_addon import headless

    with contextlib.redirect_stdout(io.StringIO()) as said:
        code = headless.main([str(word) for word in words])
    return Done(code, said.getvalue(), "")


@pytest.fixture
def blender_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blender's part of `mfo` runs in this process, where that runs here, too."""

    def in_this_process(words: Sequence[str], **_: object) -> subprocess.CompletedProcess[str]:
        done = run_headless(*words[list(words).index(blender_host.MODULE) + 1 :])
        return subprocess.CompletedProcess(words, done.code, done.stdout, done.stderr)

    monkeypatch.setattr(blender_host, "subprocess", SimpleNamespace(run=in_this_process))


@pytest.fixture
def mfo_here(blender_here: None) -> Callable[..., Done]:
    """`run_mfo` without a process of its own, for a job that is written to `--out`.

    Each file has a test with processes; to start two or three more for every case takes as long as its fit.
    """

    def run(*arguments: object) -> Done:
        words = [str(word) for word in arguments if word != "--json"]  # which takes the stdout of its process
        result = Path(words[words.index("--out") + 1], "result.json")
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
            code = main(words)
        return Done(code, result.read_text("utf-8") if result.is_file() else "", said.getvalue())

    return run


# one render, written in three ways
RENDER = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
scene = bpy.context.scene
scene.cycles.samples, scene.cycles.seed = 64, 3
bpy.ops.render.render()
settings = scene.render.image_settings
for path, kind, view in ((argv[1], "OPEN_EXR", "Standard"), (argv[2], "PNG", "Standard"), (argv[3], "PNG", "AgX")):
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, scene.view_settings.view_transform = kind, view
    settings.color_depth = "32" if kind == "OPEN_EXR" else "8"
    bpy.data.images["Render Result"].save_render(path)
"""


@dataclass(frozen=True)
class Scene:
    """`start` and `truth` are .blend files, the pictures are renders of the truth by Cycles."""

    folder: Path
    start: Path
    truth: Path
    exr: Path
    png: Path
    agx_png: Path
    object: str = "Suzanne"


@pytest.fixture(scope="session")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    folder = tmp_path_factory.mktemp("scene")
    made = run_headless("demo-scene", folder, "--size", SIZE)
    assert made.code == 0, made.stdout
    files = Scene(
        folder, *(folder / n for n in ("start.blend", "truth.blend", "reference.exr", "reference.png", "agx.png"))
    )
    run_bpy(RENDER, files.truth, files.exr, files.png, files.agx_png)
    return files


@pytest.fixture(scope="session")
def blend(scene: Scene) -> Callable[..., Done]:
    """Run `mfo blend` on the start with further arguments."""

    def call(reference: Path, *arguments: object, file: Path = scene.start) -> Done:
        return run_mfo("blend", file, "--object", scene.object, "--reference", reference, *arguments)

    return call


@dataclass(frozen=True)
class Fitted:
    """A fit of the start to the linear picture, written into a copy; `started_from` is the hash of the file before."""

    done: Done
    job: Path
    saved: Path
    started_from: str


@pytest.fixture(scope="session")
def fitted(scene: Scene, blend: Callable[..., Done], tmp_path_factory: pytest.TempPathFactory) -> Fitted:
    folder = tmp_path_factory.mktemp("fitted")
    job, saved = folder / "job", folder / "recovered.blend"
    before = hashlib.sha256(scene.start.read_bytes()).hexdigest()
    words = ("--preset", "fast", "--apply", "--save-as", saved, "--json")  # `mfo demo` is without a preset
    return Fitted(blend(scene.exr, "--out", job, *words), job, saved, before)
