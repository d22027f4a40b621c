# SPDX-License-Identifier: Apache-2.0
"""A Gaussian blur of torch tensors with mirrored borders."""

from __future__ import annotations

from typing import Any

import torch  # pyright: ignore[reportMissingImports]
from torch.nn import functional  # pyright: ignore[reportMissingImports]


class GaussianBlur:
    """Blurs the last two axes of a tensor; called as torchvision's class of this name.

    Parameters
    ----------
    kernel_size
        Odd number of taps; the picture must be larger than half of it.
    sigma
        Standard deviation in pixels.
    """

    def __init__(self, kernel_size: int, sigma: float) -> None:
        offsets = torch.arange(kernel_size, dtype=torch.float32) - (kernel_size - 1) / 2
        weights = torch.exp(-0.5 * (offsets / sigma) ** 2)
        self._weights = weights / weights.sum()
        self._radius = kernel_size // 2

    def forward(self, image: Any) -> Any:
        """The blurred tensor (..., height, width)."""
        weights = self._weights.to(image)
        radius = self._radius
        planes = image.reshape(-1, 1, *image.shape[-2:])
        planes = functional.pad(planes, (radius, radius, radius, radius), mode="reflect")
        planes = functional.conv2d(planes, weights.view(1, 1, 1, -1))
        return functional.conv2d(planes, weights.view(1, 1, -1, 1)).reshape(image.shape)

    __call__ = forward
