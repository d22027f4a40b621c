# SPDX-License-Identifier: Apache-2.0
"""`mfo doctor`: it says what it found, and names a cure for every problem."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from mfo_backend.cli import machine_checks
from mfo_backend.cli.machine_checks import check_machine
from mfo_backend.render.llvm import LlvmVerdict

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MFO_CACHE_DIR", str(tmp_path / "cache"))
    # the check names the library that it found in the environment; put back what was there
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", os.environ.get("DRJIT_LIBLLVM_PATH", ""))


def doctor(*words: str, **environment: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "mfo_backend", "doctor", *words],
        capture_output=True,
        text=True,
        cwd=ROOT,
        env={**os.environ, **environment},
        timeout=200,
    )


def test_it_says_what_works_here() -> None:
    done = doctor("--json")
    report = json.loads(done.stdout)  # one object and nothing else
    states = {check["name"]: check["state"] for check in report["checks"]}
    assert report["works"] == ("problem" not in states.values())
    assert done.returncode == (0 if report["works"] else 3)
    wanted = {"Python", "mitsuba", "drjit", "OpenEXR", "Mitsuba variant", "GPU", "threads", "cache", "kernel cache"}
    assert wanted <= set(states)
    for check in report["checks"]:
        assert check["found"]
        assert (check["state"] == "ok") == (check["cure"] == "")


def test_the_text_has_a_line_for_every_check(tmp_path: Path) -> None:
    done = doctor(DRJIT_CACHE_DIR=str(tmp_path / "kernels"))
    lines = done.stdout.splitlines()
    assert f"ok      kernel cache: {tmp_path / 'kernels'}" in lines
    assert lines[-1].startswith("The backend can")


def found(name: str):
    (check,) = [check for check in check_machine() if check.name == name]
    return check


@pytest.fixture
def without_llvm(monkeypatch: pytest.MonkeyPatch) -> None:
    bad = LlvmVerdict("/usr/lib/libLLVM-15.so", False, "LLVM ERROR: Cannot select")
    monkeypatch.setattr(machine_checks, "find_llvm", lambda: (None, [bad]))
    monkeypatch.setattr(machine_checks, "needs_llvm", lambda: True)


@pytest.mark.parametrize(
    ("system", "cure"), [("linux", "apt install libllvm19"), ("darwin", "brew install llvm"), ("win32", "LLVM-C.dll")]
)
def test_no_llvm_is_a_problem_with_a_cure(
    without_llvm: None, monkeypatch: pytest.MonkeyPatch, system: str, cure: str
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    checks = list(machine_checks._renderer())
    assert [check.state for check in checks] == ["problem"]
    assert checks[0].found == "/usr/lib/libLLVM-15.so: LLVM ERROR: Cannot select"
    assert cure in checks[0].cure


def test_a_missing_package_is_a_problem(without_llvm: None, monkeypatch: pytest.MonkeyPatch) -> None:
    def version(name: str) -> str:
        if name == "scipy":
            raise machine_checks.PackageNotFoundError(name)
        return {"mitsuba": "3.8.0"}.get(name, "99.0")

    monkeypatch.setattr(machine_checks, "version", version)
    assert found("scipy").state == "problem"
    assert found("scipy").cure == f'Run "{sys.executable}" -m pip install "scipy>=1.11".'
    assert found("mitsuba").found == "3.8.0, needed is mitsuba==3.9.1"
    assert found("numpy").state == "ok"


def test_an_old_python_is_a_problem(without_llvm: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 9, 0, "final", 0))
    assert found("Python").state == "problem"
    assert "3.10 to 3.14" in found("Python").cure


def test_a_cache_that_cannot_be_written_is_a_warning(
    without_llvm: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("MFO_CACHE_DIR", str(tmp_path / "file" / "below"))
    assert found("cache").state == "warning"
    assert "set MFO_CACHE_DIR" in found("cache").cure


def test_the_versions_are_those_of_the_package() -> None:
    text = (ROOT / "pyproject.toml").read_text("utf-8")
    block = re.search(r"\ndependencies = \[(.*?)\n\]", text, re.DOTALL)
    assert block is not None
    listed = set(re.findall(r'"([A-Za-z]+[=>]=[\d.]+)"', block.group(1)))
    checked = {f"{name}=={v}" for name, v in machine_checks.PINNED.items()}
    checked |= {f"{name}>={v}" for name, v in machine_checks.LEAST.items()}
    assert listed == checked
