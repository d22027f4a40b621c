# SPDX-License-Identifier: Apache-2.0
"""What must hold for the repository as a whole: versions, licences, lock files, length of the README."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

import mfo_backend

ROOT = Path(__file__).resolve().parent.parent
MANIFEST = (ROOT / "blender_manifest.toml").read_text("utf-8")
SOURCES = sorted(
    path
    for path in ROOT.rglob("*.py")
    if not any(part in ("build", "dist") or part.startswith(".") for part in path.relative_to(ROOT).parts)
)
LOCKS = sorted((ROOT / "requirements").glob("*.lock"))


def test_manifest_and_backend_have_one_version() -> None:
    found = re.search(r'^version = "([^"]+)"', MANIFEST, re.MULTILINE)
    assert found is not None
    assert found[1] == mfo_backend.__version__


def test_first_lines_name_the_licence() -> None:
    def is_named(path: Path) -> bool:
        is_of_blender = path.relative_to(ROOT).parts[0] in ("blender_addon", "__init__.py")
        licence = "GPL-3.0-or-later" if is_of_blender else "Apache-2.0"
        return f"# SPDX-License-Identifier: {licence}" in path.read_text("utf-8").splitlines()[:2]

    assert len(SOURCES) > 1000
    assert [str(path.relative_to(ROOT)) for path in SOURCES if not is_named(path)] == []


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.name)
def test_locks_have_hashes_and_no_addresses(path: Path) -> None:
    text = path.read_text("utf-8")
    assert "://" not in text
    packages = re.findall(r"^[A-Za-z0-9._-]+==", text, re.MULTILINE)
    assert len(packages) >= 10
    blocks = re.split(r"^(?=[A-Za-z0-9._-]+==)", text, flags=re.MULTILINE)[1:]
    assert all("--hash=sha256:" in block for block in blocks)


def test_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) < 100


def test_importing_the_backend_is_quick_and_light() -> None:
    # The budget is 0.2 s; a heavy module on the way costs more than that alone, so look for those, not at the clock.
    code = (
        "import sys, mfo_backend, mfo_backend.cli.main;"
        "print(sorted({'mitsuba', 'drjit', 'scipy', 'matplotlib', 'OpenEXR'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"


def test_numpy_computes_with_one_thread_under_plain_pytest_in_a_study_and_in_the_command(tmp_path: Path) -> None:
    """With more threads the order of its sums, and with it the end of a fit of glass, depends on the machine."""
    seen = tmp_path / "seen"
    hook = (
        "import importlib.abc, os, pathlib, sys\n"
        "class Hook(importlib.abc.MetaPathFinder):\n"
        "    def find_spec(self, name, path, target=None):\n"
        "        if name == 'numpy':\n"
        f"            pathlib.Path({str(seen)!r}).write_text(os.environ.get('OPENBLAS_NUM_THREADS', 'not set'))\n"
        "sys.meta_path.insert(0, Hook())\n"
    )
    (tmp_path / "sitecustomize.py").write_text(hook)
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    environment["PYTHONPATH"] = os.pathsep.join([str(tmp_path), str(ROOT)])
    starts = [
        ["pytest", "tests/solve/test_leverage.py", "-q", "-p", "no:cacheprovider"],
        ["studies.cost.solver_yardstick", "--help"],
        ["mfo_backend", "compare", "--help"],
    ]
    for words in starts:
        command = [sys.executable, "-m", *words]
        done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=environment, check=False)
        assert done.returncode == 0, done.stderr
        assert seen.read_text() == "1", words
        seen.unlink()


def test_no_test_reads_an_exr_file_with_one_thread() -> None:
    """Mitsuba would wait for ever, and no limit of time ends it: `two_threads`, or `load_scene` of the export."""

    def is_guarded(lines: list[str], number: int) -> bool:
        return any("two_threads()" in line for line in lines[max(0, number - 2) : number + 1])

    found = []
    for path in (ROOT / "tests").rglob("*.py"):
        lines = path.read_text("utf-8").splitlines()
        reads = [n for n, line in enumerate(lines) if re.search(r"(mi|mitsuba)\.(load_file\(|Bitmap\(str)", line)]
        found += [f"{path.name}:{number + 1}" for number in reads if not is_guarded(lines, number)]
    assert found == []


@pytest.fixture
def dev() -> ModuleType:
    spec = importlib.util.spec_from_file_location("dev", ROOT / "dev.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_quick_tests_exist(dev: ModuleType) -> None:
    assert [path for path in dev.QUICK if not (ROOT / path).exists()] == []


def test_what_a_zip_holds_is_listed(
    dev: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "dist").mkdir()
    with zipfile.ZipFile(tmp_path / "dist" / "made.zip", "w") as archive:
        for name, size in (("LICENSE", 1200), ("addon/a.py", 3000), ("addon/pictures/b.png", 5400)):
            archive.writestr(name, b" " * size)
    monkeypatch.setattr(dev, "ROOT", tmp_path)
    dev.list_contents()
    said = [line.split() for line in capsys.readouterr().err.splitlines()]
    assert said[0][:2] == ["dev.py:", "made.zip,"]
    assert [line[1:] for line in said[1:]] == [["LICENSE", "1", "file", "1", "kB"], ["addon", "2", "files", "8", "kB"]]
