# SPDX-License-Identifier: Apache-2.0
"""The layers of a material at a surface point, between its frame and theirs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..principled.layers import Layers


@dataclass(frozen=True)
class SurfaceLayers:
    """The layers at a surface point, and their frame in the world where it is not that of the point."""

    layers: Layers
    si: Any
    frame: Any

    def to_local(self, wo: Any) -> Any:
        """A direction of the point's frame in that of the layers."""
        return self.layers.to_frame(wo if self.frame is None else self.frame.to_local(self.si.to_world(wo)))

    def from_local(self, direction: Any) -> Any:
        """The inverse of `to_local`."""
        wo = self.layers.from_frame(direction)
        return wo if self.frame is None else self.si.to_local(self.frame.to_world(wo))
