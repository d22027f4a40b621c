# SPDX-License-Identifier: Apache-2.0
"""Light below the surface as Christensen and Burley have it: how much of it leaves at which distance.

Source: P. Christensen, B. Burley, "Approximate Reflectance Profiles for Efficient Subsurface Scattering" (2015), eq. 3.
Its width is that of Cycles (kernel/closure/bssrdf.h, Blender 4.2 to 5.2), whatever the albedo, and so is its end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..arrays import dual as dr
from ..arrays.clamp import at_least

END = 16.0  # widths, beyond which nothing leaves
SHARE_BEFORE_END = 1.0 - 0.25 * math.exp(-END) - 0.75 * math.exp(-END / 3.0)
SHORTENED = 0.25 / math.pi  # width of a radius
LEAST_WIDTH = 1e-8  # scene units


@dataclass(frozen=True)
class DiskProfile:
    """How far light goes in each channel: the `width` d, RGB, in scene units."""

    width: Any

    @staticmethod
    def of(parameters: Mapping[str, Any]) -> DiskProfile:
        """That of parameter values by name."""
        radius = parameters["subsurface_radius"] * parameters["subsurface_scale"]
        return DiskProfile(at_least(radius * SHORTENED, LEAST_WIDTH))

    def carried(self, on_disk: Any, distance: Any, log_density: Any) -> Any:
        """What light carries that leaves at a distance, RGB; it was found at another one `on_disk`.

        Cycles draws that for one of the channels and looks no further than the end of its width, though the density is
        that of all.
        """
        widths = [self.width[k] for k in range(3)]
        likely = [leaving(width, on_disk) for width in widths]
        found = [dr.select(distance < END * width, p, 0) for width, p in zip(widths, likely, strict=True)]
        looked = sum(found[1:], found[0]) / dr.maximum(sum(likely[1:], likely[0]), 1e-30)
        return leaving(self.width, distance) * (looked * dr.exp(-log_density))


def leaving(width: Any, distance: Any) -> Any:
    """The share of light that leaves on a ring of this radius, over its breadth in scene units: 2 pi r R(r)."""
    third = dr.exp(-distance / (3 * width))
    return dr.select(distance < END * width, (third + third * dr.square(third)) / (4 * SHARE_BEFORE_END * width), 0)
