# SPDX-License-Identifier: Apache-2.0
"""Real jobs that run out of something: ``python -m tests.faults.limits``; record: `docs/reference/reliability.md`.

Memory by RLIMIT_AS, the disk by a small tmpfs (as root only), the folder removed or closed under way, no LLVM or one
that is too old, a CUDA driver that is none.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mfo_backend.fit.settings import FitSettings
from mfo_backend.job.folder.make_job import make_job
from mfo_backend.scene.image_file import write_exr

from ..stability.test_extremes import POINT, SCENE, SKY
from .scene import ROOT, environment

# root without these capabilities is bound by the permissions of its own files
BOUND = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")
if os.geteuid() != 0 or shutil.which("setpriv") is None:
    BOUND = ()
PERMISSIONS_BIND = os.geteuid() != 0 or bool(BOUND)
SPHERE = '<shape type="sphere" id="target"><ref id="b"/></shape>'


def main() -> None:
    """Try every fault and write what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", type=Path, default=ROOT / "docs" / "reliability" / "limits.json")
    chosen = parser.parse_args()
    rows = []
    for fault in all_faults():
        rows.append(fault)
        print(json.dumps(fault), flush=True)
    chosen.record.parent.mkdir(parents=True, exist_ok=True)
    chosen.record.write_text(json.dumps(rows, indent=1) + "\n")


def all_faults() -> Iterator[dict[str, Any]]:
    """One row a fault: exit code, status and sentence of the backend, and what it left."""
    with tempfile.TemporaryDirectory(prefix="mfo-limits-") as name:
        folder = Path(name)
        for megabytes in (300, 450, 600, 900):
            yield run(f"{megabytes} MB of address space, 16x16", job(folder, 16), limit=megabytes << 20)
        for size, megabytes in ((512, 1200), (1400, 1100)):
            path = job(folder, size, SKY.format(1.0))
            yield run(f"{megabytes} MB of address space, {size}x{size}, sky", path, limit=megabytes << 20)
        yield run("no LLVM", job(folder, 16), only_llvm=[])
        for version in (14, 15):
            if (library := Path(f"/usr/lib/x86_64-linux-gnu/libLLVM-{version}.so")).exists():
                yield run(f"LLVM {version} alone", job(folder, 16), only_llvm=[library])
        if PERMISSIONS_BIND:
            path = job(folder, 24)
            path.chmod(0o555)
            yield run("job folder that may only be read", path)
            yield run("permission to write taken away after the start", job(folder, 24), on_start=close)
        yield run("job folder removed after the start", job(folder, 24), on_start=shutil.rmtree)
        yield run("a CUDA driver that is none", job(folder, 16), DRJIT_LIBCUDA_PATH="/etc/hostname")
        if os.geteuid() == 0:
            with tmpfs(folder / "full", "1m") as disk:
                yield run("disk full before the start", job(disk, 16))
            with tmpfs(folder / "filled", "8m") as disk:
                yield run("disk full after the start", job(disk, 24), on_start=_fill)


def job(folder: Path, size: int, light: str = "", *, preset: str = "fast") -> Path:
    """A job of a sphere with a flat reference."""
    path = folder / f"job_{size}_{len(list(folder.iterdir()))}"
    source = path.with_suffix(".source")
    source.mkdir()
    text = SCENE.format(width=size, height=size, shape=SPHERE, light=light or POINT.format(40.0))
    (source / "scene.xml").write_text(text)
    write_exr(source / "r.exr", np.full((size, size, 3), 0.5, np.float32))
    settings = FitSettings(preset="paper" if size == 24 else preset, max_iterations=60)
    make_job(source / "scene.xml", "target", source / "r.exr", settings, path)
    shutil.rmtree(source)
    return path


def close(path: Path) -> None:
    """Take away the permission to write a job folder."""
    for folder in (path / "pictures", path):
        folder.chmod(0o555)


def run(
    fault: str,
    path: Path,
    *,
    limit: int = 0,
    on_start: Callable[[Path], Any] | None = None,
    only_llvm: Sequence[Path] | None = None,
    **variables: str,
) -> dict[str, Any]:
    """The job in a new process that permissions bind, `on_start` called at its first progress."""
    words = ["run", str(path), "--progress", "json"]
    command = [*BOUND, sys.executable, "-m", "mfo_backend", *words]
    if only_llvm is not None:
        command = [*BOUND, sys.executable, "-m", "tests.faults.with_llvm", *map(str, only_llvm), "--", *words]
    with subprocess.Popen(
        command, cwd=ROOT, env=environment(**variables), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=(lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit))) if limit else None,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        last: dict[str, Any] = {}
        for line in process.stdout:
            last = json.loads(line)
            if on_start is not None and last["event"] == "progress":
                on_start(path)
                on_start = None
        process.communicate()
    ended = last.get("event") in ("finished", "failed")
    result = path / "result.json"
    return {
        "fault": fault,
        "exit": process.returncode,
        "status": last["status"] if ended else "",
        "sentence": last["sentence"].replace(str(path.parent), "...") if ended else "",
        "result": "complete" if result.exists() and json.loads(result.read_text()) else "none",
        "left": sorted(p.name for p in path.rglob("*") if p.name.endswith(".tmp")) if path.exists() else [],
    }


@contextmanager
def tmpfs(path: Path, size: str) -> Iterator[Path]:
    """A small disk."""
    path.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(path)], check=True)
    try:
        yield path
    finally:
        subprocess.run(["umount", "--lazy", str(path)], check=True)


def _fill(path: Path) -> None:
    with (path.parent / "filler").open("wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(4096))
        except OSError:
            return


if __name__ == "__main__":
    main()
