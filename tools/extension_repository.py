#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Build the extension zip and a static extension repository without Blender.

    python tools/extension_repository.py [OUT]

OUT (default dist/) gets ``material_fit_mfo-VERSION.zip`` and ``index.json``, API version v1 of
https://developer.blender.org/docs/features/extensions/api_listing/ as `blender --command extension server-generate`
writes it; a test holds both against Blender's own. Serve the folder and add its index.json as a repository in Blender.
The zip holds the same bytes for the same commit: names sorted, one date.
"""

from __future__ import annotations

import fnmatch
import hashlib
import json
import os
import sys
import zipfile
from pathlib import Path
from typing import Any

import tomllib

ROOT = Path(__file__).resolve().parent.parent
_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest a zip can hold
_NOT_LISTED = {"build"}  # a section of the manifest for the builder alone


def build_repository(root: Path, out: Path) -> Path:
    """Write zip and index.json into `out`; returns the zip."""
    manifest = tomllib.loads((root / "blender_manifest.toml").read_text("utf-8"))
    out.mkdir(parents=True, exist_ok=True)
    archive = out / f"{manifest['id']}-{manifest['version']}.zip"
    archive.unlink(missing_ok=True)  # never a part of itself
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as package:
        for name in extension_files(root, manifest["build"]["paths_exclude_pattern"]):
            info = zipfile.ZipInfo(name, _DATE)
            info.external_attr, info.compress_type = 0o644 << 16, zipfile.ZIP_DEFLATED
            package.writestr(info, (root / name).read_bytes())
    (out / "index.json").write_text(json.dumps(listing(manifest, [archive]), indent=2) + "\n", "utf-8")
    return archive


def listing(manifest: dict[str, Any], archives: list[Path]) -> dict[str, Any]:
    """The content of index.json for archives that all have this manifest."""
    data = [
        {key: value for key, value in manifest.items() if key not in _NOT_LISTED}
        | {
            "archive_url": f"./{archive.name}",
            "archive_size": archive.stat().st_size,
            "archive_hash": "sha256:" + hashlib.sha256(archive.read_bytes()).hexdigest(),
        }
        for archive in archives
    ]
    return {"version": "v1", "blocklist": [], "data": data}


def extension_files(root: Path, patterns: list[str]) -> list[str]:
    """Paths below `root` with forward slashes that no pattern excludes, sorted.

    Of gitignore's rules these are known: a slash at the beginning ties to the root, one at the end means folders only.
    """
    found = []
    for folder, folders, files in os.walk(root):
        below = Path(folder).relative_to(root).as_posix()
        prefix = "" if below == "." else below + "/"
        folders[:] = [name for name in folders if not _excluded(prefix + name, True, patterns)]
        found += [prefix + name for name in files if not _excluded(prefix + name, False, patterns)]
    return sorted(found)


def _excluded(path: str, is_folder: bool, patterns: list[str]) -> bool:
    name = path.rsplit("/", 1)[-1]
    for pattern in patterns:
        bare = pattern.strip("/")
        if pattern.endswith("/") and not is_folder:
            continue
        if fnmatch.fnmatchcase(path if pattern.startswith("/") or "/" in bare else name, bare):
            return True
    return False


if __name__ == "__main__":
    print(build_repository(ROOT, Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "dist"))
