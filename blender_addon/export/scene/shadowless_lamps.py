# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps without shadows that something hides from the target.

Cycles weighs such a lamp's samples against rays that the surface scatters, by the square of their densities, and what
stands before the lamp stops the latter alone. So how much of its light comes hangs on the material, most where that is
shiny; in the fit it is another part.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Vector  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ..findings import Findings
from ..lights.light_model import Light
from ..nodes.clear_objects import bends_light, passes_light
from .scene_data import SceneData

ASKED = 32  # of the points that the camera sees: what hides a lamp from fewer than one in these is not named
OFF_SURFACE = 1e-4  # of the way to the lamp: rays begin that far from their surface, in single precision


def note_hidden_lamps(
    target: bpy.types.Object,
    points: NDArray[np.float64],
    data: SceneData,
    scene: bpy.types.Scene,
    depsgraph: bpy.types.Depsgraph,
    findings: Findings,
) -> None:
    """Name each such lamp with an extent that another object hides from some of `points` (n, 3) of a target."""
    some = points[:: max(len(points) // ASKED, 1)]
    for light in data.lights:
        if light.shadow or not _has_extent(light):
            continue
        for point in some:
            way = light.world[:3, 2] if light.kind == "SUN" else light.position - point
            start, far = data.origin + point + OFF_SURFACE * way, np.inf if light.kind == "SUN" else np.linalg.norm(way)
            hit, place, _, _, item, _ = scene.ray_cast(depsgraph, Vector(start), Vector(way))
            if not hit or item.original == target or item.hide_render or bends_light(item) or passes_light(item):
                continue
            if float(np.linalg.norm(np.array(place) - start)) < far:
                findings.note(
                    f"Light '{light.name}' casts no shadows and is behind '{item.name}': shiny parts of "
                    f"'{target.name}' get another share of it than in Cycles. Turn its shadows on, or move it, and "
                    "render the reference anew."
                )
                break


def _has_extent(light: Light) -> bool:
    return light.kind == "AREA" or light.radius > 0.0 or light.sun_angle > 0.0
