# SPDX-License-Identifier: Apache-2.0
"""Directions for the tests of the models."""

from __future__ import annotations

import numpy as np


def unit(theta: float, phi: float) -> tuple[float, float, float]:
    """Unit vector from angles in degrees."""
    t, p = np.radians(theta), np.radians(phi)
    return float(np.sin(t) * np.cos(p)), float(np.sin(t) * np.sin(p)), float(np.cos(t))
