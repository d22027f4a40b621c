# SPDX-License-Identifier: Apache-2.0
"""`mfo doctor`: it says what it found, and names a cure for every problem."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

from mfo_backend.cli.checks import machine_checks, optional_checks
from mfo_backend.cli.checks.machine_checks import check_machine
from mfo_backend.cli.checks.optional_checks import check_optional
from mfo_backend.render.machine.llvm import LlvmVerdict
from mfo_backend.render.machine.memory import MemoryLeft

ROOT = Path(__file__).resolve().parents[3]


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
    wanted |= {"memory", "judges", "LPIPS weights", "Octave or MATLAB", "HDR-VDP-3"}
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


def optional() -> dict[str, tuple[str, str]]:
    return {check.name: (check.state, f"{check.found} {check.cure}") for check in check_optional()}


def test_what_is_optional_and_missing_is_no_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(optional_checks, "version", missing)
    for name in ("MFO_LPIPS_WEIGHTS", "MFO_HDRVDP3"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TORCH_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    checks = optional()
    assert {state for state, _ in checks.values()} == {"ok"}
    assert "cvvdp is not installed; optional" in checks["judges"][1]
    assert 'pip install "mfo-backend[judges]"' in checks["judges"][1]
    folder = tmp_path / "hub" / "checkpoints"
    assert f"put torchvision's alexnet-owt-7be5be79.pth into {folder}" in checks["LPIPS weights"][1]
    assert "not on the path; optional" in checks["Octave or MATLAB"][1]
    assert "MFO_HDRVDP3 is not set" in checks["HDR-VDP-3"][1]


@pytest.mark.skipif(os.name == "nt", reason="the stand-in is a script")
def test_what_is_optional_and_there_is_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optional_checks, "version", {"cvvdp": "0.5.7", "lpips": "0.1.4", "torch": "2.13.0"}.get)
    for name in ("vgg16-397923af.pth", "hdrvdp3.m", "octave-cli"):
        (tmp_path / name).write_text("")
        (tmp_path / name).chmod(0o755)
    for name in ("MFO_LPIPS_WEIGHTS", "MFO_HDRVDP3", "PATH"):
        monkeypatch.setenv(name, str(tmp_path))
    checks = optional()
    assert {state for state, _ in checks.values()} == {"ok"}
    assert checks["judges"][1].strip() == "cvvdp 0.5.7, lpips 0.1.4, torch 2.13.0"
    assert "vgg in " in checks["LPIPS weights"][1]
    assert checks["Octave or MATLAB"][1].strip() == str(tmp_path / "octave-cli")
    assert checks["HDR-VDP-3"][1].strip() == str(tmp_path)


def test_what_does_not_fit_is_a_warning_with_a_cure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(optional_checks, "version", {"cvvdp": "0.5.6", "lpips": "0.1.4", "torch": "2.13.0"}.get)
    monkeypatch.setenv("MFO_HDRVDP3", str(tmp_path))
    checks = optional()
    assert checks["judges"][0] == checks["HDR-VDP-3"][0] == "warning"
    assert "run " in checks["judges"][1]
    assert "name the folder that does" in checks["HDR-VDP-3"][1]


def test_lists_what_is_missing_without_numpy() -> None:
    code = (
        "import sys; sys.modules['numpy'] = None; from mfo_backend.cli.checks.optional_checks import check_optional; "
        "print([check.name for check in check_optional()])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, timeout=60)
    assert "HDR-VDP-3" in done.stdout, done.stderr


@pytest.mark.parametrize(
    ("left", "state", "words"),
    [
        ([], "ok", "not told by this system"),
        (
            [MemoryLeft(8_000_000_000, "on this machine"), MemoryLeft(10**12, "there")],
            "ok",
            "8.0 GB left on this machine",
        ),
        ([MemoryLeft(500_000_000, "in this container")], "warning", "0.5 GB left in this container"),
    ],
)
def test_memory_that_is_left(monkeypatch: pytest.MonkeyPatch, left: list[MemoryLeft], state: str, words: str) -> None:
    monkeypatch.setattr(machine_checks, "memory_left", lambda: left)
    check = machine_checks._memory()
    assert (check.state, check.found) == (state, words)
    assert ("raise the limit" in check.cure) == (state == "warning")
