# SPDX-License-Identifier: Apache-2.0
"""The backend's own environment: made, refused, cancelled and removed, with one tiny wheel instead of Mitsuba."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from blender_addon.backend import backend_folder, backend_install, interpreters
from blender_addon.backend.backend_folder import LOCK, installed_python, is_outdated, remove_all
from blender_addon.backend.backend_install import BackendInstall
from blender_addon.backend.interpreters import InterpreterError, find_interpreter

from .wheel_folder import NAME, write_wheel

ROOT = Path(__file__).resolve().parents[3]
BASE = getattr(sys, "_base_executable", sys.executable)


def finished(install: BackendInstall, seconds: float = 240) -> BackendInstall:
    end = time.monotonic() + seconds
    while install.outcome is None:
        assert time.monotonic() < end, install.lines
        install.poll()
        time.sleep(0.02)
    return install


@pytest.fixture
def wheels(tmp_path: Path) -> tuple[str, Path]:
    """Folder of wheels and its lock file."""
    lock = write_wheel(tmp_path / "wheels")
    return str(tmp_path / "wheels"), lock


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "Benutzer Ünal" / "backend"  # a space and a letter outside ASCII


@pytest.mark.slow
def test_install_from_a_folder_and_remove(folder: Path, wheels: tuple[str, Path]) -> None:
    source, lock = wheels
    first = finished(BackendInstall(folder, BASE, source, lock))
    assert first.outcome is not None
    assert first.outcome.status == "installed", first.lines
    python = installed_python(folder, lock)
    assert python is not None
    code = f"import importlib.metadata as m; print(m.version('{NAME}'))"
    told = subprocess.run([python, "-I", "-c", code], capture_output=True, text=True, check=True).stdout
    assert told.strip() == "1.0"
    assert any(line.startswith("$ ") and "--require-hashes" in line and "--no-index" in line for line in first.lines)
    assert not list(Path(BASE).parent.parent.glob(f"lib*/python*/site-packages/{NAME}*"))  # not in the base

    newer = backend_folder.new_environment(folder, lock)
    backend_folder.complete(newer, {})
    assert list(folder.glob("env-*")) == [newer]  # the old one went when the new one was complete

    other = lock.with_name("next.lock")
    other.write_text(lock.read_text() + "# a newer version\n")
    assert installed_python(folder, other) is None
    assert is_outdated(folder, other)
    assert remove_all(folder) == []
    assert not folder.exists()


@pytest.mark.slow
def test_a_wheel_with_another_hash_is_refused_and_nothing_stays(folder: Path, wheels: tuple[str, Path]) -> None:
    source, lock = wheels
    lock.write_text(re.sub(r"sha256:\w+", "sha256:" + "0" * 64, lock.read_text()))
    outcome = finished(BackendInstall(folder, BASE, source, lock)).outcome
    assert outcome is not None
    assert outcome.status == "failed"
    assert "hash differs" in outcome.sentence
    assert not list(folder.glob("env-*"))
    assert (folder / "install.log").is_file()


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such groups")
def test_cancel_ends_the_whole_group_and_removes_the_environment(
    folder: Path, wheels: tuple[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(backend_install, "CLEAN_UP_SECONDS", 3600.0)  # it ends by itself, nobody kills it
    source, lock = wheels
    install = BackendInstall(folder, BASE, source, lock)
    end = time.monotonic() + 30
    while not list(folder.glob("env-*/*")):  # venv is at work
        assert time.monotonic() < end
        time.sleep(0.01)
    install.cancel()
    assert install.step == "Cancelling"
    outcome = finished(install).outcome
    assert outcome is not None
    assert (outcome.status, outcome.sentence) == ("cancelled", "Cancelled; nothing was installed.")
    assert not list(folder.glob("env-*"))
    assert install.pid is not None
    end = time.monotonic() + 5  # the system may take a moment to bury what was killed
    while group_lives(install.pid):
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGKILL")
def test_it_ends_and_cleans_up_when_blender_is_killed(folder: Path, wheels: tuple[str, Path], tmp_path: Path) -> None:
    source, lock = wheels
    script = tmp_path / "blender.py"
    script.write_text(
        "import sys, time; from pathlib import Path; from blender_addon.backend.backend_install import BackendInstall\n"
        f"i = BackendInstall(Path({str(folder)!r}), {BASE!r}, {source!r}, Path({str(lock)!r}))\n"
        f"while not list(Path({str(folder)!r}).glob('env-*/*')): time.sleep(0.01)\n"
        "print(i.pid, flush=True); time.sleep(60)"
    )
    # the package's __init__ needs bpy, which has no part in this
    stub = tmp_path / "stub" / "blender_addon"
    stub.mkdir(parents=True)
    (stub / "__init__.py").write_text(f"__path__ = [{str(ROOT / 'blender_addon')!r}]")
    environment = os.environ | {"PYTHONPATH": str(stub.parent)}
    blender = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True, env=environment)
    assert blender.stdout is not None
    pid = int(blender.stdout.readline())
    blender.kill()
    blender.wait()
    blender.stdout.close()
    end = time.monotonic() + 5
    while group_lives(pid) or list(folder.glob("env-*")):
        assert time.monotonic() < end, list(folder.glob("env-*/*"))
        time.sleep(0.05)


def group_lives(pid: int) -> bool:
    try:
        os.killpg(pid, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.skipif(os.name == "nt", reason="a root user may write everywhere")
def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    outcome = finished(BackendInstall(tmp_path / "file" / "backend", BASE)).outcome
    assert outcome is not None
    assert outcome.status == "failed"
    assert outcome.sentence.startswith(f"The backend cannot be installed in {tmp_path / 'file' / 'backend'}")


@pytest.mark.parametrize(
    ("line", "wheels", "words"),
    [
        ("ERROR: Could not install packages due to an OSError: [Errno 28] No space left on device", "", "disk is full"),
        ("ERROR: boom went the wheel.", "", "The installation failed: boom went the wheel. The log is"),
        (
            "WARNING: Retrying (Retry(total=0)) after connection broken by 'NewConnectionError(x)': /simple/drjit/\n"
            "ERROR: No matching distribution found for drjit==1.5.0",
            "",
            "could not be downloaded (NewConnectionError)",
        ),
        ("ERROR: No matching distribution found for mitsuba==3.9.1", "/w", "/w has no wheel of mitsuba==3.9.1 for Py"),
        (
            "ERROR: No matching distribution found for drjit==1.5.0",
            "",
            "drjit==1.5.0 is not to be had for Python 3.14.1",
        ),
    ],
)
def test_ends_of_the_log(line: str, wheels: str, words: str, tmp_path: Path) -> None:
    log = tmp_path / "install.log"
    log.write_text("Collecting drjit==1.5.0\n" + line + "\n")
    assert words in backend_install._why(log, wheels, "3.14.1")


def fake_python(path: Path, version: str, bits: int = 64, missing: str = "[]") -> str:
    path.write_text(
        f'#!/bin/sh\necho \'{{"version": [{version}], "bits": {bits}, "path": "{path}", "missing": {missing}}}\'\n'
    )
    path.chmod(0o755)
    return str(path)


@pytest.mark.skipif(os.name == "nt", reason="the stand-ins are shell scripts")
@pytest.mark.parametrize(
    ("about", "words"),
    [
        ({"version": "3, 9, 18"}, "is Python 3.9.18, which is not one of the versions 3.10 to 3.14"),
        ({"version": "3, 15, 0"}, "not one of the versions 3.10 to 3.14"),
        ({"version": "3, 12, 1", "bits": 32}, "32-bit program"),
        ({"version": "3, 12, 1", "missing": '["ensurepip"]'}, "install python3-venv"),
    ],
)
def test_unsuitable_interpreters(about: dict, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = fake_python(tmp_path / "python", **about)
    with pytest.raises(InterpreterError, match=words):
        find_interpreter(path)
    monkeypatch.setattr(interpreters, "_candidates", lambda: iter([Path(path), Path("/nowhere/python")]))
    with pytest.raises(InterpreterError, match=f"No suitable Python .* Found and not suitable: {path}"):
        find_interpreter("", own="/nowhere/blender/python")


@pytest.mark.skipif(os.name == "nt", reason="the stand-ins are shell scripts")
def test_the_first_suitable_one_wins_and_blenders_comes_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dead = tmp_path / "shim"  # as pyenv leaves for versions that are not chosen
    dead.write_text("#!/bin/sh\necho 'pyenv: python3.12: command not found' >&2\nexit 127\n")
    dead.chmod(0o755)
    old, good, own = (tmp_path / name for name in ("old", "good", "own"))
    fake_python(old, "3, 9, 1"), fake_python(good, "3, 11, 2"), fake_python(own, "3, 13, 0")
    monkeypatch.setattr(interpreters, "_candidates", lambda: iter([dead, old, good]))
    assert find_interpreter("", own=str(own)).path == good
    monkeypatch.setattr(interpreters, "_candidates", lambda: iter([dead, old]))
    assert find_interpreter("", own=str(own)).path == own


def test_a_chosen_program_that_is_no_python(tmp_path: Path) -> None:
    for path in (tmp_path / "nowhere", tmp_path):
        with pytest.raises(InterpreterError, match="is not a Python"):
            find_interpreter(str(path))


def test_versions_are_those_of_the_project() -> None:
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    found = re.search(r'requires-python = ">=(\d+)\.(\d+),<(\d+)\.(\d+)"', text)
    assert found is not None
    low, high = tuple(map(int, found.groups()[:2])), tuple(map(int, found.groups()[2:]))
    assert (low, (high[0], high[1] - 1)) == (interpreters.OLDEST, interpreters.NEWEST)
    assert LOCK == ROOT / "requirements" / "backend.lock"


def test_leftovers_of_broken_installs_go_after_a_day(tmp_path: Path) -> None:
    old, fresh, new = (tmp_path / f"env-12345678-{n}" for n in (1, 2, 3))
    for environment in (old, fresh, new):
        environment.mkdir()
    day_ago = time.time() - 25 * 3600
    os.utime(old, (day_ago, day_ago))
    backend_folder.complete(new, {"python": "3.12.1"})
    assert sorted(p.name for p in tmp_path.iterdir()) == [fresh.name, new.name]
