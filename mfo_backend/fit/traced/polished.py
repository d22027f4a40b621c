# SPDX-License-Identifier: Apache-2.0
"""The end of a polish on traced paths, and which of its values go back to the user's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...material.principled.blender_selection import AMOUNT_OF
from ...solve.bounded_least_squares import NormalEquations
from ...solve.noisy_least_squares import SafeMatrix
from ...types.parameter import ParameterTable, Vector
from ..alike.unneeded_lobes import dispensable, values_off
from ..tolerances import SIGNIFICANT, WEAK_BELOW

CORE = ("base_color", "transmission_weight", "roughness", "ior", "absorption_density", "absorption_color")
AMOUNTS = ("metallic", "coat_weight", "sheen_weight")


@dataclass(frozen=True)
class Polished:
    """The end of a polish.

    Attributes
    ----------
    x, covariance
        Its point and the covariance of its values.
    kept, unseen
        Which values stayed as in the scene, and which of these the picture does not determine.
    equations, noise
        The last equations and the covariance of their gradient; None if there was no time for any.
    """

    x: Vector
    covariance: Vector
    kept: NDArray[np.bool_]
    unseen: NDArray[np.bool_]
    equations: NormalEquations | None
    noise: Vector

    def undetermined(self, table: ParameterTable, user: Vector) -> NDArray[np.bool_]:
        """Further values that are not determined: the least sure one is taken for known until the rest is sure.

        Values of the glass itself are none as long as others go back, and none is whose return to the user's the
        picture tells from noise: a lobe may be surely there, and nobody knows how much of it.
        """
        held = self.kept.copy()
        if self.equations is None:
            return np.zeros_like(held)
        e, width = self.equations, table.width
        names = [name for name in table.names if not held[table.slice_of(name)].all()]
        while names:
            free = ~held
            part = NormalEquations(e.cost, e.gradient[free], e.hessian[np.ix_(free, free)])
            spread = np.zeros(table.length)
            sandwich = SafeMatrix(part, width[free]).covariance(self.noise[np.ix_(free, free)])
            spread[free] = np.sqrt(np.maximum(np.diag(sandwich), 0.0)) / width[free]
            widest = {name: float(spread[table.slice_of(name)].max()) for name in names}
            unsure = [name for name in names if widest[name] >= WEAK_BELOW]
            if not unsure:
                break
            # with the details known how much there is of a lobe is often seen well, and so is the glass itself
            worst = min(unsure, key=lambda name: (name in CORE, name in AMOUNTS, -widest[name]))
            if worst in CORE and np.any(held & ~self.kept):
                break  # it may be sure once the others are as in the scene
            names.remove(worst)
            more = held | table.mask_of([worst])
            if self._distance(more, user) <= self._distance(held, user) + SIGNIFICANT:
                held = more
        return held & ~self.kept

    def unneeded(
        self, table: ParameterTable, user: Vector, unseen: NDArray[np.bool_], surer_than: float = np.inf
    ) -> NDArray[np.bool_]:
        """Further values that are off in the user's material and not further from that than three standard deviations.

        Those of `unseen` go back anyway: with a coat's details known, more is known of how much there is of it. Only
        values whose own deviation is below `surer_than`, in parts of the range, are asked for. The distance of several
        together is theirs by the covariance (A. Wald 1943), and each may add as much as it could alone.
        """
        sure = np.diag(self.covariance) < (surer_than * table.width) ** 2
        free = ~self.kept & ~unseen & ~table.mask_of(CORE) & sure
        names = [name for name in values_off(table, user) if free[table.slice_of(name)].all()]

        def distance(held: list[str]) -> float:
            return self._distance(unseen | table.mask_of(held), user)

        return table.mask_of(dispensable(names, distance, SIGNIFICANT))

    def _distance(self, held: NDArray[np.bool_], user: Vector) -> float:
        """The squared distance of the user's values of those `held` that were free, by the covariance."""
        away = held & ~self.kept
        step = (self.x - user)[away]
        return float(step @ np.linalg.lstsq(self.covariance[np.ix_(away, away)], step, rcond=None)[0])


def without_lobe(kept: NDArray[np.bool_], table: ParameterTable, user: Vector) -> NDArray[np.bool_]:
    """Details of lobes whose `kept` amount is off in the user's material: they are without effect."""
    off = [name for name in values_off(table, user) if kept[table.slice_of(name)].all()]
    return table.mask_of([name for name in table.names if AMOUNT_OF.get(name) in off]) & ~kept
