# SPDX-License-Identifier: Apache-2.0
"""A least-squares problem on recorded paths, and what the last stage hands on of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ..render.recorded_paths import LaneGroups
from ..render.renderer import Vector
from ..solve.bounded_least_squares import NormalEquations
from .residuals import ImageAndJacobian, Residual, normal_equations


@dataclass(frozen=True)
class Problem:
    """One least-squares problem: what to average, against what."""

    evaluate: ImageAndJacobian
    residual: Residual
    groups: LaneGroups

    @property
    def equations(self) -> Callable[[Vector], NormalEquations]:
        """The normal equations as a function of the vector."""
        return normal_equations(self.evaluate, self.residual)

    @property
    def independent(self) -> float:
        """Number of independent residuals: the channels of a group share most of their noise."""
        return 1.5 * len(self.groups)


@dataclass(frozen=True)
class Refined:
    """A vector, the problem it solves, and the same for some of the groups, evenly spread: for trials."""

    x: Vector
    all: Problem
    few: Problem
