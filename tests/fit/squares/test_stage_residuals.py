# SPDX-License-Identifier: Apache-2.0
"""The residuals of named finishing stages against the losses of the same name."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.fit.squares.stage_residuals import finishing_residuals
from mfo_backend.metrics.loss import make_loss, squared_response
from mfo_backend.metrics.tone_mapping import DisplayView
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

BACKEND = Path(__file__).resolve().parents[3] / "mfo_backend"


def pictures():
    rng = np.random.default_rng(0)
    return (0.02 * 10 ** rng.uniform(0, 2, (2, 12, 15, 3))).astype(np.float32)


@pytest.mark.parametrize("name", ["mse-hdr", "log-hdr", "pu21-hdr", "itp-hdr", "mse-ldr", "pu21-ldr", "itp-ldr"])
def test_the_mean_square_is_the_loss(name):
    reference, image = pictures()
    mask = np.ones(reference.shape[:2], bool)
    view = DisplayView.for_scene(reference, mask)
    settings = FitSettings(preset="fast", losses=(name,))
    (make,) = finishing_residuals(settings, Encoding.LINEAR, reference, mask, view).values()
    values, _ = make(reference.reshape(-1, 3))(image.reshape(-1, 3))
    loss = make_loss(name, Image(reference, Encoding.LINEAR), mask=mask, display=view)
    assert loss.value(image) == pytest.approx(np.mean(np.square(values, dtype=np.float64)), rel=1e-5)


def test_presets_without_losses():
    reference, _ = pictures()
    mask = np.ones(reference.shape[:2], bool)

    def names(**settings):
        return list(finishing_residuals(FitSettings(**settings), Encoding.LINEAR, reference, mask, DisplayView()))

    assert names(preset="fast") == []
    assert names(preset="balanced") == ["itp", "pu21"]
    assert names(preset="balanced", range="ldr") == ["display", "itp"]


NEW_LOSS = """
import numpy as np
from mfo_backend.fit.settings import FitSettings
from mfo_backend.fit.squares.stage_residuals import finishing_residuals
from mfo_backend.metrics.loss import make_loss, squared_response
from mfo_backend.metrics.tone_mapping import DisplayView
from mfo_backend.types.image import Encoding, Image

reference, image = (0.02 * 10 ** np.random.default_rng(0).uniform(0, 2, (2, 12, 15, 3))).astype(np.float32)
mask = np.ones(reference.shape[:2], bool)
settings = FitSettings(preset="balanced", losses=("root-hdr",))
((name, make),) = finishing_residuals(settings, Encoding.LINEAR, reference, mask, DisplayView()).items()
values, _ = make(reference.reshape(-1, 3))(image.reshape(-1, 3))
loss = make_loss("root-hdr", Image(reference, Encoding.LINEAR), mask=mask)
by_hand = np.mean((image**0.5 - reference**0.5) ** 2)
print(name, np.mean(np.square(values, dtype=np.float64)), loss.value(image), by_hand)
"""
ROOT_RESPONSE = """

class Root:
    def apply(self, linear):
        return np.sqrt(np.maximum(linear, 0.0))

    def slope(self, linear):
        return 0.5 / np.sqrt(np.maximum(linear, 1e-12))

    def push(self, linear, tangent):
        return self.slope(linear) * tangent

    def pull(self, linear, gradient):
        return self.slope(linear) * gradient


HDR_RESPONSES["root"] = lambda target, mask: Root()
"""


def test_a_new_loss_is_minimised_by_a_stage_of_its_name(tmp_path):
    """The recipe of the architecture's page, followed in a copy: a response, and its name."""
    package = tmp_path / "mfo_backend"
    for layer in ("types", "metrics", "solve", "fit", "material"):
        shutil.copytree(BACKEND / layer, package / layer, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(BACKEND / "__init__.py", package)
    losses, names = package / "metrics" / "loss.py", package / "metrics" / "loss_names.py"
    losses.write_text(losses.read_text("utf-8") + ROOT_RESPONSE, "utf-8")
    text = names.read_text("utf-8")
    for line, longer in (
        ('HDR_LOSSES = ("mse-hdr",', 'HDR_LOSSES = ("root-hdr", "mse-hdr",'),
        ('SQUARED_KINDS = ("mse",', 'SQUARED_KINDS = ("root", "mse",'),
    ):
        assert text.count(line) == 1
        text = text.replace(line, longer)
    names.write_text(text, "utf-8")
    told = subprocess.run(
        [sys.executable, "-c", NEW_LOSS], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True, text=True, check=True,
    ).stdout.split()  # fmt: skip
    assert told[0] == "root-hdr"
    of_stage, of_loss, by_hand = map(float, told[1:])
    assert of_stage == pytest.approx(by_hand, rel=1e-5)
    assert of_loss == pytest.approx(by_hand, rel=1e-5)


@pytest.mark.parametrize("name", ["flip-hdr", "flip-ldr"])
def test_what_is_no_sum_of_squares_is_refused(name):
    reference, _ = pictures()
    with pytest.raises(BadInputError, match="no sum of squares"):
        squared_response(name, reference, np.ones(reference.shape[:2], bool), DisplayView())
