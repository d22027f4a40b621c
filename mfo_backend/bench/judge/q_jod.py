# SPDX-License-Identifier: Apache-2.0
"""HDR-VDP-3's score for rows that have none: pictures are rendered again, many pairs go to one run of its program."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...metrics.judges.display_light import DisplayLight
from ...metrics.judges.hdr_vdp import hdr_vdp_q_jods
from ...metrics.judges.viewing import HDR_VIEWING
from ...metrics.responses.response import nits_per_unit
from ...types.image import Pixels
from ..rows.row import Row

# Pairs for one run of the program: its start takes 2 to 3 s, a pair of 128 x 128 a seventh of a second (Octave 7.3)
PAIRS_AT_ONCE = 40
Pair = tuple[Pixels, Pixels]


def without_score(rows: Iterable[Row], scenarios: Sequence[str], methods: Sequence[str]) -> list[Row]:
    """Rows with recovered values and no score, those of a scene beside each other; no names mean all."""
    chosen = [
        row
        for row in rows
        if row.q_jod is None
        and row.recovered
        and (not scenarios or row.scenario in scenarios)
        and (not methods or row.method in methods)
    ]
    return sorted(chosen, key=lambda row: (row.scenario, row.scene))


def scored(
    rows: Sequence[Row], pictures_of: Callable[[Row], Pair], should_stop: Callable[[], bool]
) -> Iterator[list[Row]]:
    """The rows with their score, a batch at a time; `pictures_of` renders the true and the recovered picture of a row.

    Raises
    ------
    SetupError
        If HDR-VDP-3 or the program that runs it is missing.
    """
    for first in range(0, len(rows), PAIRS_AT_ONCE):
        batch = []
        pairs = []
        for row in rows[first : first + PAIRS_AT_ONCE]:
            if should_stop():
                return
            pairs.append(_shown(*pictures_of(row)))
            batch.append(row)
        scores = hdr_vdp_q_jods(pairs, HDR_VIEWING.pixels_per_degree)
        yield [replace(row, q_jod=_finite(score)) for row, score in zip(batch, scores, strict=True)]


def _shown(truth: Pixels, recovered: Pixels) -> Pair:
    """Light of both pictures on the display of `judge_images`, in cd/m^2."""
    light = DisplayLight(nits_per_unit(truth), HDR_VIEWING.peak_nits)
    return light.apply(truth), light.apply(recovered)


def _finite(score: float) -> float | None:
    return float(score) if np.isfinite(score) else None
