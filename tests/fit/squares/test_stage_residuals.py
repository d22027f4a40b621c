# SPDX-License-Identifier: Apache-2.0
"""The residuals of named finishing stages against the losses of the same name."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.fit.squares.stage_residuals import finishing_residuals
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.losses.loss import make_loss, squared_response
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image


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
    assert names(preset="balanced") == ["itp"]
    assert names(preset="balanced", range="ldr") == ["display", "itp"]


@pytest.mark.parametrize("name", ["flip-hdr", "flip-ldr"])
def test_what_is_no_sum_of_squares_is_refused(name):
    reference, _ = pictures()
    with pytest.raises(BadInputError, match="no sum of squares"):
        squared_response(name, reference, np.ones(reference.shape[:2], bool), DisplayView())
