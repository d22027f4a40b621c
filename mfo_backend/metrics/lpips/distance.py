# SPDX-License-Identifier: Apache-2.0
"""LPIPS: the distance of two pictures in the features of a network that learned to classify.

References
----------
Zhang et al., "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric", CVPR 2018, equation 1; constants
of version 0.1 of the authors' package lpips.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ...types.errors import BadInputError
from .trunks import LEAST_SIZE
from .weights import load_heads, load_trunk

Array = NDArray[np.floating]

_SHIFT, _SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)
_EPSILON = 1e-10


class Lpips:
    """LPIPS with network `net` against one reference, whose features are computed once.

    Parameters
    ----------
    net
        ``alex``, ``vgg`` or ``squeeze``.
    reference
        Display values (height, width, 3), 0 black and 1 white.

    Raises
    ------
    SetupError
        If the heads or the network's weights are missing.
    BadInputError
        For a picture too small for the network, or a file of weights that is not the network's.
    """

    def __init__(self, net: str, reference: Array) -> None:
        height, width = reference.shape[:2]
        if min(height, width) < LEAST_SIZE[net]:
            raise BadInputError(
                f"LPIPS ({net}) needs pictures of at least {LEAST_SIZE[net]}x{LEAST_SIZE[net]} pixels, "
                f"but the reference is {width}x{height}: use larger ones or another loss."
            )
        self._heads = load_heads(net)
        self._trunk = load_trunk(net)
        self._shift, self._scale = (torch.tensor(values).view(1, 3, 1, 1) for values in (_SHIFT, _SCALE))
        with torch.no_grad():
            self._reference = self._features(_tensor(reference))

    def value(self, test: Array) -> float:
        """The distance of display values (height, width, 3)."""
        with torch.no_grad():
            return self._distance(_tensor(test)).item()

    def value_and_gradient(self, test: Array) -> tuple[float, Array]:
        """The distance of display values and its gradient with respect to them, both (height, width, 3)."""
        tensor = _tensor(test).requires_grad_()
        value = self._distance(tensor)
        value.backward()
        gradient = tensor.grad[0].permute(1, 2, 0).numpy()
        return value.item(), np.ascontiguousarray(gradient, dtype=test.dtype)

    def _distance(self, image: Any) -> Any:
        maps = zip(self._heads, self._features(image), self._reference, strict=True)
        return sum((head * (test - reference).square()).sum(1).mean() for head, test, reference in maps)

    def _features(self, image: Any) -> list[Any]:
        """The network's features of display values, each pixel's of unit length."""
        centred = (2 * image - 1 - self._shift) / self._scale
        return [_unit(features) for features in self._trunk(centred)]


def _unit(features: Any) -> Any:
    # the root of 0 has no slope: all features of a dark pixel can be 0
    length = features.square().sum(1, keepdim=True).clamp(min=_EPSILON**2).sqrt()
    return features / (length + _EPSILON)


def _tensor(pixels: Array) -> Any:
    return torch.from_numpy(np.ascontiguousarray(pixels.transpose(2, 0, 1), dtype=np.float32))[None]
