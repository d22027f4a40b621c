# SPDX-License-Identifier: GPL-3.0-or-later
"""Where an exported scene has its zero: at Blender's, or at the target where that is far away.

And what is said of light below surfaces that are far from zero, or smaller than its way.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ..findings import Findings
from ..fitted_slot import FittedSlot
from ..material_model import Material
from .scene_data import SceneData, Shape, target_shape

# Metres. Mitsuba starts rays 9e-5 (1 + d) above a surface, d its distance from zero: a millimetre here. A ball of 1 m
# on a floor was as in Cycles at 35 m, 0.07 % too dark at 117 m, 0.8 % at 1.2 km and 5.3 % at 5.8 km; moved, 0.03 %.
# Of a smaller target it is so many times its size: one of 1 mm was 0.2 % too dark at 0.7 m
FAR_AWAY = 10.0
# Of a target's size: a ball of 2 m with subsurface loses 0.2 % of the picture's light in Cycles at 1 km, 0.7 % at 3 km
# and 2.5 % at 10 km
MOST_APART = 500.0
# Of the size of a shape: where light walks so far on the average a lobe that stands for it behind a bounce is too dark,
# a box by 0.3 % of the picture at 1 and by 1.4 % at 10. Of a target, where walks are real, a ball is right at 1.5,
# 1.8 % too dark at 5 and 9.6 % at 50
WIDE, WIDE_ON_TARGET = 0.5, 2.0
SMALLEST = 1e-6  # metres: a target of less has no size


def scene_origin(
    camera: bpy.types.Object, targets: Sequence[bpy.types.Object], depsgraph: bpy.types.Depsgraph
) -> NDArray[np.float64]:
    """Zero, or about the middle of the first target there is, where it and the camera are far.

    Its coordinates are multiples of a power of two, a metre or less, so that floats differ from it without rounding.
    """
    eye = np.linalg.norm(camera.evaluated_get(depsgraph).matrix_world.translation)
    for instance in depsgraph.object_instances:
        if instance.object.original in targets:
            corners = np.array(instance.object.bound_box, dtype=np.float64)
            matrix = np.array(instance.matrix_world, dtype=np.float64)
            corners = corners @ matrix[:3, :3].T + matrix[:3, 3]
            middle, size = corners.mean(axis=0), float(np.ptp(corners, axis=0).max())
            if not (np.isfinite(middle).all() and size > SMALLEST):
                return np.zeros(3)
            step = min(1.0, 2.0 ** np.floor(np.log2(size)))
            is_far = min(eye, float(np.linalg.norm(middle))) > FAR_AWAY * min(1.0, size)
            return step * np.rint(middle / step) if is_far else np.zeros(3)
    return np.zeros(3)


def moved(matrix: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """A 4x4 matrix whose place counts from an origin."""
    found = matrix.copy()
    found[:3, 3] -= origin
    return found


def note_wide_scattering(data: SceneData, findings: Findings) -> None:
    """Report materials with subsurface on shapes that are not large beside the way of light there."""
    targets = {target_shape(number) for number in range(data.target_count)}
    for shape in data.shapes:
        size = float(np.ptp(shape.mesh.positions, axis=0).max()) if len(shape.mesh.positions) else 0.0
        most = size * (WIDE_ON_TARGET if shape.identifier in targets else WIDE)
        for leaf in _scattering(data, data.materials[shape.bsdf]):
            radius, scale = np.asarray(leaf.value("Subsurface Radius", 0.0), float), leaf.value("Subsurface Scale", 1.0)
            if float(np.max(radius * scale)) > most > 0.0:
                findings.note(
                    f"Light walks below the surface of material '{leaf.name}' half as far as its object is large, or "
                    "further (Subsurface Scale times Radius): how bright that is differs from Cycles."
                )


def _scattering(data: SceneData, material: Material) -> list[Material]:
    parts = (data.materials[part.bsdf] for part in material.parts)
    return [*material.scattering, *(leaf for part in parts for leaf in _scattering(data, part))]


def note_far_scattering(data: SceneData, fitted: Sequence[tuple[FittedSlot, Shape]], findings: Findings) -> None:
    """Report `fitted` objects with subsurface that are far from zero: places there are coarse in Cycles."""
    apart = float(np.linalg.norm(data.origin))
    for each, shape in fitted:
        size = float(np.ptp(shape.mesh.positions, axis=0).max())
        if data.materials[shape.bsdf].scattering and apart > MOST_APART * size:
            findings.note(
                f"Object '{each.object.name}' is {apart:.3g} m from the world's zero, where Cycles loses light "
                "below surfaces and the fit does not: move the scene to the zero."
            )
