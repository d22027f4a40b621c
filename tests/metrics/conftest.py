# SPDX-License-Identifier: Apache-2.0
"""The image pair of the golden FLIP values: pure formulas, so that anyone can make them again with flip-evaluator."""

from __future__ import annotations

import numpy as np
import pytest

HEIGHT, WIDTH = 48, 64


def golden_pair(dtype=np.float32):
    """Reference and test in [0, 1], (48, 64, 3)."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    reference = np.stack(
        [0.5 + 0.5 * np.sin(0.37 * x + 0.11 * c * y + 0.9 * c) * np.cos(0.23 * y - 0.05 * x * c) for c in range(3)], -1
    )
    test = np.stack([0.9 * reference[..., c] + 0.05 * np.sin(1.3 * x + 0.7 * y + c) for c in range(3)], -1)
    test = np.clip(test, 0, 1)
    test[20:28, 30:40] = (0.9, 0.1, 0.2)
    return reference.astype(dtype), test.astype(dtype)


def golden_hdr_pair(dtype=np.float32):
    """The same pair as linear radiance over three decades."""
    return tuple((0.01 * 10 ** (3 * image)).astype(dtype) for image in golden_pair(np.float64))


@pytest.fixture(name="golden_pair")
def _golden_pair():
    return golden_pair


@pytest.fixture(name="golden_hdr_pair")
def _golden_hdr_pair():
    return golden_hdr_pair
