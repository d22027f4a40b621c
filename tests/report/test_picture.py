# SPDX-License-Identifier: Apache-2.0
"""Pictures as files: a thumbnail is the picture, smaller."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image as Pillow

from mfo_backend.report.picture import THUMBNAIL_SIDE, thumbnail_bytes


@pytest.mark.parametrize(
    ("size", "expected"),
    [((1080, 1920), (270, 480)), ((1920, 1080), (480, 270)), ((64, 96), (64, 96)), ((3, 2000), (3, 2000))],
)
def test_thumbnail(size: tuple[int, int], expected: tuple[int, int]) -> None:
    display = np.zeros((*size, 3), np.float32)
    display[: size[0] // 2] = (1.0, 0.2, 0.6)
    small = np.asarray(Pillow.open(io.BytesIO(thumbnail_bytes(display))))
    assert small.shape[:2] == expected
    assert max(expected) <= THUMBNAIL_SIDE or expected == size  # a strip stays as it is
    assert small[0, 0].tolist() == [255, 51, 153]
    assert small[-1, -1].tolist() == [0, 0, 0]
