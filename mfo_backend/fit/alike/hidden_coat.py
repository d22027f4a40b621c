# SPDX-License-Identifier: Apache-2.0
"""A coat that a material lacks, as wide as it would hide best.

How sure a weight of 0 is, and what trades against it, hangs on a roughness that no picture shows: a coat as sharp as a
mirror would be seen at once, one nearly as wide as the base's highlight hardly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ...types.parameter import ParameterTable, Vector
from .simplest import BASE, COAT, exchangeable
from .unneeded_lobes import is_off

# Roughness of a coat, of the base's. A seat of roughness 0.32 below a coat of 0.1 ended without one at 0.280, which is
# 4.5 of its deviations away, and 2.7 with these (docs/notebook/verdicts.md). Each is an evaluation.
OF_THE_BASE = (0.25, 0.5, 1.0)


def largest_covariance(
    covariance: Callable[[Vector], NDArray[np.float64]], x: Vector, table: ParameterTable
) -> NDArray[np.float64]:
    """The `covariance` (k, k) of materials that look like `x`, each value as unsure as in any of them.

    Correlations are those of the one of which least is known in all.
    """
    if not exchangeable(table) or not is_off(COAT[0], x, table):
        return covariance(x)
    widths = (part * table.value(x, BASE[1]) for part in OF_THE_BASE)
    alike = [x, *(table.clip(table.with_values(x, **{COAT[1]: width})) for width in widths)]
    spreads = [covariance(each) for each in alike]
    deviations = np.sqrt([np.diag(spread) for spread in spreads])
    least_known = int(np.argmax(np.sum(deviations**2, axis=1)))
    gain = deviations.max(axis=0) / np.maximum(deviations[least_known], np.finfo(np.float64).tiny)
    return spreads[least_known] * np.outer(gain, gain)
