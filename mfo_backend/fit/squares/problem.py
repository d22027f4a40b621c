# SPDX-License-Identifier: Apache-2.0
"""A least-squares problem on recorded paths, and what the last stage hands on of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...render.paths.recorded_image import RecordedImage
from ...render.paths.recorded_paths import LaneGroups
from ...render.pictures.renderer import Vector
from ...solve.bounded_least_squares import NormalEquations
from ...types.parameter import ParameterTable
from ..tolerances import DIM_FLOOR
from .recording_noise import rows_of_samples, unbiased_equations
from .residuals import Residual, Rows, normal_equations


@dataclass(frozen=True)
class Problem:
    """One least-squares problem: what to average, against what.

    Where the recording has two samples of the light, the cost holds its own noise as it is at `near` and nowhere else.
    Where nodes are evaluated `coarser` is what to average by half their samples along a pixel.
    """

    evaluate: RecordedImage
    residual: Residual
    groups: LaneGroups
    near: Vector | None = None
    coarser: RecordedImage | None = None

    @cached_property
    def equations(self) -> Callable[[Vector], NormalEquations]:
        """The normal equations as a function of the vector."""
        if self.near is None:
            return normal_equations(self.evaluate, self.residual)
        return unbiased_equations(self.evaluate.samples, self.residual, self.near)

    def own_noise(self, x: Vector) -> float:
        """Relative noise of the recording in a group at `x`, 0 for a recording with one sample of the light."""
        two = self.evaluate.samples(x)
        return 0.0 if two.half_difference is None else _relative(two.half_difference[:, :, 0], two.mean[:, :, 0])

    def change(self, before: Vector, after: Vector) -> float:
        """Relative change of the groups."""
        old, new = (self.evaluate(x)[:, :, 0] for x in (before, after))
        return _relative(new - old, new)

    def own_share(self, x: Vector) -> float:
        """Part of the mean square residual at `x` that is the recording's own noise, 0 for one sample of the light."""
        rows, half_difference = rows_of_samples(self.evaluate.samples(x), self.residual)
        if half_difference is None:
            return 0.0
        own, all_ = (float(np.mean(np.square(values[:, :, 0]))) for values in (half_difference, rows))
        return min(own / max(all_, 1e-300), 1.0)

    @property
    def independent(self) -> float:
        """Number of independent residuals: the channels of a group share most of their noise."""
        return 1.5 * len(self.groups)


def _relative(difference: Rows, radiance: Rows) -> float:
    """Root mean square of a difference (g, 3), relative to the radiance and a tenth of its mean."""
    level = np.abs(radiance)
    return float(np.sqrt(np.mean(np.square(difference / (level + DIM_FLOOR * level.mean() + 1e-12)))))


@dataclass(frozen=True)
class Rival:
    """Another material that explains the picture about as well, and its share of the probability.

    It is `last` where all that lies on the way to it does so, too; the share is then the mean square of the way.
    """

    x: Vector
    share: float
    last: bool = False


@dataclass(frozen=True)
class Refined:
    """A vector, the problem it solves, and the same for some of the groups, evenly spread: for trials.

    `off` names values that were held at the user's, which are off, because the picture does not ask for them; `rivals`
    are other materials that explain it about as well. `richer` are those of them with more lobes that the recording
    alone prefers by a chi squared that noise does not explain, if from a few tiles: pictures of their own have to say
    whether an eye sees it.
    """

    x: Vector
    all: Problem
    few: Problem
    off: tuple[str, ...] = ()
    rivals: tuple[Rival, ...] = ()
    richer: tuple[Vector, ...] = ()

    def near(self, table: ParameterTable, vector: Vector) -> Refined:
        """The same materials by the values nearest to those of a vector, the rivals' by those nearest to the first."""
        x = table.near(self.x, vector)
        rivals = tuple(replace(rival, x=table.near(rival.x, x)) for rival in self.rivals)
        return replace(self, x=x, rivals=rivals, richer=tuple(table.near(other, x) for other in self.richer))
