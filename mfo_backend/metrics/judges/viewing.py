# SPDX-License-Identifier: Apache-2.0
"""The display and the distance a judge is told about."""

from __future__ import annotations

from dataclasses import dataclass

from ..flip.flip_filters import DEFAULT_PIXELS_PER_DEGREE


@dataclass(frozen=True)
class Viewing:
    """How the observer sees a picture.

    Attributes
    ----------
    peak_nits
        Brightest light of the display in cd/m^2; what is brighter is clipped.
    contrast
        Ratio of its brightest to its darkest light.
    ambient_lux
        Light in the room, of which the display reflects 0.5 %.
    pixels_per_degree
        Pixels in a degree of visual angle; the same as for FLIP.
    """

    peak_nits: float
    contrast: float
    ambient_lux: float
    pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE

    def __str__(self) -> str:
        return (
            f"a display of {self.peak_nits:g} cd/m^2 (contrast {self.contrast:g}:1, room of {self.ambient_lux:g} lux) "
            f"at {self.pixels_per_degree:.2f} pixels per degree"
        )


# ColorVideoVDP's `standard_hdr_linear`
HDR_VIEWING = Viewing(peak_nits=1500.0, contrast=1e6, ambient_lux=10.0)
# the display the other metrics of display values assume, in the room of IEC 61966-2-1
SDR_VIEWING = Viewing(peak_nits=100.0, contrast=1000.0, ambient_lux=64.0)
