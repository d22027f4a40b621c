# SPDX-License-Identifier: Apache-2.0
"""Without the optional packages: one sentence how to get them, and nothing else breaks."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.metrics.judgement import judge_images
from mfo_backend.metrics.judges import packages
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.metrics.losses.loss_names import OPTIONAL_LOSS_NAMES
from mfo_backend.types.errors import SetupError
from mfo_backend.types.image import Encoding, Image

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def absent(monkeypatch):
    """No torch and no cvvdp."""
    for name in ("torch", "pycvvdp"):
        monkeypatch.setitem(sys.modules, name, None)


@pytest.mark.usefixtures("absent")
@pytest.mark.parametrize("name", OPTIONAL_LOSS_NAMES)
def test_a_loss_says_what_to_install(name):
    reference = Image(np.ones((40, 40, 3), np.float32), Encoding.LINEAR)
    what, package = ("ColorVideoVDP", "cvvdp==0.5.7") if name.startswith("cvvdp") else ("LPIPS", "lpips==0.1.4")
    with pytest.raises(
        SetupError, match=rf"{what} cannot be imported .*torch.*: run .* -m pip install \"{package}\"\.$"
    ):
        make_loss(name, reference)


def test_a_missing_part_of_the_package_is_named(monkeypatch):
    monkeypatch.setattr(packages, "require_torch", lambda *_: None)
    monkeypatch.setattr(packages, "_loads", lambda _: True)
    monkeypatch.setitem(sys.modules, "pycvvdp", None)
    monkeypatch.delitem(sys.modules, "pycvvdp")
    monkeypatch.setattr(packages.importlib, "import_module", _fails)
    with pytest.raises(
        SetupError, match=r"ColorVideoVDP cannot be imported \(No module named 'ffmpeg'\): run .*cvvdp=="
    ):
        packages.require_pycvvdp()


def _fails(name):
    raise ModuleNotFoundError("No module named 'ffmpeg'")


@pytest.mark.usefixtures("absent")
def test_a_comparison_without_judges_has_no_score_and_one_note(monkeypatch):
    monkeypatch.delenv("MFO_HDRVDP3", raising=False)
    picture = Image(np.ones((8, 8, 3), np.float32), Encoding.LINEAR)
    judgement = judge_images(picture, picture)
    assert judgement.jod is None
    assert judgement.hdrvdp3_q_jod is None
    assert len(judgement.notes) == 1
    assert "pip install" in judgement.notes[0]


def test_losses_and_comparison_import_no_torch():
    code = (
        "import sys, mfo_backend.metrics.losses.loss, mfo_backend.metrics.judgement, mfo_backend.cli.commands.compare\n"
        "print(sorted({'torch', 'pycvvdp', 'lpips'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"
