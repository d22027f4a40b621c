# SPDX-License-Identifier: Apache-2.0
"""What is shown while a fit runs: small, of the right colours, black where nothing differs."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image as Pillow

from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.report.live_pictures import LARGEST_MAP, LivePictures
from mfo_backend.types.event import PREVIEW_SIDE
from mfo_backend.types.image import Encoding, Image


def opened(ppm: bytes) -> np.ndarray:
    return np.asarray(Pillow.open(io.BytesIO(ppm)))


@pytest.mark.parametrize("size", [(40, 60), (300, 700), (1030, 8), (2, 900)])
def test_sizes(size: tuple[int, int]) -> None:
    pixels = np.full((*size, 3), 0.25, np.float32)
    live = LivePictures(Image(pixels, Encoding.LINEAR), DisplayView())
    assert opened(live.reference()).shape == opened(live.current(pixels)).shape  # they are compared
    for ppm, largest in ((live.current(pixels), PREVIEW_SIDE), (live.difference(pixels), LARGEST_MAP)):
        shown = opened(ppm)
        thin = -(-max(size) // largest) > min(size)  # nothing to average over
        assert max(shown.shape[:2]) <= (max(size) if thin else largest)
        assert shown.shape[2] == 3
    # IEC 61966-2-1: 0.25 linear is 0.5371 of 255
    assert (opened(live.current(pixels)) == 137).all()
    assert (opened(live.reference()) == 137).all()


def test_difference_is_where_the_pictures_differ() -> None:
    reference = np.full((400, 400, 3), 0.2, np.float32)
    test = reference.copy()
    test[:, 200:] = 0.6
    shown = opened(LivePictures(Image(reference, Encoding.LINEAR), DisplayView()).difference(test)).astype(int)
    width = shown.shape[1]
    assert shown[:, : width // 4].sum(axis=-1).max() <= 10  # magma begins at (0, 0, 4)
    assert shown[:, -width // 4 :].sum(axis=-1).min() > 100
    assert shown[0, 0].tolist() == [0, 0, 4]


def test_nan_is_no_error() -> None:
    pixels = np.full((8, 8, 3), 0.2, np.float32)
    broken = pixels.copy()
    broken[0, 0] = np.nan
    live = LivePictures(Image(pixels, Encoding.LINEAR), DisplayView())
    assert opened(live.current(broken)).shape == opened(live.difference(broken)).shape == (8, 8, 3)
