# SPDX-License-Identifier: Apache-2.0
"""A picture whose sums run in a fixed order, so that the same scene and seed give the same bits with any threads.

Mitsuba's film adds samples to pixels by atomic additions of float32, in the order in which the threads come: its
pictures differ by 1e-7 from run to run. Here every pixel collects the samples in reach of its filter itself.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..camera.sensor_rays import film_samples

MOST_SAMPLES = 1 << 23  # of one part, 20 bytes each; also far below the 2^32 that Mitsuba takes at once
_NEXT_SEED = 0x9E3779B9


@dataclass(frozen=True)
class Part:
    """Some of a picture's samples: their seed, their number for each pixel, their share of all."""

    seed: int
    spp: int
    share: float


def parts_of(pixels: int, seed: int, spp: int) -> Iterator[Part]:
    """The samples of a picture in parts that memory can hold; a picture of one part has the seed itself."""
    most = max(1, MOST_SAMPLES // pixels)
    for index, done in enumerate(range(0, spp, most)):
        count = min(most, spp - done)
        yield Part((seed + index * _NEXT_SEED) % 2**32, count, count / spp)


def opaque(seed: int) -> mi.UInt32:
    """A number whose value is not baked into the kernel, so that the next one needs no compilation."""
    return dr.opaque(mi.UInt32, seed)


def render_part(integrator: Any, scene: mi.Scene, sensor: mi.Sensor, part: Part) -> np.ndarray:
    """Scene-linear (height, width, 3) by an integrator with Python's `sample` (`prb`, `cycles_path`, `direct_light`).

    The estimate is that of Mitsuba's film: samples weighted by the filter, over the sum of the weights. Pixels without
    a sample in reach are 0; values that are not finite stay so.
    """
    with dr.suspend_grad():
        return _render(integrator, scene, sensor, part)


def _render(integrator: Any, scene: mi.Scene, sensor: mi.Sensor, part: Part) -> np.ndarray:
    sampler, spp = integrator.prepare(sensor, opaque(part.seed), part.spp, [])
    ray, position = film_samples(sensor, sampler)
    light, *_ = integrator.sample(
        mode=dr.ADMode.Primal, scene=scene, sampler=sampler, ray=ray, depth=mi.UInt32(0), δL=None, δaovs=None,
        state_in=None, active=mi.Bool(True),
    )  # fmt: skip
    light = mi.Color3f(light)
    del sampler, ray  # nothing else may become an output of the kernel
    dr.eval(light, position)
    film = sensor.film()
    width, height = (int(n) for n in film.crop_size())
    offset = film.crop_offset()
    rfilter = film.rfilter()
    # samples around the picture, which pixels at its edges reach, too
    border = rfilter.border_size() if film.sample_border() else 0
    columns, rows, samples = opaque(width + 2 * border), opaque(height + 2 * border), opaque(spp)
    pixel = dr.arange(mi.UInt32, width * height)
    y = pixel // opaque(width)
    x = pixel - y * opaque(width)
    plain = rfilter.is_box_filter()
    reach = 0 if plain else math.ceil(rfilter.radius() - 0.5)
    centre = mi.Point2f(x, y) + dr.opaque(mi.Point2f, (offset[0] + 0.5, offset[1] + 0.5))
    x, y = x + border, y + border
    left, right = dr.maximum(x, reach) - reach, dr.minimum(x + reach, columns - 1)
    bottom = dr.minimum(y + reach, rows - 1)

    def of_row(row, color, total):
        def of_sample(sample, stop, color, total):
            value = dr.gather(mi.Color3f, light, sample)
            if plain:
                return sample + 1, stop, color + value, total + 1.0
            away = dr.gather(mi.Point2f, position, sample) - centre
            weight = rfilter.eval(away.x) * rfilter.eval(away.y)
            return sample + 1, stop, color + weight * value, total + weight

        first = (row * columns + left) * samples
        stop = (row * columns + right + 1) * samples
        _, _, color, total = dr.while_loop(
            (first, stop, color, total), lambda sample, stop, *_: sample < stop, of_sample, label="samples of a row"
        )
        return row + 1, color, total

    state = (dr.maximum(y, reach) - reach, mi.Color3f(0.0), mi.Float(0.0))
    _, color, total = dr.while_loop(state, lambda row, *_: row <= bottom, of_row, label="rows in reach")
    color = dr.select(total == 0.0, 0.0, color / total)
    return np.stack([color[k].numpy() for k in range(3)], axis=-1).reshape(height, width, 3)
