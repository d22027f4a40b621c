# SPDX-License-Identifier: Apache-2.0
"""A loss by the recipe: the squares of its stage are those of the loss that Adam and `mfo compare` see."""

from __future__ import annotations

from pathlib import Path

import pytest

from .recipe import follow

SEE = """
import numpy as np
from mfo_backend.fit.settings import FitSettings
from mfo_backend.fit.squares.stage_residuals import finishing_residuals
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.types.image import Encoding, Image

reference, image = (0.02 * 10 ** np.random.default_rng(0).uniform(0, 2, (2, 12, 15, 3))).astype(np.float32)
mask = np.ones(reference.shape[:2], bool)
settings = FitSettings(preset="balanced", losses=("root-hdr",))
((name, make),) = finishing_residuals(settings, Encoding.LINEAR, reference, mask, DisplayView()).items()
values, _ = make(reference.reshape(-1, 3))(image.reshape(-1, 3))
loss = make_loss("root-hdr", Image(reference, Encoding.LINEAR), mask=mask)
floor = 0.01 * reference.mean()
by_hand = np.mean((np.sqrt(image + floor) - np.sqrt(reference + floor)) ** 2)
print(name, np.mean(np.square(values, dtype=np.float64)), loss.value(image), by_hand)
"""


def test_a_new_loss_is_minimised_by_a_stage_of_its_name(tmp_path: Path) -> None:
    name, *numbers = follow("A loss", tmp_path).see(SEE).split()
    of_stage, of_loss, by_hand = map(float, numbers)
    assert name == "root-hdr"
    assert of_stage == pytest.approx(by_hand, rel=1e-4)
    assert of_loss == pytest.approx(by_hand, rel=1e-4)
