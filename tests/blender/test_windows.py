# SPDX-License-Identifier: Apache-2.0
"""The extension in real windows: the interface never waits, and a running fit survives what users do."""

from __future__ import annotations

import dataclasses
import os
import sys
from pathlib import Path

import pytest

from ..addon import fake_backend
from ..addon.backend.wheel_folder import write_wheel
from .conftest import ADDON_ID, PATIENCE, RealBlender

pytestmark = [
    pytest.mark.blender,
    pytest.mark.slow,
    pytest.mark.timeout(PATIENCE + 60.0),  # Blender and its screen are ended first
]
SCRIPT = Path(__file__).resolve().parent / "scripts" / "in_windows.py"


def test_in_windows(windowed: RealBlender, tmp_path: Path) -> None:
    fake_backend.png(tmp_path / "reference.png", (180, 60, 40))
    python = str(fake_backend.write_interpreter(tmp_path / "backend_python"))
    out = windowed.script(SCRIPT, ADDON_ID, str(tmp_path), windows=True, MFO_BACKEND_PYTHON=python)
    assert "ALL GOOD" in out, out[-4000:]
    assert "script error" not in out, out[-4000:]
    print(next(line for line in out.splitlines() if "ALL GOOD" in line))


def test_backend_set_up_in_windows(windowed: RealBlender, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MFO_BACKEND_PYTHON", raising=False)
    lock = write_wheel(tmp_path / "wheels")
    arguments = [ADDON_ID, str(tmp_path / "wheels"), str(lock), os.environ.get("MFO_BASE_PYTHON", "")]
    out = windowed.script(SCRIPT.with_name("set_up_in_windows.py"), *arguments, windows=True)
    assert "ALL GOOD" in out, out[-4000:]
    assert "script error" not in out, out[-4000:]
    print(next(line for line in out.splitlines() if "ALL GOOD" in line))


def test_whole_way_by_real_events(windowed: RealBlender, tmp_path: Path) -> None:
    """From the zip to the question at the end, in a Blender that never had the extension, by events of an X server."""
    fresh = dataclasses.replace(windowed, profile=tmp_path / "profile")
    fresh.profile.mkdir()
    fake_backend.png(tmp_path / "reference.png", (180, 60, 40))
    python = str(fake_backend.write_interpreter(tmp_path / "backend_python"))
    arguments = [ADDON_ID, str(tmp_path), "1", "220", str(windowed.package)]
    script = ["--python-exit-code", "3", "--python", str(SCRIPT.with_name("by_hand.py")), "--", *arguments]
    out = fresh.run(*script, windows=True, MFO_BACKEND_PYTHON=python).stdout
    assert "ALL GOOD by hand" in out, out[-4000:]
    assert "script error" not in out, out[-4000:]


@pytest.mark.parametrize(("scale", "width"), [(1, 220), (2, 400)])
def test_main_way_by_mouse_and_keys(windowed: RealBlender, tmp_path: Path, scale: int, width: int) -> None:
    fake_backend.png(tmp_path / "reference.png", (180, 60, 40))
    python = str(fake_backend.write_interpreter(tmp_path / "backend_python"))
    options = ["--enable-event-simulate", "--addons", ADDON_ID, "--python-exit-code", "3"]
    script = [str(SCRIPT.with_name("by_hand.py")), "--", ADDON_ID, str(tmp_path), str(scale), str(width)]
    out = windowed.run(*options, "--python", *script, windows=True, MFO_BACKEND_PYTHON=python).stdout
    assert "ALL GOOD by hand" in out, out[-4000:]
    assert "script error" not in out, out[-4000:]


def test_the_reference_against_the_view(windowed: RealBlender, tmp_path: Path) -> None:
    """Its own render over the camera's view: no seam where it is split, one grey where it is subtracted."""
    script = [str(SCRIPT.parent / "desktop" / "over_the_view.py"), "--", ADDON_ID, str(tmp_path)]
    options = ["--enable-event-simulate", "--addons", ADDON_ID, "--python-exit-code", "3", "--python"]
    out = windowed.run(*options, *script, windows=True).stdout
    assert "ALL GOOD over the view" in out, out[-4000:]
    assert "script error" not in out, out[-4000:]
    print(*(line for line in out.splitlines() if "off by" in line), sep="\n")


def test_two_pictures_and_two_materials_by_real_events(windowed: RealBlender, tmp_path: Path) -> None:
    """Both lists, the real backend: values near the truth of Cycles, a verdict for each, one step to apply and undo."""
    script = [str(SCRIPT.parent / "desktop" / "both_lists.py"), "--", ADDON_ID, str(tmp_path)]
    options = ["--addons", ADDON_ID, "--python-exit-code", "3", "--python"]
    out = windowed.run(*options, *script, windows=True, MFO_BACKEND_PYTHON=sys.executable).stdout
    assert "ALL GOOD with both lists" in out, out[-4000:]
    assert "script error" not in out, out[-4000:]
