# SPDX-License-Identifier: Apache-2.0
"""The real backend behind real Blender programs: by the operators of the installed zip, and by `mfo demo`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip.flip_error import flip_error
from mfo_backend.scene.image_file import read_image

from ..end_to_end.conftest import run_mfo
from .conftest import ADDON_ID, RealBlender

pytestmark = [pytest.mark.blender, pytest.mark.slow]
SCRIPT = Path(__file__).resolve().parent / "scripts" / "real_fit.py"


def test_demo_then_operators(blender: RealBlender, tmp_path: Path) -> None:
    demo = tmp_path / "demo"
    done = run_mfo("demo", "--out", demo, "--size", 96, "--samples", 64, "--blender", blender.program, "--json")
    assert done.code == 0, done.stderr
    assert done.answer["flip_after"] <= 0.06
    assert done.answer["flip_after"] * 4 <= done.answer["flip_before"]

    options = ["--addons", ADDON_ID, "--python-exit-code", "3", "--python", str(SCRIPT)]
    reference = str(demo / "reference.exr")
    opened = blender.run(
        str(demo / "start.blend"), *options, "--", reference, str(tmp_path), MFO_BACKEND_PYTHON=sys.executable
    )
    assert "ALL GOOD" in opened.stdout
    result = json.loads((tmp_path / "job" / "result.json").read_text("utf-8"))
    assert result["model"] == "blender_principled"
    after = flip_error(read_image(demo / "reference.exr"), read_image(tmp_path / "after.exr"), display=DisplayView())
    assert after.mean <= 0.06
    assert after.mean * 4 <= done.answer["flip_before"]


def test_values_inside_nodes_of_two_pictures(blender: RealBlender, tmp_path: Path) -> None:
    """Both pictures are rendered by this Blender's Cycles, which evaluates the nodes for the fit, too."""
    script = SCRIPT.parent / "graphs" / "two_pictures.py"
    assert "ALL GOOD" in blender.script(script, str(tmp_path), MFO_BACKEND_PYTHON=sys.executable)
    found = json.loads((tmp_path / "values.json").read_text("utf-8"))
    for truth, applied in zip(found["truth"], found["applied"], strict=True):
        assert applied == pytest.approx(truth, abs=0.015)
    result = json.loads((tmp_path / "job" / "result.json").read_text("utf-8"))
    assert [(picture["number"], picture["verdict"]) for picture in result["pictures"]] == [(1, "same"), (2, "same")]
