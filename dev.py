#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Set up and use a checkout of Material Fit with nothing but Python 3.11.

    python3 dev.py demo       recover a material from a Cycles render, end to end
    python3 dev.py test       check and test everything; test --quick: what has no fit and no Blender, in a minute;
                              test --bpy 4.2 (or 4.5): the add-on with another bpy module
    python3 dev.py mfo ...    the `mfo` command of this checkout
    python3 dev.py package    build the extension zip and a static extension repository into dist/, list what is in it
    python3 dev.py lock       resolve the dependencies again and rewrite requirements/*.lock

Everything lives in `.venv` beside this file; a second call finds it there and starts at once. Standard library only.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
LOCK = ROOT / "requirements" / "dev.lock"
# other releases of the bpy module that the add-on is tested with; the newest is in the lock file
OTHER_BPY = {"4.2": "4.2.23", "4.5": "4.5.15"}
# The bpy module that the demo and the tests use exists for this Python only.
PYTHON = (3, 11)
# libLLVM compiles Mitsuba's kernels, the others are what the bpy module links against; a bare Debian has none.
RENDERER_PACKAGES = ["libllvm19", "libatomic1"]
BPY_PACKAGES = [
    "libx11-6",
    "libxrender1",
    "libxfixes3",
    "libxi6",
    "libxkbcommon0",
    "libsm6",
    "libice6",
    "libgl1",
    "libegl1",
]


# `test --quick`: the folders and files whose tests neither fit a material nor start or import Blender
QUICK = [
    *(f"tests/{folder}" for folder in ("types", "scene", "solve", "metrics", "report", "tools")),
    *("tests/material/arrays", "tests/material/principled/test_properties.py"),
    *("tests/bench/report", "tests/bench/judge"),
    *("tests/job/folder/test_request.py", "tests/job/run/test_worker_process.py"),
    *("tests/test_import_arrows.py", "tests/test_repository.py"),
]


class DevError(Exception):
    """One sentence for the person at the terminal."""


def say(text: str) -> None:
    """Print a line about the set-up, apart from what the called programs print."""
    print(f"dev.py: {text}", file=sys.stderr, flush=True)


def venv_program(name: str) -> Path:
    """Path of a program in the virtual environment."""
    return VENV / ("Scripts" if os.name == "nt" else "bin") / (name + (".exe" if os.name == "nt" else ""))


def run(*command: str | Path) -> None:
    """Run a set-up command.

    Raises
    ------
    DevError
        If it fails.
    """
    words = [str(part) for part in command]
    if subprocess.run(words, cwd=ROOT).returncode:
        raise DevError(f"this step failed, its output is above: {' '.join(words[:6])}")


def runs(*command: str | Path) -> bool:
    """Whether a command exits with 0; its output is dropped."""
    words = [str(part) for part in command]
    return subprocess.run(words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0


def use_required_python() -> None:
    """Start again under Python 3.11 if this is another one.

    Raises
    ------
    DevError
        If there is no Python 3.11.
    """
    if sys.version_info[:2] == PYTHON:
        return
    name = "python{}.{}".format(*PYTHON)
    other = shutil.which(name)
    if other is None or not runs(other, "--version"):
        raise DevError(
            f"this is Python {sys.version.split()[0]} but the bpy module needs {name}: install it and call again"
        )
    sys.exit(subprocess.run([other, str(ROOT / "dev.py"), *sys.argv[1:]]).returncode)


def can_apt_install() -> bool:
    """Whether this is Debian or Ubuntu and we may install packages."""
    return shutil.which("apt-get") is not None and hasattr(os, "geteuid") and os.geteuid() == 0


def apt_install(packages: list[str]) -> None:
    """Install Debian packages, refreshing the package lists first."""
    say(f"installing {' '.join(packages)}")
    quiet = ["-qq", "-o", "Dpkg::Use-Pty=0"]
    os.environ["DEBIAN_FRONTEND"] = "noninteractive"
    run("apt-get", *quiet, "update")
    run("apt-get", *quiet, "install", "-y", "--no-install-recommends", *packages)


def lock_hash() -> str:
    """What the environment was made from: the lock file, this interpreter and the place of the checkout."""
    return hashlib.sha256(LOCK.read_bytes() + f"{sys.version}{ROOT}".encode()).hexdigest()


def set_up_environment() -> None:
    """Make `.venv` from the lock file unless it is there already."""
    stamp = VENV / "made-from"
    python = getattr(sys, "_base_executable", sys.executable)  # never the interpreter inside the folder we clear
    if stamp.is_file() and stamp.read_text() == lock_hash():
        return
    say(f"making {VENV.name} (about 1 GB, most of it Blender as a module)")
    if not runs(python, "-c", "import ensurepip"):
        package = "python{}.{}-venv".format(*PYTHON)
        if not can_apt_install():
            raise DevError(f"this Python cannot make virtual environments: install {package} and call again")
        apt_install([package])
    run(python, "-m", "venv", "--clear", VENV)
    pip = [venv_program("python"), "-m", "pip", "--disable-pip-version-check", "install", "--quiet"]
    run(*pip, "--require-hashes", "--no-deps", "-r", LOCK)
    run(*pip, "--no-deps", "--no-build-isolation", "--editable", ROOT)
    stamp.write_text(lock_hash())


def set_up_renderer() -> None:
    """Make sure that Mitsuba loads and that a libLLVM is found which compiles a real kernel.

    Raises
    ------
    DevError
        If something is missing and may not be installed.
    """
    probe = [venv_program("python"), "-m", "mfo_backend", "doctor"]
    if runs(*probe):
        return
    if can_apt_install():
        apt_install(RENDERER_PACKAGES)
    if not runs(*probe):
        run(*probe)


def set_up_bpy() -> None:
    """Make sure that the bpy module finds the libraries it links against.

    Raises
    ------
    DevError
        If some are missing and may not be installed.
    """
    probe = [venv_program("python"), "-c", "import bpy"]
    marker = VENV / "bpy-imports"
    if marker.is_file():
        return
    if not runs(*probe):
        if not can_apt_install():
            raise DevError(f"the bpy module misses system libraries: install {' '.join(BPY_PACKAGES)} and call again")
        apt_install(BPY_PACKAGES)
        run(*probe)
    marker.touch()


def set_up() -> None:
    """Everything the demo and the tests need."""
    start = time.monotonic()
    set_up_environment()
    set_up_bpy()
    set_up_renderer()
    say(f"ready after {time.monotonic() - start:.1f} s")


def mfo(arguments: list[str]) -> int:
    """Run the `mfo` command of this checkout."""
    return subprocess.run([venv_program("python"), "-m", "mfo_backend", *arguments], cwd=os.getcwd()).returncode


def set_up_other_bpy(release: str) -> Path:
    """Make `.venv-bpy-RELEASE`, the lock file with another bpy module; returns its Python."""
    if release not in OTHER_BPY:
        raise DevError(f"--bpy is {release!r}: give one of {', '.join(OTHER_BPY)}")
    folder = ROOT / f".venv-bpy-{release}"
    python = folder / venv_program("python").relative_to(VENV)
    stamp, made_from = folder / "made-from", lock_hash() + OTHER_BPY[release]
    if stamp.is_file() and stamp.read_text() == made_from:
        return python
    say(f"making {folder.name}")
    run(getattr(sys, "_base_executable", sys.executable), "-m", "venv", "--clear", folder)
    rest = folder / "without-bpy.lock"
    rest.write_text(re.sub(r"^bpy==(?:.*\\\n)*.*\n", "", LOCK.read_text(), flags=re.MULTILINE))
    pip = [python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-deps"]
    run(*pip, "--require-hashes", "-r", rest)
    run(*pip, f"bpy=={OTHER_BPY[release]}")
    stamp.write_text(made_from)
    return python


def test_other_bpy(release: str, arguments: list[str]) -> int:
    """Run the tests that need bpy, or those named, with another bpy module."""
    python = set_up_other_bpy(release)
    # the destructors of bpy 4.2 may crash after the last test, so the process ends before them
    code = "import os, sys, pytest; code = pytest.main(sys.argv[1:]); sys.stdout.flush(); os._exit(int(code))"
    words = arguments or ["tests/addon", "tests/export"]
    return subprocess.run([python, "-c", code, *words], cwd=ROOT).returncode


def test(arguments: list[str]) -> int:
    """Lint, type-check and test; with other arguments than the two of its own only pytest, which gets them."""
    if arguments[:1] == ["--bpy"]:
        return test_other_bpy(arguments[1] if len(arguments) > 1 else "", arguments[2:])
    python = str(venv_program("python"))
    # Two at a time: a test compiles kernels or starts a Blender on one core for about as long as it renders on all.
    # Neighbours share fixtures and kernels, so each process takes its half in order, and one that has none left takes
    # half of what the other has.
    two_at_a_time = ["-n", "2", "--dist", "worksteal"]
    if arguments[:1] == ["--quick"]:
        arguments = [*QUICK, *two_at_a_time, *arguments[1:]]
    if arguments:
        return subprocess.run([python, "-m", "pytest", *arguments], cwd=ROOT).returncode and 1

    def passes(*command: str) -> bool:
        return subprocess.run([python, "-m", *command], cwd=ROOT).returncode == 0

    failed = [command for command in ("ruff check", "ruff format --check") if not passes(*command.split())]
    # the type checker keeps one core busy for most of a minute, so it runs beside the tests
    with tempfile.TemporaryFile("w+", encoding="utf-8") as output:
        types = subprocess.Popen([python, "-m", "basedpyright"], cwd=ROOT, stdout=output)
        failed += [] if passes("pytest", *two_at_a_time) else ["pytest"]
        failed += ["basedpyright"] if types.wait() else []
        output.seek(0)
        said = output.read().rstrip()
        # of a thousand warnings the last line, which counts them
        print(said if types.returncode else said.rpartition("\n")[2], flush=True)
    for command in failed:  # the tests' own last line may be green
        say(f"failed, its output is above: {command}")
    return 1 if failed else 0


def package() -> int:
    """Build dist/*.zip and dist/index.json: with Blender's own builder where there is a Blender, else with ours."""
    blender = os.environ.get("MFO_BLENDER", "").split(os.pathsep)[0] or shutil.which("blender")
    if not blender:  # the bpy module lacks the command
        run(venv_program("python"), ROOT / "tools" / "extension_repository.py")
        list_contents()
        say("built without Blender; with one (MFO_BLENDER) the zip is validated too")
        return 0
    (ROOT / "dist").mkdir(exist_ok=True)
    extension = [blender, "--factory-startup", "--command", "extension"]
    run(*extension, "build", "--source-dir", ROOT, "--output-dir", ROOT / "dist")
    for archive in sorted((ROOT / "dist").glob("*.zip")):
        run(*extension, "validate", archive)
    run(*extension, "server-generate", "--repo-dir", ROOT / "dist")
    list_contents()
    return 0


def list_contents() -> None:
    """Say what each zip in dist/ holds: the files and kilobytes of every folder and file at its top."""
    for archive in sorted((ROOT / "dist").glob("*.zip")):
        say(f"{archive.name}, {archive.stat().st_size / 1000:.0f} kB packed:")
        inside: dict[str, list[int]] = {}
        with zipfile.ZipFile(archive) as opened:
            for each in opened.infolist():
                if not each.is_dir():
                    inside.setdefault(each.filename.split("/")[0], []).append(each.file_size)
        for name, sizes in sorted(inside.items()):
            say(f"  {name:24} {len(sizes):4} {'file' if len(sizes) == 1 else 'files'} {sum(sizes) / 1000:7.0f} kB")


def lock() -> int:
    """Resolve the dependencies and write both lock files; no address of a registry goes into them."""
    python = venv_program("python")
    run(python, "-m", "pip", "install", "--quiet", "uv")
    quiet = ["--no-header", "--no-annotate", "--no-emit-index-url", "--no-emit-find-links", "--quiet"]
    options = ["--universal", "--generate-hashes", *quiet]
    compile_lock = [python, "-m", "uv", "pip", "compile", "pyproject.toml", *options]
    run(*compile_lock, "--python-version", "3.10", "-o", "requirements/backend.lock")
    run(*compile_lock, "--python-version", "3.11", "--group", "dev", "-o", "requirements/dev.lock")
    return 0


def main() -> int:
    """Read the command line and run one command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=["setup", "demo", "test", "mfo", "package", "lock"])
    parser.add_argument("arguments", nargs=argparse.REMAINDER, help="handed to the command")
    options = parser.parse_args()
    try:
        use_required_python()
        set_up()
        commands = {
            "setup": lambda: 0,
            "demo": lambda: mfo(["demo", *options.arguments]),
            "test": lambda: test(options.arguments),
            "mfo": lambda: mfo(options.arguments),
            "package": package,
            "lock": lock,
        }
        return commands[options.command]()
    except DevError as error:
        say(str(error))
        return 3


if __name__ == "__main__":
    sys.exit(main())
