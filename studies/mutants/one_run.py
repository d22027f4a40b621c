# SPDX-License-Identifier: Apache-2.0
"""A copy of the sources in which the tests of one folder run on one fault."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import tarfile
import time
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

from .operators import Mutant

CPU_SECONDS = 600  # of one process; the slowest folder needs a fifth of it
# tests of the sources under a path, where the folder is not simply the one of the same name
_TESTS = {"blender_addon/export": "tests/export", "blender_addon": "tests/addon", "mfo_backend": "tests"}


@dataclass(frozen=True)
class Outcome:
    """`state` is killed or survived; `by` is the first test that failed, or how else the fault was noticed."""

    state: str
    by: str
    seconds: float


def copy_of(root: Path, commit: str, folder: Path) -> None:
    """The committed sources, and nothing else, in a folder."""
    packed = subprocess.run(["git", "archive", commit], cwd=root, stdout=subprocess.PIPE, check=True).stdout
    with tarfile.open(fileobj=BytesIO(packed)) as archive:
        archive.extractall(folder, filter="data")


def files_testing(root: Path, path: str) -> list[str]:
    """The test files of the folder of a source file: first those that bear its name, then those that speak of it."""
    source = Path(path)
    base = next(prefix for prefix in _TESTS if source.is_relative_to(prefix))
    folder = root / _TESTS[base] / source.parent.relative_to(base)
    while not any(folder.glob("test_*.py")):
        folder = folder.parent
    names_it = re.compile(rf"\b{source.stem}\b")

    def distance(test: Path) -> tuple[int, int]:
        texts = len(names_it.findall(test.read_text("utf-8")))
        return (0 if source.stem in test.stem else 1 if texts else 2, -texts)

    return [str(test.relative_to(root)) for test in sorted(sorted(folder.glob("test_*.py")), key=distance)]


def outcome_of(mutant: Mutant, copy: Path) -> Outcome:
    """Run the tests on the fault, up to the first failure; the copy is as before afterwards."""
    source = (copy / mutant.path).read_bytes()
    (copy / mutant.path).write_bytes(mutant.applied(source))
    try:
        return _pytest(files_testing(copy, mutant.path), copy)
    finally:
        (copy / mutant.path).write_bytes(source)


def failing(tests: list[str], copy: Path) -> bool:
    """Whether these tests fail on the sources as they are: then they tell nothing."""
    return _pytest(tests, copy).state == "killed"


def _pytest(tests: list[str], copy: Path) -> Outcome:
    words = [sys.executable, "-m", "pytest", "-x", "-q", "--tb=no", "-p", "no:cacheprovider", *tests]
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    began, used = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        words,
        cwd=copy,
        env=environment,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS)),
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - used.ru_utime - used.ru_stime
    seconds = round(cpu if cpu > 0 else time.monotonic() - began, 1)
    if done.returncode == 0:
        return Outcome("survived", "", seconds)
    if done.returncode < 0:
        return Outcome("killed", f"its process ended with signal {-done.returncode}", seconds)
    found = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, re.MULTILINE)
    if found is None:
        raise RuntimeError(f"pytest ended with {done.returncode}: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    return Outcome("killed", found[1], seconds)
