# SPDX-License-Identifier: Apache-2.0
"""Values inside nodes that have many minima: before a fit values all over their range are tried.

The basin of a texture's scale is a few per cent wide, that of the strength of a bump under a sharp coat a tenth of its
range.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from ...material.principled.principled_dict import DIRECTIONS
from ..tolerances import DIM_FLOOR
from .recording import Recording, Setting, Vector
from .where_to_look import all_groups, fewer_groups

# Neighbours are 6 % apart in a range of a factor of 16; the basin of a noise's scale is 4 to 5 % wide to both sides
TRIED_SCALES = 48
# Neighbours are 0.067 apart in a range of 1; that of a sharp coat's bumps is 0.08 wide (docs/notebook/graph_values.md)
TRIED_STRENGTHS = 16
KEPT = 2  # of each, that fits start from

COLOR = "base_color"

Placed = dict[int, float]  # values by entry of the vector
Pictures = Mapping[str, NDArray[np.float32]]  # flat ones of a graph, whose last row is their mean
ImageOf = Callable[[Pictures], NDArray[np.float32]]


def best_scanned(setting: Setting, recording: Recording) -> list[Placed]:
    """Where fits are to start, the best first; one after the other where there are several such values.

    Only the pattern is compared: colours are those of the best mix of pictures, channel by channel.
    """
    graph = setting.scene.graph
    if graph is None or not graph.scanned:
        return [{}]
    first = setting.table.length - graph.table.length
    # a chain thinner than a pixel has none without background
    groups = fewer_groups(all_groups(recording.paths, 1), setting.calm, setting.plan.start_lanes)
    reference = groups.average(setting.calm)
    image = setting.scene.images_of(recording.paths, groups, setting.user)
    dark = None
    if any(_own_name(name) in DIRECTIONS.values() for name in graph.varying):
        dark = setting.scene.images_of(recording.paths, groups, _dark(setting))
    best: list[Placed] = [{}]
    for entry in (first + j for j in graph.scanned):
        lower, upper = setting.table.lower[entry], setting.table.upper[entry]
        values = np.geomspace(lower, upper, TRIED_SCALES) if lower > 0.0 else np.linspace(lower, upper, TRIED_STRENGTHS)
        vectors = [placed(setting.user, {**best[0], entry: float(value)}) for value in values]
        all_pictures = graph.plain([vector[first:] for vector in vectors])
        order = np.argsort([_mix_error(_mixed(pictures, image, dark), reference) for pictures in all_pictures])[:KEPT]
        best = [{**best[0], entry: float(values[k])} for k in order]
        if setting.course.should_stop():
            break
    return best


def _dark(setting: Setting) -> Vector:
    """The user's material without its colour: what the surface mirrors."""
    vector, table = setting.user.copy(), setting.table
    vector[table.mask_of(name for name in table.names if _own_name(name) == COLOR)] = 0.0
    return vector


def _mixed(pictures: Pictures, image: ImageOf, dark: ImageOf | None) -> NDArray[np.float32]:
    """Images (g, 3, n) whose best mix is nearly the picture of a material in any colours.

    A pattern of colours is mixed with none at two levels, one of normals with what it mirrors alone, which is `dark`.
    """
    turned = {name: picture for name, picture in pictures.items() if _own_name(name) in DIRECTIONS.values()}
    colors = {name: picture for name, picture in pictures.items() if name not in turned}
    images = [image(pictures)]
    if colors:
        flat = {name: np.repeat(picture[-1:], len(picture), axis=0) for name, picture in colors.items()}
        half = {name: np.float32(0.5) * picture for name, picture in flat.items()}
        images += [image({**turned, **flat}), image({**turned, **half})]
    if dark is not None:
        black = {name: 0.0 * picture for name, picture in colors.items() if _own_name(name) == COLOR}
        images.append(dark({**pictures, **black}))
    return np.stack(images, axis=-1)


def _own_name(name: str) -> str:
    """A parameter's name without that of the shader in a mix."""
    return name.rpartition(".")[2]


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
