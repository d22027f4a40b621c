# SPDX-License-Identifier: Apache-2.0
"""Pictures of some pixels of a scene: those that a question is about, of a frame that may be many times as large."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.own_memory import own_memory
from ..camera.primary_rays import camera_ray, through_filter
from ..lamps.met_lamps import lights_have_no_extent

MOST_PATHS = 1 << 21  # of one launch: 24 bytes each, and less than a second on two processors
# Lamps without extent whose light a sample sums; else one is drawn, and which one is most of the noise. Of a ball on a
# floor under 2, 8, 32 and 64 random lamps the noise at equal time is 0.5, 0.43, 0.06 and 0.06 times that of drawing
# without light over other surfaces, 1.08, 1.02, 0.41 and 0.43 times with it (docs/notebook/speed.md). Larger: not
# measured; a sample of 64 takes four times as long as one of a drawn lamp
MOST_SUMMED = 64
_NEXT_PIECE = 0x85EBCA6B  # not the step between parts of a picture, whose numbers a piece would repeat


@dataclass(frozen=True)
class Piece:
    """Pixels of one launch, by their flat indices, and the seed of their samples."""

    pixels: NDArray[np.int64]
    seed: int


def pieces_of(pixels: NDArray[np.int64], seed: int, spp: int) -> Iterator[Piece]:
    """The pixels in pieces with random numbers of their own; the first has the seed itself."""
    most = max(1, MOST_PATHS // spp)
    for index, first in enumerate(range(0, max(len(pixels), 1), most)):
        yield Piece(pixels[first : first + most], (seed + index * _NEXT_PIECE) % 2**32)


class PixelPictures:
    """Renders pixels by an integrator with Python's `sample` (`prb`, `cycles_path`, `direct_light`).

    Every pixel has samples of its own, distributed as the film's reconstruction filter weighs them (M. Ernst et al.,
    "Filter Importance Sampling", 2006): the expected pixel is the film's, and neighbours share no noise. They are
    stratified in each pixel (correlated multi-jittered sampling, Kensler 2013), and sums run in a fixed order.
    """

    def __init__(self, integrator: Any, scene: mi.Scene, sensor: mi.Sensor) -> None:
        self._integrator, self._scene, self._sensor = integrator, scene, sensor
        self._through = through_filter(sensor.film().rfilter())
        # `cycles_path` alone knows of it
        self._every_lamp = 1 < len(scene.emitters()) <= MOST_SUMMED and lights_have_no_extent(scene)

    def start(self, piece: Piece, spp: int) -> Callable[[], NDArray[np.float32]]:
        """Start to render a piece; returns what waits for it and gives scene-linear (pixels, 3).

        A pixel with a sample that is not finite is black.

        Raises
        ------
        ValueError
            If so many samples fill no grid: 1, 2, 4, 8 and squares do.
        """
        with dr.suspend_grad():
            light = self._light(piece, spp)
            dr.eval(light)
            color = dr.block_sum(light, spp) / float(spp)
            color = dr.select(dr.all(dr.isfinite(color)), color, 0.0)
            dr.eval(color)
        return lambda: np.stack([color[k].numpy() for k in range(3)], axis=-1)

    def _light(self, piece: Piece, spp: int) -> mi.Color3f:
        """What every sample sees, those of a pixel one after the other."""
        paths = len(piece.pixels) * spp
        sampler = mi.load_dict({"type": "multijitter", "sample_count": spp})
        if sampler.sample_count() != spp:
            raise ValueError(f"{spp} even samples a pixel fill no grid: give 1, 2, 4, 8 or a square.")
        sampler.set_samples_per_wavefront(spp)
        # the seed is data, so that the next one needs no compilation
        sampler.seed(dr.opaque(mi.UInt32, piece.seed), paths)
        pixel = dr.gather(mi.UInt32, own_memory(piece.pixels, mi.UInt32), dr.arange(mi.UInt32, paths) // spp)
        offset, sign = self._through(mi.Point2f(sampler.next_2d()))
        on_lens = mi.Point2f(sampler.next_2d()) if self._sensor.needs_aperture_sample() else mi.Point2f(0.5)
        light, *_ = self._integrator.sample(
            mode=dr.ADMode.Primal,
            scene=self._scene,
            sampler=sampler,
            ray=camera_ray(self._sensor, pixel, offset, on_lens),
            depth=mi.UInt32(0),
            δL=None,
            δaovs=None,
            state_in=None,
            active=mi.Bool(True),
            every_lamp=self._every_lamp,
        )
        return mi.Color3f(light) if sign is None else mi.Color3f(light) * sign
