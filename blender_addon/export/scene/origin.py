# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an exported scene has its zero: at Blender's, or at the target where that is far away."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

# Metres. Mitsuba starts rays 9e-5 (1 + d) above a surface, d its distance from zero: a millimetre here. A ball of 1 m
# on a floor was as in Cycles at 35 m, 0.07 % too dark at 117 m, 0.8 % at 1.2 km and 5.3 % at 5.8 km; moved, 0.03 %
FAR = 10.0


def scene_origin(
    camera: bpy.types.Object, targets: Sequence[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> NDArray[np.float64]:
    """A place in whole metres: zero, or the middle of the first target there is, where it and the camera are far."""
    if np.linalg.norm(camera.evaluated_get(depsgraph).matrix_world.translation) <= FAR:
        return np.zeros(3)
    for instance in depsgraph.object_instances:
        if instance.object.original in targets:
            corners = np.array(instance.object.bound_box, dtype=np.float64)
            matrix = np.array(instance.matrix_world, dtype=np.float64)
            middle = matrix[:3, :3] @ corners.mean(axis=0) + matrix[:3, 3]
            is_far = np.isfinite(middle).all() and np.linalg.norm(middle) > FAR
            return np.rint(middle) if is_far else np.zeros(3)
    return np.zeros(3)


def moved(matrix: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """A 4x4 matrix whose place counts from an origin."""
    found = matrix.copy()
    found[:3, 3] -= origin
    return found
