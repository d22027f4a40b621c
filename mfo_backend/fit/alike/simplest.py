# SPDX-License-Identifier: Apache-2.0
"""The simplest of several materials between which the picture does not decide.

A highlight may be the base's own or a coat's, a dim broad one that of a rough metal or of another lobe. Such materials
are basins of their own: a quadratic around one knows nothing of the others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ...material.principled.blender_selection import AMOUNT_OF
from ...types.parameter import ParameterTable, Vector
from ..squares.problem import Problem, Refined, Rival
from ..tolerances import DETERMINED_BELOW, HOPELESS, SIGNIFICANT
from .compare import compare
from .unneeded_lobes import Box, box_holding, is_off, is_plain, values_off

BASE, COAT = ("specular_ior_level", "roughness"), ("coat_weight", "coat_roughness")
SAME_F0 = 2.0  # Specular IOR Level 0.5 reflects what a coat of weight 1 and the same index does (Blender 4.0)


Solve = Callable[[Problem, Vector, Box], Vector]  # where a few bounded steps from a start end


class OtherEnds:
    """Solutions in other basins than that of a fit's last problem."""

    def __init__(self, solve: Solve, user: Vector, table: ParameterTable) -> None:
        self._solve, self._user, self._table = solve, user, table

    def simplest(self, found: Refined) -> Refined:
        """What the picture does not tell from `found`: with base and coat exchanged, without lobes that are new."""
        return self._without_lobes(self._exchanged(found))

    def _exchanged(self, found: Refined) -> Refined:
        """With the highlights of base and coat exchanged, where that is better, or as good and nearer to the user's."""
        x, table = found.x, self._table
        if not exchangeable(table) or COAT[0] in found.off or is_off(COAT[0], x, table):
            return found
        box = box_holding(table, self._user, found.off)
        end = self._attempt(found, np.clip(exchanged(x, table), *box), box)
        if end is None or table.apart(end, x) < DETERMINED_BELOW:
            return found
        if is_off(COAT[0], end, table) and COAT[0] in values_off(table, self._user):
            return found  # which is simpler: `_without_lobes` comes there, too
        it = compare(found.all, x, end)
        away, was = (np.linalg.norm((at - self._user) / table.width) for at in (end, x))
        if it.more / it.inflation < -SIGNIFICANT or (away < was and it.more < SIGNIFICANT):
            return replace(found, x=end, rivals=(*found.rivals, Rival(x, 1.0 - it.better)))
        return replace(found, rivals=(*found.rivals, Rival(end, it.better)))

    def _without_lobes(self, found: Refined) -> Refined:
        """Without the lobes that `found` has and the user's material lacks, where no more than chance is against it.

        All of them together, else one after another: a metal may be asked for and its tint not.
        """
        lobes = [n for n in values_off(self._table, self._user) if self._is_new(n, found)]
        simpler = self._without(found, lobes) if lobes else None
        if simpler is not None or len(lobes) < 2:
            return simpler or found
        for name in lobes:
            if self._is_new(name, found):
                found = self._without(found, [name]) or found
        return found

    def _is_new(self, name: str, found: Refined) -> bool:
        """Whether `found` has this lobe; a detail of a lobe that is off is none."""
        x, table = found.x, self._table
        amount = AMOUNT_OF.get(name)
        if amount in table.names and is_off(amount, x, table):
            return False
        return name not in found.off and not is_plain(name, x, table)

    def _without(self, found: Refined, lobes: list[str]) -> Refined | None:
        """`found` without these lobes; None where more than chance is against it.

        Each of them counts three standard deviations against a material: what it would need to come in alone.
        """
        x = found.x
        off, price = (*found.off, *lobes), SIGNIFICANT * len(lobes)
        box = box_holding(self._table, self._user, off)
        starts = [np.clip(start, *box) for start in self._without_coat(x, lobes)]
        end = self._attempt(found, min(starts, key=lambda start: found.few.equations(start).cost), box)
        if end is None:
            return None
        it = compare(found.all, x, end)
        against = it.more / it.inflation - price
        if against > 0.0:
            return None
        share = float(1.0 / (1.0 + np.exp(-0.5 * against)))  # of all materials with these lobes
        others = [Rival(rival.x, share * rival.share) for rival in found.rivals]
        rest = share - sum(rival.share for rival in others)
        richer = (*found.richer, x) if it.more > HOPELESS else found.richer
        return replace(found, x=end, off=off, rivals=(*others, Rival(x, rest)), richer=richer)

    def _without_coat(self, x: Vector, lobes: list[str]) -> Iterator[Vector]:
        yield x
        if COAT[0] in lobes and exchangeable(self._table):
            yield coat_to_base(x, self._table)

    def _attempt(self, found: Refined, start: Vector, box: Box) -> Vector | None:
        """The end of another solve on all tiles, first tried on some of them; None where it is hopeless.

        A few tiles with fireflies do not make it so.
        """
        for problem in (found.all,) if found.few is found.all else (found.few, found.all):
            start = self._solve(problem, start, box)
            if not compare(problem, found.x, start).common <= HOPELESS:
                return None
        return start


def exchanged(x: Vector, table: ParameterTable) -> Vector:
    """The material whose base has the coat's highlight and whose coat has the base's."""
    level, roughness, weight, coat_roughness = (table.value(x, name) for name in (*BASE, *COAT))
    return _with(x, table, weight / SAME_F0, coat_roughness, level * SAME_F0, roughness)


def coat_to_base(x: Vector, table: ParameterTable) -> Vector:
    """The material without a coat whose base has the coat's highlight, as bright as both."""
    level, _, weight, coat_roughness = (table.value(x, name) for name in (*BASE, *COAT))
    return _with(x, table, level + weight / SAME_F0, coat_roughness, 0.0, coat_roughness)


def _with(x: Vector, table: ParameterTable, *values: float) -> Vector:
    """`x` with these values of base and coat, and their highlights without a tint."""
    highlights = dict(zip((*BASE, *COAT), values, strict=True))
    return table.clip(table.with_values(x, **highlights, specular_tint=1.0, coat_tint=1.0))


def exchangeable(table: ParameterTable) -> bool:
    """Whether both highlights are free, so that either may be the other's."""
    return all(name in table.names for name in (*BASE, *COAT))
