# SPDX-License-Identifier: Apache-2.0
"""The end of a fit as a mirror: recorded and differentiated lobes have a least roughness, chrome and clear glass none.

A mirror has no density, so no lane and no derivative knows of one; a picture does. Where a fit ends near the least
roughness, a picture of the same values without any decides. It is the plainer material, so it stays unless it is worse.
"""

from __future__ import annotations

from dataclasses import replace

from ...material.principled.principled_parameters import BLENDER_PRINCIPLED
from ...types.certainty import Level
from ...types.parameter import ParameterTable
from ..result.outcome import End
from ..tolerances import CHANCE, NEARLY_A_MIRROR
from .verification import Verification, VerifiedEnd

ROUGHNESS = "roughness"


def as_mirror(end: End, table: ParameterTable) -> End | None:
    """The same end without roughness; None where that is not small, was kept, or is limited by the user.

    Both look alike where this one is taken, so that the other's roughness is its standard deviation at least.
    """
    if ROUGHNESS not in table.names or table[ROUGHNESS].lower != BLENDER_PRINCIPLED[ROUGHNESS].lower:
        return None
    at, known = float(end.x[table.slice_of(ROUGHNESS)][0]), end.certainty.get(ROUGHNESS)
    if at > NEARLY_A_MIRROR or known is None or known.level is Level.NOT_VISIBLE:
        return None
    level = Level.WEAK if known.level is Level.DETERMINED else known.level
    less_sure = replace(known, sd=(max(at, *known.sd),), level=level)
    return replace(
        end,
        x=table.with_values(end.x, **{ROUGHNESS: 0.0}),
        certainty={**end.certainty, ROUGHNESS: less_sure},
    )


def smoothest(
    end: End, picture: VerifiedEnd, table: ParameterTable, verification: Verification
) -> tuple[End, VerifiedEnd]:
    """An end and its picture, as a mirror where the reference does not speak against it."""
    mirror = as_mirror(end, table)
    if mirror is None:
        return end, picture
    seen = verification.like(picture, mirror.x)
    more, error = verification.farther(picture, seen)
    return (mirror, seen) if more <= CHANCE * error else (end, picture)
