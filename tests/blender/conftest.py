# SPDX-License-Identifier: Apache-2.0
"""Real Blender programs from MFO_BLENDER (separated as in PATH), each with the extension in a profile of its own."""

from __future__ import annotations

import os
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent.parent
ADDON_ID = "bl_ext.user_default.material_fit_mfo"
PROGRAMS = [p for p in os.environ.get("MFO_BLENDER", "").split(os.pathsep) if p]
PATIENCE = 900.0  # seconds; a walk through windows takes 60 on two quiet cores, 400 and more with a load of 8
WINDOWED = [p for p in os.environ.get("MFO_BLENDER_WINDOWS", "").split(os.pathsep) if p]


@dataclass(frozen=True)
class RealBlender:
    """A Blender program, the folder of its profile, and the zip that was installed into it."""

    program: str
    profile: Path
    package: Path

    def run(
        self,
        *arguments: str,
        check: bool = True,
        windows: bool = False,
        online: bool = False,
        factory: bool = True,
        **variables: str,
    ) -> subprocess.CompletedProcess[str]:
        """Start it and wait: in background unless with `windows`; `factory`: not with the profile's preferences."""
        environment = os.environ | {"BLENDER_USER_RESOURCES": str(self.profile)} | variables
        command = [
            self.program,
            *([] if windows else ["--background"]),
            *(["--factory-startup"] if factory and not online else []),  # what it keeps goes into the profile
            "--online-mode" if online else "--offline-mode",
            *arguments,
        ]
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, start_new_session=True
        )
        try:
            stdout, stderr = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)  # the program may be a script that started Blender and a screen
            process.communicate()
            raise
        done = subprocess.CompletedProcess(command, process.returncode, stdout, stderr)
        if check:
            assert done.returncode == 0, f"{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
        return done

    def script(self, path: Path, *arguments: str, windows: bool = False, **variables: str) -> str:
        """Run a Python file with the extension enabled; an exception in it is a failed test."""
        options = ["--addons", ADDON_ID, "--python-exit-code", "3", "--python", str(path), "--", *arguments]
        done = self.run(*options, windows=windows, **variables)  # pyright: ignore[reportArgumentType]
        return done.stdout


@pytest.fixture(scope="session", params=PROGRAMS or [None], ids=lambda p: Path(p).name if p else "none")
def blender(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> RealBlender:
    """A Blender with the extension built, validated and installed."""
    if request.param is None:
        pytest.skip("MFO_BLENDER names no Blender program")
    return installed(request.param, tmp_path_factory.mktemp("blender"))


@pytest.fixture(scope="session", params=WINDOWED or [None], ids=lambda p: Path(p).name if p else "none")
def windowed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> RealBlender:
    """The same for a program that can open windows, on a real or a virtual screen."""
    if request.param is None:
        pytest.skip("MFO_BLENDER_WINDOWS names no Blender program")
    return installed(request.param, tmp_path_factory.mktemp("windowed"))


def installed(program: str, folder: Path) -> RealBlender:
    """Build, validate and install the extension into a new profile."""
    found = RealBlender(program, folder / "profile", folder / "material_fit.zip")
    found.profile.mkdir()
    built = ["--source-dir", str(ROOT), "--output-filepath", str(found.package)]
    found.run("--command", "extension", "build", *built)
    found.run("--command", "extension", "validate", str(found.package))
    found.run("--command", "extension", "install-file", "-r", "user_default", "-e", str(found.package))
    return found
