# SPDX-License-Identifier: Apache-2.0
"""The zip in real Blender programs: contents, fit to revert, headless commands, nothing left behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
import zipfile
from pathlib import Path

import pytest

from mfo_backend.job.folder.request import request_from_json

from ..addon import fake_backend
from .conftest import ADDON_ID, RealBlender
from .killed_blender import kill_blender_of_a_graph_fit

pytestmark = pytest.mark.blender
SCRIPTS = Path(__file__).resolve().parent / "scripts"


@pytest.fixture
def variables(tmp_path: Path) -> dict[str, str]:
    """Environment that has the fake backend as the backend's Python."""
    fake_backend.png(tmp_path / "reference.png", (180, 60, 40))
    return {"MFO_BACKEND_PYTHON": str(fake_backend.write_interpreter(tmp_path / "backend_python"))}


def test_zip_holds_both_halves_and_nothing_else(blender: RealBlender) -> None:
    with zipfile.ZipFile(blender.package) as package:
        names = package.namelist()
    tops = {name.split("/")[0] for name in names}
    assert {"__init__.py", "blender_manifest.toml", "blender_addon", "mfo_backend", "LICENSE", "LICENSES"} <= tops
    assert not tops & {"tests", "docs", "tools", "dev.py", "pyproject.toml", "dist", ".git", ".ci", ".gitignore"}
    assert not [n for n in names if n.endswith((".pyc", ".so", ".pyd", ".whl")) or "__pycache__" in n]


def test_fit_apply_undo_revert(blender: RealBlender, tmp_path: Path, variables: dict[str, str]) -> None:
    out = blender.script(SCRIPTS / "fit_apply_revert.py", ADDON_ID, str(tmp_path), **variables)
    assert "ALL GOOD" in out
    asked = json.loads((tmp_path / "job" / "request.json").read_text("utf-8"))
    assert asked["fit"]["preset"] == "balanced"
    assert request_from_json(asked).target.object == "Cube"  # every socket of this version is understood


def test_interpreter_and_job_root_from_the_preferences(
    blender: RealBlender, tmp_path: Path, variables: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MFO_BACKEND_PYTHON", raising=False)
    arguments = [ADDON_ID, str(tmp_path), variables["MFO_BACKEND_PYTHON"]]
    assert "ALL GOOD" in blender.script(SCRIPTS / "preferences.py", *arguments)
    assert len(list((tmp_path / "jobs").iterdir())) == 1


def test_a_script_that_fails_ends_blender_with_an_exit_code(blender: RealBlender, variables: dict[str, str]) -> None:
    done = blender.run(
        "--addons", ADDON_ID, "--python-exit-code", "7",
        "--python-expr", "import bpy; bpy.ops.mfo.fit(reference='/nowhere/picture.exr')",
        check=False, **variables,
    )  # fmt: skip
    assert done.returncode == 7
    assert "/nowhere/picture.exr" in done.stdout + done.stderr


def test_enable_and_disable_leave_nothing(blender: RealBlender) -> None:
    assert "ALL GOOD" in blender.script(SCRIPTS / "leaves_nothing.py", ADDON_ID)


def test_headless_commands(blender: RealBlender, tmp_path: Path, variables: dict[str, str]) -> None:
    file, job, out = tmp_path / "scene.blend", tmp_path / "job", tmp_path / "applied.blend"
    blender.script(SCRIPTS / "save_scene.py", str(file))
    headless = str(next(blender.profile.rglob("blender_addon/headless.py")))

    def command(*arguments: str) -> tuple[int, dict]:
        done = blender.run("--python", headless, "--", *arguments, check=False)
        line = next(x for x in reversed(done.stdout.splitlines()) if x.startswith("{"))
        return done.returncode, json.loads(line)

    common = ["--reference", str(tmp_path / "reference.png"), "--job", str(job)]
    code, answer = command("export", str(file), "--object", "Cube", *common, "--fit", '{"preset": "paper"}')
    assert (code, answer["status"]) == (0, "ok")
    run = [variables["MFO_BACKEND_PYTHON"], "-m", "mfo_backend", "run", str(job)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(run, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet) as backend:
        backend.wait(60)
    code, answer = command("apply", str(file), "--job", str(job), "--save-as", str(out))
    assert (code, answer["status"], answer["material"]) == (0, "ok", "Material")
    assert answer["sockets"]["Roughness"] == 0.3125
    assert out.is_file()
    code, answer = command("export", str(file), "--object", "Nobody", *common)
    assert code == 2
    assert "'Nobody'" in answer["sentence"]
    assert "Cube" in answer["sentence"]


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_the_backend_ends_with_blender(blender: RealBlender, tmp_path: Path, variables: dict[str, str]) -> None:
    """SIGKILL Blender while a fit runs: the backend sees the end of its stdin."""
    environment = (
        os.environ | {"BLENDER_USER_RESOURCES": str(blender.profile), "MFO_FAKE": '{"seconds": 120}'} | variables
    )
    command = [blender.program, "--background", "--factory-startup", "--addons", ADDON_ID]
    script = ["--python", str(SCRIPTS / "fit_until_killed.py"), "--", str(tmp_path)]
    with subprocess.Popen(
        [*command, *script], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as killed:
        pid_file = tmp_path / "pids.json"
        end = time.monotonic() + 60
        while not pid_file.exists():
            assert time.monotonic() < end
            assert killed.poll() is None
            time.sleep(0.1)
        pids = json.loads(pid_file.read_text())
        os.kill(pids["backend"], 0)
        os.kill(pids["blender"], signal.SIGKILL)
    end = time.monotonic() + 5
    while Path(f"/proc/{pids['backend']}").exists() if Path("/proc").exists() else _alive(pids["backend"]):
        assert time.monotonic() < end, "the backend outlived Blender by five seconds"
        time.sleep(0.05)


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="looks for processes in /proc")
def test_nothing_lives_on_after_a_graph_fit(
    blender: RealBlender, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the real backend, and the Blender that evaluates nodes for it."""
    monkeypatch.setenv("BLENDER_USER_RESOURCES", str(blender.profile))
    command = [blender.program, "--background", "--factory-startup", "--addons", ADDON_ID, "--python"]
    kill_blender_of_a_graph_fit(command, tmp_path, ADDON_ID)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_no_socket_of_the_principled_is_dropped_in_silence(blender: RealBlender) -> None:
    """As tests/export/materials/test_materials.py, with the sockets of this Blender: Thin Wall came with 5.2."""
    walk = Path(__file__).resolve().parents[1] / "export" / "socket_walk.py"
    assert "SILENT []" in blender.run("--python-exit-code", "3", "--python", str(walk)).stdout
