# SPDX-License-Identifier: Apache-2.0
"""Materials that look alike, as their anisotropic lobe is as wide as can be.

Cycles clamps the larger of the lobe's two widths, roughness^2 / stretch, at 1 (`material/layers.py`). Past that only
the other one counts, roughness^2 x stretch, and a fit that ends short of it knows nothing of the flat part: its
derivatives call both values determined.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...types.parameter import ParameterTable
from ..certainty.covariance import MODEL_ERROR
from ..squares.problem import Problem, Rival
from .simplest import HOPELESS

STRETCH = 0.9  # of Blender's anisotropy: the stretch is the root of 1 less so much of it
PAST = 1.02  # the larger width that says whether the picture knows of the clamp
SHARE = 1.0 / 3.0  # mean square of what is as likely anywhere on a line from 0 to 1

Vector = NDArray[np.float64]


def width_rivals(problem: Problem, x: Vector, table: ParameterTable) -> tuple[Rival, ...]:
    """The far end of the materials that look like `x`; none where the lobe is not as wide as can be."""
    if not {"roughness", "anisotropic"} <= set(table.names):
        return ()
    roughness, anisotropic = (table.slice_of(name) for name in ("roughness", "anisotropic"))
    narrow = float(x[roughness][0] ** 2 * _stretch(x[anisotropic][0]))
    least = max(narrow / table["roughness"].upper ** 2, _stretch(table["anisotropic"].upper))

    def alike(stretch: float) -> Vector:
        y = x.copy()
        y[roughness], y[anisotropic] = np.sqrt(narrow / stretch), (1.0 - stretch**2) / STRETCH
        return np.clip(y, table.lower, table.upper)

    past = float(np.sqrt(narrow / PAST))
    if past <= least:
        return ()
    cost = problem.equations(x).cost
    noise = max(cost, 0.5 * MODEL_ERROR**2)
    if problem.equations(alike(past)).cost > cost + HOPELESS * noise / problem.independent:
        return ()
    return (Rival(alike(least), SHARE, last=True),)


def _stretch(anisotropic: float) -> float:
    return float(np.sqrt(1.0 - STRETCH * anisotropic))
