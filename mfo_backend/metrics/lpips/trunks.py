# SPDX-License-Identifier: Apache-2.0
"""The networks LPIPS takes its features from, layer for layer as torchvision numbers them, without weights.

References
----------
Layers: Krizhevsky, "One weird trick for parallelizing convolutional neural networks", 2014 (AlexNet); Simonyan and
Zisserman, ICLR 2015, configuration D (VGG16); Iandola et al., 2016, release 1.1 (SqueezeNet). Where the features are
taken: Zhang et al., "The Unreasonable Effectiveness of Deep Features as a Perceptual Metric", CVPR 2018, section 3.
"""

from __future__ import annotations

from typing import Any

import torch  # pyright: ignore[reportMissingImports]
from torch import nn  # pyright: ignore[reportMissingImports]

# index in `features` after which each feature map is taken
TAPS = {"alex": (1, 4, 7, 9, 11), "vgg": (3, 8, 15, 22, 29), "squeeze": (1, 4, 7, 9, 10, 11, 12)}
CHANNELS = {
    "alex": (64, 192, 384, 256, 256),
    "vgg": (64, 128, 256, 512, 512),
    "squeeze": (64, 128, 256, 384, 384, 512, 512),
}
# pixels of the shorter side below which a map of the network has no pixel
LEAST_SIZE = {"alex": 31, "vgg": 16, "squeeze": 17}


class Trunk(nn.Module):
    """The convolutional part of network `net`; calling it gives its feature maps, the first one first."""

    def __init__(self, net: str) -> None:
        super().__init__()
        self.features = _LAYERS[net]()
        self._taps = TAPS[net]

    def forward(self, image: Any) -> list[Any]:
        """Feature maps (batch, channels, height, width) of pictures (batch, 3, height, width)."""
        maps = []
        for index, layer in enumerate(self.features):
            image = layer(image)
            if index in self._taps:
                maps.append(image)
        return maps


class Fire(nn.Module):
    """SqueezeNet's module: a 1x1 squeeze, then 1x1 and 3x3 expansions side by side."""

    def __init__(self, inputs: int, squeezed: int, expanded: int) -> None:
        super().__init__()
        self.squeeze = nn.Conv2d(inputs, squeezed, 1)
        self.expand1x1 = nn.Conv2d(squeezed, expanded, 1)
        self.expand3x3 = nn.Conv2d(squeezed, expanded, 3, padding=1)

    def forward(self, image: Any) -> Any:
        """Feature maps (batch, 2 * expanded, height, width)."""
        squeezed = torch.relu(self.squeeze(image))
        return torch.relu(torch.cat([self.expand1x1(squeezed), self.expand3x3(squeezed)], 1))


def _alex() -> nn.Sequential:
    layers: list[nn.Module] = [nn.Conv2d(3, 64, 11, stride=4, padding=2), nn.ReLU(), nn.MaxPool2d(3, 2)]
    layers += [nn.Conv2d(64, 192, 5, padding=2), nn.ReLU(), nn.MaxPool2d(3, 2)]
    for inputs, outputs in ((192, 384), (384, 256), (256, 256)):
        layers += [nn.Conv2d(inputs, outputs, 3, padding=1), nn.ReLU()]
    return nn.Sequential(*layers)


def _vgg() -> nn.Sequential:
    layers: list[nn.Module] = []
    inputs = 3
    for outputs, count in ((64, 2), (128, 2), (256, 3), (512, 3), (512, 3)):
        if layers:
            layers.append(nn.MaxPool2d(2))
        for _ in range(count):
            layers += [nn.Conv2d(inputs, outputs, 3, padding=1), nn.ReLU()]
            inputs = outputs
    return nn.Sequential(*layers)


def _squeeze() -> nn.Sequential:
    def pool() -> nn.Module:
        return nn.MaxPool2d(3, 2, ceil_mode=True)

    return nn.Sequential(
        nn.Conv2d(3, 64, 3, stride=2),
        nn.ReLU(),
        pool(),
        Fire(64, 16, 64),
        Fire(128, 16, 64),
        pool(),
        Fire(128, 32, 128),
        Fire(256, 32, 128),
        pool(),
        Fire(256, 48, 192),
        Fire(384, 48, 192),
        Fire(384, 64, 256),
        Fire(512, 64, 256),
    )


_LAYERS = {"alex": _alex, "vgg": _vgg, "squeeze": _squeeze}
