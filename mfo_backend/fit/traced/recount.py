# SPDX-License-Identifier: Apache-2.0
"""How many samples a noisy reference has, asked again at the end of a fit, and what an error of that does to pixels.

The count that a fit compares with (`equal_counts`) is a whole number, found where the model was still off. At the end
the noise tells it better, and how well. An error of the count is one of the brightness, which the scatter of the
residuals does not hold.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .noise_excess import NoiseComparison
from .sample_count import EqualCounts, TwoPictures

Vector = NDArray[np.float64]

LEAST_SLOPE = 0.05  # of the excess by the logarithm of the count: below, noise hardly tells it
CURVED = 0.03  # of the logarithm: the excess is not quite a straight line
MOST = float(np.log(2.0))  # a straight line from n to 2 n samples holds no further


@dataclass(frozen=True)
class Recount:
    """What the noise says about the count at the end of a fit.

    Attributes
    ----------
    log_ratio, sd
        Natural logarithm of the reference's count over the one that was compared with, `MOST` away at most, and its
        standard deviation, which holds what is further away.
    slope
        Derivative of the mean of compressed pixels (p, 3) by that logarithm.
    """

    log_ratio: float
    sd: float
    slope: Vector = field(repr=False)


def recount(counts: EqualCounts, comparison: NoiseComparison, pictures: TwoPictures) -> Recount:
    """Count the samples of the reference again by four linear `pictures` of the model at the end."""
    once = np.concatenate([pictures(counts.count, stream) for stream in range(2)])
    twice = 0.5 * (once[::2] + once[1::2])
    here, further = comparison.excess(once), comparison.excess(twice)
    steepness = max((here.logarithm - further.logarithm) / np.log(2.0), LEAST_SLOPE)
    ratio = here.logarithm / steepness
    followed = float(np.clip(ratio, -MOST, MOST))
    sd = float(np.linalg.norm([np.sqrt(here.variance) / steepness, CURVED, ratio - followed]))
    means = [counts.compress(y[..., None])[..., 0].mean(axis=0, dtype=np.float64) for y in (once, twice)]
    return Recount(followed, sd, (means[1] - means[0]) / np.log(2.0))
