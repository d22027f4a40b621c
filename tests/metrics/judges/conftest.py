# SPDX-License-Identifier: Apache-2.0
"""Light in cd/m^2 for the judges to look at."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture
def lit_ball():
    """A ball with a highlight on grey, (64, 72, 3) linear Rec.709 in cd/m^2; pure formulas, keyword `hue` moves red."""

    def light(*, hue=1.0, width=0.02, gain=1.0):
        y, x = np.mgrid[:64, :72]
        u, v = (x - 36) / 26, (y - 32) / 26
        inside = (u**2 + v**2 < 1)[..., None]
        facing = np.sqrt(np.maximum(1 - u**2 - v**2, 0))
        highlight = 400 * np.exp(-((u + 0.3) ** 2 + (v + 0.3) ** 2) / width) * 0.02 / width
        body = 120 * facing[..., None] * np.array([0.6 * hue, 0.25, 0.1]) + highlight[..., None]
        return (gain * np.where(inside, 5 + body, 40.0)).astype(np.float32)

    return light
