# SPDX-License-Identifier: Apache-2.0
"""Where a libLLVM may lie on Linux, macOS and Windows."""

from __future__ import annotations

import glob
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

# the C library itself, not one of the component libraries (libLLVMCore.so) beside it
_LIBRARY_NAME = re.compile(r"libLLVM(-[\d.]+)?\.(so|dylib)(\.[\d.]+)?|LLVM-C\.dll", re.IGNORECASE)
_VERSION_IN_NAME = re.compile(r"llvm[^/\\\d]*(\d+(?:\.\d+)*)", re.IGNORECASE)  # libLLVM.so.19.1, libLLVM-15.so, llvm-14
_VERSION_ALONE = re.compile(r"(\d+\.\d+\.\d+)[_\d]*")  # Cellar/llvm/19.1.7_1
_FOLDERS = {
    "linux": (
        "/usr/lib/*-linux-gnu*",
        "/usr/lib/llvm-*/lib",
        "/usr/lib/llvm*/lib*",
        "/usr/lib64",
        "/usr/lib64/llvm*/lib*",
        "/usr/lib",
        "/usr/local/lib",
        "/usr/local/llvm*/lib",
        "/home/linuxbrew/.linuxbrew/opt/llvm*/lib",
    ),
    "darwin": ("/opt/homebrew/opt/llvm*/lib", "/opt/homebrew/Cellar/llvm*/*/lib", "/opt/local/libexec/llvm-*/lib"),
    "win32": (r"C:\Program Files\LLVM\bin", r"C:\Program Files (x86)\LLVM\bin"),
}


def llvm_candidates() -> list[Path]:
    """Existing LLVM C libraries: the one in `DRJIT_LIBLLVM_PATH` first, then by version, highest first."""
    chosen = os.environ.get("DRJIT_LIBLLVM_PATH")
    found: dict[Path, Path] = {}
    for folder in _folders():
        for path in _libraries_in(folder):
            found.setdefault(path.resolve(), path)
    ordered = sorted(found.values(), key=llvm_version, reverse=True)
    if chosen:
        first = Path(chosen)
        ordered = [first, *(path for path in ordered if path.resolve() != first.resolve())]
    return ordered


def llvm_version(path: Path) -> tuple[int, ...]:
    """The version that the file name or, failing that, a folder above it tells; (0,) if none does."""
    resolved = path.resolve()
    for part in (resolved.name, path.name, *reversed(resolved.parts[:-1])):
        number = _VERSION_IN_NAME.search(part) or _VERSION_ALONE.fullmatch(part)
        if number:
            return tuple(int(piece) for piece in number.group(1).split("."))
    return (0,)


def _folders() -> Iterator[Path]:
    for prefix in filter(None, {os.environ.get("CONDA_PREFIX"), sys.prefix, sys.base_prefix}):
        yield from (Path(prefix) / "lib", Path(prefix) / "Library" / "bin")
    yield from (Path(p) for pattern in _FOLDERS.get(sys.platform, ()) for p in glob.glob(pattern))
    if sys.platform == "win32":
        yield from (Path(p) for p in os.environ.get("PATH", "").split(os.pathsep) if p)
    for name in ("llvm-config", *(f"llvm-config-{version}" for version in range(30, 15, -1))):
        yield from _folder_of_config(name)


def _folder_of_config(name: str) -> Iterator[Path]:
    program = shutil.which(name)
    if program is None:
        return
    try:
        told = subprocess.run([program, "--libdir"], capture_output=True, text=True, timeout=10, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return
    if told.strip():
        yield Path(told.strip())


def _libraries_in(folder: Path) -> list[Path]:
    try:
        return sorted(path for path in folder.iterdir() if _LIBRARY_NAME.fullmatch(path.name) and path.is_file())
    except OSError:  # absent or not readable
        return []
