# SPDX-License-Identifier: Apache-2.0
"""The difference of what a display shows, for views that no formula undoes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...metrics.baked_view import BakedView

Rows = NDArray[np.float32]

# Display values a stop; where a display shows no more, this alone leads back. A level of 8 bits is 0.004, so two
# pictures that both stay below white differ by nothing else
_ABOVE_WHITE = 0.05


class DisplayedResidual:
    """The difference of display values to those of a reference (g, 3), with a slope where the image is above white.

    Where the reference is clipped, an image that is brighter still agrees with it.
    """

    def __init__(self, view: BakedView, reference: Rows) -> None:
        self._view = view
        self._target = view.display(reference)
        self._clipped = self._target >= view.top
        self._white = view.white.astype(reference.dtype)

    def __call__(self, image: Rows) -> tuple[Rows, Rows]:
        """See `fit.residuals.Residual`; the derivative is (g, 3 outputs, 3 channels)."""
        shown, jacobian = self._view.display_jacobian(image)
        values = shown - self._target
        agrees = self._clipped & (values >= 0)
        above = ~self._clipped & (image > self._white)
        safe = np.maximum(image, self._white)
        values += _ABOVE_WHITE * np.log2(safe / self._white) * above
        jacobian[np.broadcast_to(np.eye(3, dtype=bool), jacobian.shape)] += (
            above * (_ABOVE_WHITE / np.log(2)) / safe
        ).ravel()
        values[agrees] = 0
        jacobian[agrees] = 0
        return values, jacobian
