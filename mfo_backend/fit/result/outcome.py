# SPDX-License-Identifier: Apache-2.0
"""What a route hands over, and the result of a fit that is made of it, for every route alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...render.pictures.renderer import Renderer
from ...types.certainty import Certainty, WeakCombination
from ...types.image import Pixels
from ...types.parameter import ParameterTable, Vector
from ...types.result import Contradiction, FitResult, NextPicture, StageReport
from ...types.status import Status

START_KEPT = "Nothing was better than the start, so the start was kept."
SQUARES_KEPT = "No perceptual stage was better in a picture of its own, so the end of {stage!r} was kept."


@dataclass(frozen=True)
class Candidate:
    """Values, as a vector of the renderer's table, and their picture, scene-linear."""

    vector: NDArray[np.float64]
    image: Pixels = field(repr=False)


@dataclass(frozen=True)
class End:
    """Where a stage ended, and what the fit knows of the values there.

    `notes` are sentences that hold if these values become the result.
    """

    stage: str
    x: NDArray[np.float64]
    certainty: Mapping[str, Certainty] = field(default_factory=dict)
    weak_combinations: tuple[WeakCombination, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Choice:
    """The best of a route's ends, counted from 0, and whether it is better than the scene's own material."""

    end: int
    beats_start: bool

    @staticmethod
    def of(errors: Sequence[float]) -> Choice:
        """The smallest error, the first of which is the start's; one that is not finite never wins."""
        start, *others = (error if np.isfinite(error) else np.inf for error in errors)
        end = int(np.argmin(others))
        return Choice(end, others[end] < start)


@dataclass(frozen=True)
class RouteEnds:
    """All that a route has found.

    Attributes
    ----------
    ends
        In the order of the stages, without the start.
    by_squares
        How many of the ends, the first ones, are those of least squares; the others are perceptual stages'.
    choose
        Judges the pictures of the start and of all ends, scene-linear (height, width, 3), in this order.
    stages, notes
        The stages' reports, and sentences on what was left out or kept.
    status
        How the last stage ended.
    unverified
        Start and ends with the fit's own pictures, which have to do where there was no time for others.
    contradiction, next_picture
        Of several pictures, which do not agree, and which further one would tell more.
    """

    ends: tuple[End, ...]
    by_squares: int
    choose: Callable[[Sequence[Pixels]], Choice]
    stages: tuple[StageReport, ...]
    notes: tuple[str, ...] = ()
    status: Status = Status.CONVERGED
    unverified: tuple[Candidate, ...] = ()
    contradiction: Contradiction | None = None
    next_picture: NextPicture | None = None

    def chosen_notes(self, choice: Choice) -> tuple[str, ...]:
        """The sentences on a choice among the ends."""
        if not choice.beats_start:
            return ()
        end = self.ends[choice.end]
        kept = choice.end == 0 and len(self.ends) > self.by_squares
        return (*((SQUARES_KEPT.format(stage=end.stage),) if kept else ()), *end.notes)


@dataclass(frozen=True)
class FitOutcome:
    """The result of a fit with the pictures of its start and its end, scene-linear and under one seed.

    The fit looked at the pixels that are `counted`, True (height, width); others may have fewer samples.
    """

    result: FitResult
    start_image: Pixels = field(repr=False)
    result_image: Pixels = field(repr=False)
    counted: NDArray[np.bool_] = field(repr=False)


def listed(words: Sequence[str]) -> str:
    """What a sentence makes of words: "a", "a and b", "a, b and c"."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def kept_note(names: Iterable[str], table: ParameterTable) -> str:
    """The sentence on values that went back to the user's."""
    shown = ", ".join(table[name].label or name for name in names)
    return f"The picture does not determine {shown}: kept as in the scene."


def result_at(renderer: Renderer, vector: Vector, status: Status, message: str, seconds: float) -> FitResult:
    """The result with these values, of which nothing else is known."""
    table = renderer.table
    lower = np.minimum(table.lower, vector)  # a mirror is below the least roughness of a lobe
    return FitResult(
        status=status,
        message=message,
        model=renderer.model,
        initial=table.unpack(renderer.start),
        recovered=table.unpack(vector),
        bounds={p.name: (float(lower[table.slice_of(p.name)].min()), p.upper) for p in table},
        stages=(),
        errors={},
        seconds=seconds,
        passes=renderer.passes,
    )


def final_result(
    renderer: Renderer,
    found: RouteEnds,
    choice: Choice,
    *,
    status: Status,
    errors: Mapping[str, tuple[float, float]],
    began: float,
    notes: Sequence[str] = (),
) -> FitResult:
    """What a fit has found.

    Parameters
    ----------
    choice
        The end that is the result; where it does not beat the start, the start is, and the message says so, unless the
        fit was cancelled. How sure the values are is what the fit knows of the end that came nearest.
    began
        The fit's begin on the monotonic clock.
    notes
        Sentences after those of the route.
    """
    message = status.sentence
    if not choice.beats_start and status is not Status.CANCELLED:
        message += f" {START_KEPT}"
    if found.contradiction is not None:
        message += f" {found.contradiction.sentence}"
    end = found.ends[choice.end]
    vector = end.x if choice.beats_start else renderer.start
    return replace(
        result_at(renderer, vector, status, message, time.monotonic() - began),
        stages=found.stages,
        errors=dict(errors),
        certainty=dict(end.certainty),
        notes=(*found.notes, *found.chosen_notes(choice), *notes),
        weak_combinations=end.weak_combinations,
        contradiction=found.contradiction,
        next_picture=found.next_picture,
    )
