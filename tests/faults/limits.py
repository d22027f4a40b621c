# SPDX-License-Identifier: Apache-2.0
"""Real jobs that run out of something: ``python -m tests.faults.limits``; the record goes into `docs/reliability.md`.

Memory by RLIMIT_AS, the disk by a small tmpfs (as root only), the folder removed under way, a CUDA driver that is none.
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
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mfo_backend.fit.settings import FitSettings
from mfo_backend.job.make_job import make_job
from mfo_backend.scene.image_file import write_exr

from ..stability.test_extremes import POINT, SCENE, SKY
from .scene import ROOT, environment

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
        for megabytes in (300, 450, 600):
            yield run(f"{megabytes} MB of address space, 16x16", job(folder, 16), limit=megabytes << 20)
        yield run("1100 MB of address space, 1400x1400", job(folder, 1400, SKY.format(1.0)), limit=1100 << 20)
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


def run(fault: str, path: Path, *, limit: int = 0, on_start: Callable[[Path], Any] | None = None, **variables: str):
    """The job in a new process, `on_start` called at its first progress."""
    command = [sys.executable, "-m", "mfo_backend", "run", str(path), "--progress", "json"]
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
