# SPDX-License-Identifier: Apache-2.0
"""The static repository in real Blender programs: ours is what Blender makes, and an installation comes from it."""

from __future__ import annotations

import functools
import http.server
import json
import subprocess
import sys
import threading
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import ROOT, RealBlender

pytestmark = pytest.mark.blender


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_words: object) -> None:
        pass


@pytest.fixture
def built(tmp_path: Path) -> Path:
    folder = tmp_path / "repository"
    subprocess.run([sys.executable, ROOT / "tools" / "extension_repository.py", folder], check=True)
    return folder


@pytest.fixture
def served(built: Path) -> Iterator[str]:
    handler = functools.partial(_Quiet, directory=str(built))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}/index.json"
        server.shutdown()
        thread.join()


def test_ours_is_what_blender_makes(blender: RealBlender, built: Path) -> None:
    (archive,) = built.glob("*.zip")
    blender.run("--command", "extension", "validate", str(archive))
    with zipfile.ZipFile(archive) as ours, zipfile.ZipFile(blender.package) as its:
        assert sorted(ours.namelist()) == sorted(n for n in its.namelist() if not n.endswith("/"))
    ours_listed = json.loads((built / "index.json").read_text("utf-8"))
    blender.run("--command", "extension", "server-generate", "--repo-dir", str(built))
    its_listed = json.loads((built / "index.json").read_text("utf-8"))
    assert ours_listed["data"] == its_listed["data"]
    assert ours_listed["version"] == its_listed["version"]


def test_installs_from_the_repository_and_uninstalls_without_a_trace(blender: RealBlender, served: str) -> None:
    extension = ["--command", "extension"]
    name = "material_fit_here"
    # not --offline-mode: the loopback address counts as network too
    online = {"online": True}
    blender.run(*extension, "repo-add", "--name", "Here", "--url", served, name, **online)
    blender.run(*extension, "sync", **online)
    blender.run(*extension, "install", "--enable", f"{name}.material_fit_mfo", **online)
    script = (
        "import bpy, sys, pathlib; m = f'bl_ext.material_fit_here.material_fit_mfo';"
        "import addon_utils; addon_utils.enable(m); assert bpy.ops.mfo.fit.get_rna_type().name == 'Fit Material';"
        "root = sys.modules[m].blender_addon.backend.preferences.backend_root(); (root / 'env-1').mkdir(parents=True);"
        "print('ROOT', root)"
    )
    out = blender.run("--python-exit-code", "3", "--python-expr", script, factory=False).stdout
    root = Path(next(line for line in out.splitlines() if line.startswith("ROOT ")).removeprefix("ROOT "))
    assert root.is_dir()
    blender.run(*extension, "remove", f"{name}.material_fit_mfo", **online)
    left = [p for p in blender.profile.rglob("*material_fit_mfo*") if "user_default" not in p.parts]
    assert left == []
