# SPDX-License-Identifier: Apache-2.0
"""What must hold for the repository as a whole: versions, licences, lock files, length of the README."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import mfo_backend

ROOT = Path(__file__).resolve().parent.parent
MANIFEST = (ROOT / "blender_manifest.toml").read_text("utf-8")
SOURCES = sorted(
    path
    for path in ROOT.rglob("*.py")
    if not {".venv", "build", "dist"} & set(path.relative_to(ROOT).parts) and not path.parts[-1].startswith(".")
)
LOCKS = sorted((ROOT / "requirements").glob("*.lock"))


def test_manifest_and_backend_have_one_version() -> None:
    found = re.search(r'^version = "([^"]+)"', MANIFEST, re.MULTILINE)
    assert found is not None
    assert found[1] == mfo_backend.__version__


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_first_lines_name_the_licence(path: Path) -> None:
    parts = path.relative_to(ROOT).parts
    licence = "GPL-3.0-or-later" if parts[0] in ("blender_addon", "__init__.py") else "Apache-2.0"
    head = path.read_text("utf-8").splitlines()[:2]
    assert f"# SPDX-License-Identifier: {licence}" in head


@pytest.mark.parametrize("path", LOCKS, ids=lambda path: path.name)
def test_locks_have_hashes_and_no_addresses(path: Path) -> None:
    text = path.read_text("utf-8")
    assert "://" not in text
    packages = re.findall(r"^[A-Za-z0-9._-]+==", text, re.MULTILINE)
    assert len(packages) >= 10
    blocks = re.split(r"^(?=[A-Za-z0-9._-]+==)", text, flags=re.MULTILINE)[1:]
    assert all("--hash=sha256:" in block for block in blocks)


def test_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) < 120


def test_importing_the_backend_is_quick_and_light() -> None:
    # The budget is 0.2 s; a heavy module on the way costs more than that alone, so look for those, not at the clock.
    code = (
        "import sys, mfo_backend, mfo_backend.cli.main;"
        "print(sorted({'mitsuba', 'drjit', 'scipy', 'matplotlib', 'OpenEXR'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"
