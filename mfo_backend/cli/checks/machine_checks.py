# SPDX-License-Identifier: Apache-2.0
"""What the backend needs of a machine, each with what was found and how to mend it."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ...render.machine.cache_folder import cache_folder
from ...render.machine.llvm import (
    find_llvm,
    library_cure,
    llvm_cure,
    missing_system_library,
    needs_llvm,
    require_mitsuba,
)
from ...render.machine.memory import memory_left
from ...types.errors import SetupError
from ...types.processors import processors
from .check import Check
from .optional_checks import check_optional

PINNED = {"mitsuba": "3.9.1", "drjit": "1.5.0"}  # those of pyproject.toml; a test compares them
LEAST = {"numpy": "1.26", "scipy": "1.11", "OpenEXR": "3.3", "pillow": "11", "tqdm": "4.66"}

ENOUGH_MEMORY = 1_000_000_000


def check_machine() -> Iterator[Check]:
    """All checks, each yielded when it is done; the LLVM probe may take seconds the first time."""
    yield _python()
    yield from (_package(name) for name in (*PINNED, *LEAST))
    yield from _renderer()
    yield _gpu()
    yield _threads()
    yield _memory()
    yield _cache("cache", cache_folder(), "MFO_CACHE_DIR")
    kernels = os.environ.get("DRJIT_CACHE_DIR") or str(Path.home() / ".drjit")
    if sys.platform == "win32":
        kernels = os.environ.get("DRJIT_CACHE_DIR") or str(Path(tempfile.gettempdir()) / "drjit")
    yield _cache("kernel cache", Path(kernels), "DRJIT_CACHE_DIR")
    yield from check_optional()


def _python() -> Check:
    found = f"{platform.python_version()} on {platform.system()} {platform.machine()}, {sys.executable}"
    cure = "Use Python 3.10 to 3.14, 64 bit (https://www.python.org)."
    if not (3, 10) <= sys.version_info[:2] <= (3, 14) or sys.maxsize < 2**32:
        return Check("Python", "problem", found, cure)
    if sys.platform == "darwin" and platform.machine() != "arm64":
        return Check("Python", "problem", found, "Mitsuba has no build for Intel Macs: use an Apple Silicon Mac.")
    return Check("Python", "ok", found)


def _package(name: str) -> Check:
    needed = f"{name}=={PINNED[name]}" if name in PINNED else f"{name}>={LEAST[name]}"
    cure = f'Run "{sys.executable}" -m pip install "{needed}".'
    try:
        found = version(name)
    except PackageNotFoundError:
        return Check(name, "problem", "not installed", cure)
    fits = found == PINNED[name] if name in PINNED else _numbers(found) >= _numbers(LEAST[name])
    return Check(name, "ok", found) if fits else Check(name, "problem", f"{found}, needed is {needed}", cure)


def _renderer() -> Iterator[Check]:
    """LLVM and the Mitsuba variant that a fit would use."""
    try:
        require_mitsuba()
    except SetupError as error:
        yield Check("Mitsuba variant", "problem", "Mitsuba is not installed", str(error))
        return
    library = None
    if needs_llvm():
        library, verdicts = find_llvm()
        failed = "; ".join(f"{v.path}: {v.reason}" for v in verdicts if not v.works)
        missing = missing_system_library(verdicts)
        if library is None and missing:
            yield Check("drjit", "problem", f"{missing} is missing", _sentence(library_cure(missing)))
            return
        if library is None:
            yield Check("LLVM", "problem", failed or "no library found", _sentence(llvm_cure()))
            return
        os.environ["DRJIT_LIBLLVM_PATH"] = str(library)
        yield Check("LLVM", "ok", f"{library}, compiled and ran a kernel" + (f" (not: {failed})" if failed else ""))
    from ...render.machine.variant import load_variant

    try:
        yield Check("Mitsuba variant", "ok", load_variant())
    except SetupError as error:
        of_llvm = needs_llvm() and not os.environ.get("MFO_VARIANT")
        yield Check("Mitsuba variant", "problem", str(error), _sentence(llvm_cure()) if of_llvm else "")


def _gpu() -> Check:
    program = shutil.which("nvidia-smi")
    told = ""
    if program is not None:
        try:
            query = [program, "--query-gpu=name,driver_version", "--format=csv,noheader"]
            told = subprocess.run(query, capture_output=True, text=True, timeout=20, check=True).stdout.strip()
        except (OSError, subprocess.SubprocessError):
            told = ""
    return Check("GPU", "ok", told.replace("\n", "; ") or "no NVIDIA GPU found; none is needed")


def _threads() -> Check:
    return Check("threads", "ok", str(processors()))


def _memory() -> Check:
    left = min(memory_left(), key=lambda one: one.size, default=None)
    if left is None:
        return Check("memory", "ok", "not told by this system")
    found = f"{left.size / 1e9:.1f} GB left {left.limit}"
    if left.size < ENOUGH_MEMORY:
        return Check("memory", "warning", found, "Free some, or raise the limit: a small fit takes about 1 GB.")
    return Check("memory", "ok", found)


def _cache(name: str, folder: Path, variable: str) -> Check:
    cure = f"Make it writable, or set {variable} to a folder that is: without it every start compiles anew."
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return Check(name, "ok", str(folder))
    except OSError as error:
        return Check(name, "warning", f"{folder} is not writable ({error.strerror})", cure)


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", text)[:3])


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
