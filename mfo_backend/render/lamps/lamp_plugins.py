# SPDX-License-Identifier: Apache-2.0
"""The names of our emitters in scene files. Choose the variant before importing this."""

from __future__ import annotations

import mitsuba as mi

from .area_lamp import AreaLamp
from .glow import Glow
from .point_lamp import PointLamp, SharpSpot, SpotLamp
from .sun_lamp import SunLamp

PLUGINS = {
    "blender_point": PointLamp,
    "blender_spot": SpotLamp,
    "blender_sharp_spot": SharpSpot,
    "blender_area": AreaLamp,
    "blender_sun": SunLamp,
    "blender_glow": Glow,
}


def register() -> None:
    """Make them known to Mitsuba in the current variant."""
    for name, plugin in PLUGINS.items():
        mi.register_emitter(name, plugin)
