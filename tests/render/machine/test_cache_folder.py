# SPDX-License-Identifier: Apache-2.0
"""The cache of kernels stays below its limit, also with two processes at once; Dr.Jit does it, so it is asked."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mfo_backend.render.machine.cache_folder import KERNEL_LIMIT, cache_folder, use_kernel_cache

START = """
from mfo_backend.render.machine.cache_folder import use_kernel_cache
from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm
use_kernel_cache()
if needs_llvm():
    configure_llvm()
import drjit as dr
from mfo_backend.render.machine.variant import load_variant
load_variant()
import mitsuba as mi
assert float(dr.sum(dr.arange(mi.Float, 9) * dr.opaque(mi.Float, 3.0))[0]) == 108.0
import time
time.sleep(0.5)  # the sweep has a thread of its own
"""


def old_kernels(folder: Path, count: int, size: int) -> list[Path]:
    """Files as Dr.Jit names them, each used an hour later than the one before."""
    folder.mkdir(parents=True)
    paths = [folder / f"{number:032x}.llvm.v6.bin" for number in range(count)]
    for number, path in enumerate(paths):
        path.write_bytes(bytes(size))
        used = time.time() - 3600.0 * (count - number)
        os.utime(path, (used, used))
    return paths


def start(kernels: Path, **more: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "DRJIT_CACHE_DIR": str(kernels), **more}
    return subprocess.Popen([sys.executable, "-c", START], env=environment, stderr=subprocess.PIPE, text=True)


def finish(process: subprocess.Popen[str]) -> None:
    said = process.communicate(timeout=120)[1]
    assert process.returncode == 0, said


def test_a_process_deletes_the_oldest_kernels(tmp_path):
    paths = old_kernels(tmp_path / "kernels", 10, 100_000)
    finish(start(tmp_path / "kernels", DRJIT_CACHE_MAXSIZE="500k"))
    left = [path for path in paths if path.exists()]
    assert left == paths[-4:]  # four fifths of the limit, the newest
    assert len(list((tmp_path / "kernels").glob("*.bin"))) > 4  # and its own


def test_two_processes_at_once_delete_the_oldest_kernels(tmp_path):
    """Where both claim the sweep, neither counts what the other deletes: together they delete more than one."""
    paths = old_kernels(tmp_path / "kernels", 10, 100_000)
    both = [start(tmp_path / "kernels", DRJIT_CACHE_MAXSIZE="500k") for _ in range(2)]
    for process in both:
        finish(process)
    left = [path for path in paths if path.exists()]
    assert len(left) <= 4
    assert left == paths[len(paths) - len(left) :]  # never a newer one before an older one


def test_a_kernel_that_another_process_deleted_is_compiled_again(tmp_path):
    kernels = tmp_path / "kernels"
    finish(start(kernels))
    compiled = sorted(path.name for path in kernels.glob("*.bin"))
    assert compiled
    for path in kernels.glob("*.bin"):
        path.unlink()
    finish(start(kernels))
    assert sorted(path.name for path in kernels.glob("*.bin")) == compiled


def test_the_cache_is_ours_and_limited(monkeypatch, tmp_path):
    monkeypatch.setenv("MFO_CACHE_DIR", str(tmp_path))
    for name in ("DRJIT_CACHE_DIR", "DRJIT_CACHE_MAXSIZE"):
        monkeypatch.setenv(name, "")  # so that it is put back afterwards
        monkeypatch.delenv(name)
    use_kernel_cache()
    assert os.environ["DRJIT_CACHE_DIR"] == str(cache_folder() / "kernels")
    assert os.environ["DRJIT_CACHE_MAXSIZE"] == KERNEL_LIMIT


def test_the_users_choice_holds(monkeypatch, tmp_path):
    monkeypatch.setenv("DRJIT_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("DRJIT_CACHE_MAXSIZE", "7M")
    use_kernel_cache()
    assert (os.environ["DRJIT_CACHE_DIR"], os.environ["DRJIT_CACHE_MAXSIZE"]) == (str(tmp_path), "7M")


@pytest.mark.parametrize(("days", "stays"), [(0.5, True), (2.0, False)])
def test_what_a_killed_process_left_half_written_goes_after_a_day(monkeypatch, tmp_path, days, stays):
    monkeypatch.setenv("DRJIT_CACHE_DIR", str(tmp_path))
    path = tmp_path / "0123.llvm.v6.bin.4711.tmp"
    path.write_bytes(b"half")
    when = time.time() - days * 24 * 3600
    os.utime(path, (when, when))
    use_kernel_cache()
    assert path.exists() is stays
