# SPDX-License-Identifier: Apache-2.0
"""Scales of textures before a fit: their basins are a few per cent wide, so values all over their range are tried."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..tolerances import DIM_FLOOR
from .recording import Recording, Setting, Vector
from .where_to_look import fewer_groups

# Neighbours are 6 % apart in a range of a factor of 16; the basin of a noise's scale is 4 to 5 % wide to both sides
TRIED = 48
KEPT = 2  # of a scale, that fits start from

Placed = dict[int, float]  # values by entry of the vector


def best_scales(setting: Setting, recording: Recording) -> list[Placed]:
    """Where fits are to start, the best first; one after the other where there are several scales.

    The picture of a material with a pattern is nearly a mix of three: with the pattern as it is, and without it at two
    levels. Colours are found by such a mix, channel by channel, so what is compared is the pattern alone.
    """
    graph = setting.scene.graph
    if graph is None or not graph.scanned:
        return [{}]
    first = setting.table.length - graph.table.length
    groups = recording.paths.pixel_groups(recording.paths.interior)
    groups = fewer_groups(groups, setting.calm, setting.plan.start_lanes)
    reference = groups.average(setting.calm)
    best: list[Placed] = [{}]
    for entry in (first + j for j in graph.scanned):
        lower, upper = setting.table.lower[entry], setting.table.upper[entry]
        values = np.geomspace(lower, upper, TRIED) if lower > 0.0 else np.linspace(lower, upper, TRIED)
        vectors = [placed(setting.user, {**best[0], entry: float(value)}) for value in values]
        image = setting.scene.images_of(recording.paths, groups, setting.user)
        costs = []
        for pictures in graph.plain([vector[first:] for vector in vectors]):
            flat = {name: np.repeat(picture[-1:], len(picture), axis=0) for name, picture in pictures.items()}
            half = {name: np.float32(0.5) * picture for name, picture in flat.items()}
            mixed = [image(some) for some in (pictures, flat, half)]
            costs.append(_mix_error(np.stack(mixed, axis=-1), reference))
        order = np.argsort(costs)[:KEPT]
        best = [{**best[0], entry: float(values[k])} for k in order]
        if setting.course.should_stop():
            break
    return best


def placed(x: Vector, values: Placed) -> Vector:
    """The vector with these values."""
    moved = x.copy()
    for entry, value in values.items():
        moved[entry] = value
    return moved


def _mix_error(images: NDArray[np.float32], reference: NDArray[np.float32]) -> float:
    """Squares of what the best mix of images (g, 3, n) leaves of a reference (g, 3), relative to its radiance."""
    left = 0.0
    weight = 1.0 / (np.maximum(reference, 0.0) + DIM_FLOOR * max(float(reference.mean()), 1e-12))
    for channel in range(3):
        matrix = images[:, channel].astype(np.float64) * weight[:, channel, None]
        wanted = reference[:, channel].astype(np.float64) * weight[:, channel]
        mix = np.linalg.lstsq(matrix, wanted, rcond=1e-6)[0]
        left += float(np.sum(np.square(matrix @ mix - wanted)))
    return left
