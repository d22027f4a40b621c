# SPDX-License-Identifier: Apache-2.0
"""Find a libLLVM that really works and hand it to Dr.Jit. Must run before drjit is imported.

No package on PyPI carries the LLVM C library, so it comes from the operating system. The version alone proves
nothing: LLVM 15 loads and then aborts the process inside real kernels, so each candidate renders one in a child
process and the verdict is kept in the user's cache folder.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib.metadata
import importlib.util
import json
import os
import platform
import re
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from ...types.errors import SetupError
from .cache_folder import cache_folder
from .llvm_candidates import llvm_candidates
from .temporary_folder import temporary_folder

PATH_VARIABLE = "DRJIT_LIBLLVM_PATH"
_LIBRARY_AT_FAULT = ("LLVM ERROR", "too old")
_NOT_LOADED = r"ImportError: (\S+\.so[.\d]*): cannot open shared object file"
_PACKAGE_OF = {
    "libatomic.so.1": ("libatomic1", "libatomic")
}  # a minimal Debian has no such package, Dr.Jit links to it
PROBE_SECONDS = 120.0  # 1.2 s on a quiet core; a loaded machine or a cold disk may take far longer


@dataclass(frozen=True)
class LlvmVerdict:
    """Whether the library at `path` compiled and ran a real kernel, else the reason in its own words."""

    path: str
    works: bool
    reason: str


def probe_llvm(path: Path, *, timeout: float = PROBE_SECONDS) -> LlvmVerdict:
    """Compile a real kernel with the library at `path` in a child process, or recall the verdict of an earlier time."""
    remembered = _verdict_file(path)
    with contextlib.suppress(OSError, ValueError, TypeError, KeyError):
        kept = json.loads(remembered.read_text("utf-8"))
        return LlvmVerdict(path=str(path), works=bool(kept["works"]), reason=str(kept["reason"]))
    verdict = _probe_in_child(path, timeout)
    if verdict is None:  # says nothing about the library, so it is not kept
        return LlvmVerdict(str(path), False, f"gave no answer within {timeout:.0f} seconds")
    # any other failure may be the machine's, and be gone after a repair; LLVM calls a want of memory its error too
    at_fault = any(mark in verdict.reason for mark in _LIBRARY_AT_FAULT) and "out of memory" not in verdict.reason
    if not verdict.works and not at_fault:
        return verdict
    with contextlib.suppress(OSError):
        remembered.parent.mkdir(parents=True, exist_ok=True)
        remembered.write_text(json.dumps(asdict(verdict)), "utf-8")
    return verdict


def find_llvm() -> tuple[Path | None, list[LlvmVerdict]]:
    """The first candidate that works, and the verdict of every one that was tried."""
    verdicts: list[LlvmVerdict] = []
    for candidate in llvm_candidates():
        verdict = probe_llvm(candidate)
        verdicts.append(verdict)
        if verdict.works:
            return candidate, verdicts
    return None, verdicts


def missing_system_library(verdicts: Sequence[LlvmVerdict]) -> str:
    """The shared library for want of which Dr.Jit could not be loaded, such as "libatomic.so.1", else nothing."""
    found = (re.search(_NOT_LOADED, verdict.reason) for verdict in verdicts)
    return next((match[1] for match in found if match), "")


def library_cure(library: str) -> str:
    """How to get a missing system library, as the end of a sentence."""
    package = _PACKAGE_OF.get(library)
    if package is None:
        return f"install the package of your system that has {library}."
    return f"run `apt install {package[0]}` on Debian or Ubuntu, `dnf install {package[1]}` on Fedora."


def configure_llvm() -> Path:
    """The libLLVM that Dr.Jit will load, now named in `DRJIT_LIBLLVM_PATH`.

    Raises
    ------
    SetupError
        If Mitsuba is not installed or no library on this machine works; the sentence says how to get one.
    """
    require_mitsuba()
    found, verdicts = find_llvm()
    if found is None:
        missing = missing_system_library(verdicts)
        if missing:
            raise SetupError(f"Dr.Jit needs the system library {missing}, which is missing: {library_cure(missing)}")
        tried = "; ".join(f"{v.path}: {v.reason}" for v in verdicts)
        what = f"No usable LLVM library was found (tried {tried})" if tried else "No LLVM library was found"
        raise SetupError(f"{what}: {llvm_cure()}")
    os.environ[PATH_VARIABLE] = str(found)
    return found


def needs_llvm() -> bool:
    """Whether the CPU variant is the one to use; an Apple Silicon Mac has Metal."""
    return not (sys.platform == "darwin" and platform.machine() == "arm64")


def require_mitsuba() -> None:
    """Check, without importing them, that Mitsuba and Dr.Jit are installed in this Python.

    Raises
    ------
    SetupError
        If one is not; the sentence names the interpreter.
    """
    missing = [name for name in ("mitsuba", "drjit") if importlib.util.find_spec(name) is None]
    if missing:
        raise SetupError(
            f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} not installed in {sys.executable}: "
            f'run "{sys.executable}" -m pip install mitsuba==3.9.1, or choose another interpreter.'
        )


def llvm_cure() -> str:
    """How to get a usable LLVM on this operating system, as the end of a sentence."""
    if sys.platform == "darwin":
        return "run `brew install llvm`."
    if sys.platform == "win32":
        return (
            "install LLVM 19 or newer (the LLVM-*-win64.exe of its releases, or `conda install -c conda-forge "
            f"libllvm-c19`), or set {PATH_VARIABLE} to its LLVM-C.dll."
        )
    return (
        "run `apt install libllvm19` on Debian or Ubuntu, `dnf install llvm-libs` on Fedora, `pacman -S llvm-libs` on "
        f"Arch, or set {PATH_VARIABLE} to a libLLVM.so of version 19 or newer."
    )


def _verdict_file(path: Path) -> Path:
    """Cache file of a verdict; library file, Mitsuba, Dr.Jit and processor are its key."""
    with contextlib.suppress(OSError):
        path = path.resolve(strict=True)
    stamp = path.stat().st_mtime_ns if path.exists() else 0
    key = [str(path), stamp, *map(_version, ("mitsuba", "drjit")), platform.machine(), _processor()]
    return cache_folder() / "llvm" / f"{hashlib.sha256(json.dumps(key).encode()).hexdigest()[:24]}.json"


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""


def _processor() -> str:
    # instruction selection depends on it, and home folders are shared between machines
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor()


def _probe_in_child(path: Path, timeout: float) -> LlvmVerdict | None:
    package_root = Path(__file__).resolve().parents[3]
    search_path = os.pathsep.join(filter(None, [str(package_root), os.environ.get("PYTHONPATH")]))
    with temporary_folder("llvm") as kernels:
        environment = {
            **os.environ,
            PATH_VARIABLE: str(path),
            "DRJIT_CACHE_DIR": str(kernels),
            "PYTHONPATH": search_path,
            "PYTHONUTF8": "1",
        }
        try:
            child = subprocess.run(
                [sys.executable, "-m", f"{__package__}.llvm_probe"],
                env=environment,
                cwd=package_root,  # Mitsuba takes plugins from the working folder first
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                encoding="utf-8",
                errors="replace",
                timeout=timeout,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except subprocess.TimeoutExpired:
            return None
    if child.returncode == 0:
        return LlvmVerdict(str(path), True, "compiled and ran a kernel")
    return LlvmVerdict(str(path), False, _reason(child.stderr, child.returncode))


def _reason(stderr: str, returncode: int) -> str:
    """The line of a failed probe's output that says why."""
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    for mark in ("ImportError: lib", *_LIBRARY_AT_FAULT, "FMA"):
        for line in lines:
            if mark in line:
                return line[line.find("LLVM ERROR") :][:120] if mark == "LLVM ERROR" else line.split(". ")[0][:160]
    if returncode < 0:
        return f"killed the process with signal {-returncode}"
    return lines[-1][:160] if lines else f"exit code {returncode}"
