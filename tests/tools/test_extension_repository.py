# SPDX-License-Identifier: Apache-2.0
"""The zip and the static repository that are built without Blender; tests/blender holds them against Blender's."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    path = ROOT / "tools" / "extension_repository.py"
    spec = importlib.util.spec_from_file_location("extension_repository", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_zip_and_listing_agree(tool: ModuleType, tmp_path: Path) -> None:
    archive = tool.build_repository(ROOT, tmp_path)
    listed = json.loads((tmp_path / "index.json").read_text("utf-8"))
    assert listed["version"] == "v1"
    (entry,) = listed["data"]
    assert entry["archive_url"] == f"./{archive.name}"
    assert entry["archive_size"] == archive.stat().st_size
    assert entry["archive_hash"] == "sha256:" + hashlib.sha256(archive.read_bytes()).hexdigest()
    assert "build" not in entry
    with zipfile.ZipFile(archive) as package:
        names = package.namelist()
    assert {"requirements/backend.lock", "blender_manifest.toml", "__init__.py", "blender_addon/__init__.py"} <= set(
        names
    )
    assert "requirements/dev.lock" not in names
    assert not [
        n for n in names if n.endswith(".pyc") or n.split("/")[0] in {"tests", "docs", "tools", "bench", "dist"}
    ]
    before = archive.read_bytes()
    assert tool.build_repository(ROOT, tmp_path).read_bytes() == before


@pytest.mark.parametrize(
    ("path", "is_folder", "pattern", "excluded"),
    [
        ("tests", True, "/tests/", True),
        ("mfo_backend/tests", True, "/tests/", False),
        ("tests", False, "/tests/", False),
        ("a/__pycache__", True, "__pycache__/", True),
        ("a/b.pyc", False, "*.pyc", True),
        ("dev.py", False, "/dev.py", True),
        ("a/dev.py", False, "/dev.py", False),
        (".git", True, ".*", True),
        ("requirements/dev.lock", False, "/requirements/dev.lock", True),
    ],
)
def test_patterns(tool: ModuleType, path: str, is_folder: bool, pattern: str, excluded: bool) -> None:
    assert tool._excluded(path, is_folder, [pattern]) is excluded
