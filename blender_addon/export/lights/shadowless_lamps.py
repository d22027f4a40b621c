# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps without shadows that something hides from the target.

Cycles weighs such a lamp's samples against rays that the surface scatters, by the square of their densities, and what
stands before the lamp stops the latter alone. So how much of its light comes hangs on the material, most where that is
shiny; in the fit it is another part.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Vector  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ..findings import Findings
from ..nodes.clear_objects import bends_light, passes_light
from .light_model import Light

# Of the points that the camera sees. What hides a lamp from fewer than one in these is not named. No measurement
ASKED = 32
# Of the size of what the camera sees: rays begin so far from the surface, as Blender's are single precision. No
# measurement
OFF_SURFACE = 1e-4


def note_hidden_lamps(
    target: bpy.types.Object,
    points: NDArray[np.float64],
    lights: Sequence[Light],
    origin: NDArray[np.float64],
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    findings: Findings,
) -> None:
    """Name each of `lights` that is such a lamp with an extent, and hidden by another object from some of `points`
    (n, 3) of a target. Points and lights are as seen from `origin`."""
    lamps = [light for light in lights if not light.shadow and _has_extent(light)]
    if not lamps or not len(points):
        return
    off = OFF_SURFACE * float(np.linalg.norm(np.ptp(points, axis=0)))
    for light in lamps:
        for point in points[:: max(len(points) // ASKED, 1)]:
            way = light.world[:3, 2] if light.kind == "SUN" else light.position - point
            far = float(np.linalg.norm(way))
            start = origin + point + off / far * way
            hit, place, _, _, item, _ = scene.ray_cast(depsgraph, Vector(start), Vector(way))
            if not hit or item.original == target or item.hide_render or bends_light(item) or passes_light(item):
                continue
            if light.kind == "SUN" or float(np.linalg.norm(np.array(place) - start)) < far:
                findings.note(
                    f"Light '{light.name}' casts no shadows and is behind '{item.name}': shiny parts of "
                    f"'{target.name}' get another share of it than in Cycles. Turn its shadows on, or move it, and "
                    "render the reference anew."
                )
                break


def _has_extent(light: Light) -> bool:
    return light.kind == "AREA" or light.radius > 0.0 or light.sun_angle > 0.0
