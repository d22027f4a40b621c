# SPDX-License-Identifier: Apache-2.0
"""Lanes of single techniques as one recording, ordered by sample, tile and pixel."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.own_memory import own_memory
from ..camera.primary_rays import PrimaryRays
from .recorded_paths import RecordedPaths, ReturnedLight


@dataclass
class TechniqueLanes:
    """One technique's lanes before they are merged; positions of sample s follow s times the pixels.

    `others` is radiance of the held materials of a mix; what shows these alone has no `weight`. `returned` is the part
    of the weight that the target has reflected before, `returned_sums` (2, 3) the sum of that, and times how often.
    """

    wi: mi.Vector3f
    wo: mi.Vector3f
    weight: mi.Color3f | None
    position: mi.UInt32
    held: tuple[Any, ...]
    others: Any = None
    returned: mi.Color3f | None = None
    returned_sums: Any = 0.0


def _radiance_of_held(
    lanes: Sequence[TechniqueLanes], samples: int, rays: PrimaryRays, size: tuple[int, int]
) -> NDArray[np.float32]:
    """Radiance of the held materials in each sample, (samples, height, width, 3)."""
    pixels, (height, width) = len(rays.pixel), size
    found = np.zeros((samples, height * width, 3))
    for part in lanes:
        if part.others is None:
            continue
        sample, position = np.divmod(np.array(part.position, np.int64), pixels)
        place = sample * height * width + rays.pixel[position]
        for channel in range(3):
            sums = np.bincount(place, part.others[channel].numpy(), found.shape[0] * found.shape[1])
            found[..., channel] += sums.reshape(found.shape[:2])
    return found.reshape(samples, height, width, 3).astype(np.float32)


def coverage_of(pixels: int, position: mi.UInt32, share: mi.Float) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """The numbers of the pixels that rays of these positions meet, and each pixel's share of filter weight."""
    total = np.bincount(np.array(position), np.array(share), pixels)
    covered = np.flatnonzero(total > 0.0)
    return covered, total[covered].astype(np.float32)


def merged_lanes(
    lanes: Sequence[TechniqueLanes],
    samples: int,
    named: Sequence[str],
    rays: PrimaryRays,
    covered: NDArray[np.int64],
    coverage: NDArray[np.float32],
    constant: NDArray[np.float32],
) -> RecordedPaths:
    """One lane array of all techniques; `named` are the held values.

    What the held materials of a mix show joins `constant`.
    """
    difference = None
    if any(part.others is not None for part in lanes):
        others = _radiance_of_held(lanes, samples, rays, constant.shape[:2])
        constant = constant + others.mean(axis=0)
        difference = 0.5 * (others[0] - others[1]) if samples == 2 else None
    lanes = [part for part in lanes if part.weight is not None]
    position = np.concatenate([np.array(part.position) for part in lanes] or [np.zeros(0, np.uint32)])
    rank = np.empty(len(position), np.uint32)
    rank[np.argsort(position, kind="stable")] = np.arange(len(position), dtype=np.uint32)
    wi, wo, weight = (dr.zeros(kind, len(position)) for kind in (mi.Vector3f, mi.Vector3f, mi.Color3f))
    held = [dr.zeros(type(value), len(position)) for value in lanes[0].held] if lanes else []
    returned = dr.zeros(mi.Color3f, len(position)) if any(part.returned is not None for part in lanes) else None
    begin, reflected = 0, np.zeros((2, 3))
    for part in lanes:
        end = begin + dr.width(part.position)
        if end > begin:
            target = own_memory(rank[begin:end], mi.UInt32)
            pairs = [(wi, part.wi), (wo, part.wo), (weight, part.weight), *zip(held, part.held, strict=True)]
            if part.returned is not None:
                pairs.append((returned, part.returned))
                reflected += part.returned_sums
            for merged, value in pairs:
                dr.scatter(merged, value, target, mode=dr.ReduceMode.Permute)
        begin = end
    dr.eval(wi, wo, weight, held, returned)
    pixels = len(rays.pixel)
    count = np.bincount(position, minlength=samples * pixels).reshape(samples, pixels)[:, covered]
    first = np.concatenate([np.zeros((samples, 1), int), np.cumsum(count, axis=1)], axis=1)
    first[1:] += np.cumsum(first[:-1, -1])[:, None]
    values = dict(zip(named, held, strict=False))
    pixel, tile = rays.pixel[covered], rays.tile[covered]
    light = None if returned is None else _returned_light(returned, *reflected, weight)
    return RecordedPaths(
        wi, wo, weight, pixel, tile, first, coverage, constant, values,
        constant_difference=difference, returned=light,
    )  # fmt: skip


def _returned_light(
    returned: mi.Color3f, once: NDArray[np.float64], counted: NDArray[np.float64], weight: mi.Color3f
) -> ReturnedLight:
    """Light that the target has reflected before, whose sum and sum times how often are given."""
    order = np.where(once > 0.0, counted / np.maximum(once, 1e-30), 1.0)
    return ReturnedLight(returned, order, once / np.maximum(summed(weight), 1e-30))


def summed(lanes: mi.Color3f) -> NDArray[np.float64]:
    """Sum over lanes, (3,)."""
    return np.array([dr.sum(channel)[0] for channel in lanes], np.float64)
