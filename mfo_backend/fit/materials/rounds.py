# SPDX-License-Identifier: Apache-2.0
"""Several materials of one scene, fitted in turns until the light that they give each other holds still."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...render.paths.recorded_scene import DIRECT, RecordedScene
from ...render.pictures.mitsuba_renderer import MitsubaRenderer
from ...render.pictures.renderer import Interrupted
from ...render.sheet.recorded_sheet import RecordedSheet
from ...render.sheet.sheet_renderer import SheetRenderer
from ...types.errors import BadInputError, MfoError, UnrecordableError, first_line
from ...types.image import Image, Pixels
from ...types.status import Status
from ..judge.checked_reference import check_reference
from ..judge.fit_task import FitTask
from ..plans import RecordedPlan
from ..random_streams import Stream
from ..recorded.fit import recorded_scene
from ..recover_material import recover_material
from ..result.outcome import FitOutcome, result_at
from ..settings import FitSettings
from .evened_light import LOOK_SAMPLES, evened_light
from .whole_course import SHARES, WholeCourse

MOST_VALUES = 120  # free values of all materials together: about six with all that one picture may show
# The first one searches and the second has the preset's plan. In rooms of six materials
# (docs/notebook/several_materials.md) the light held still after the third: the fourth is to spare.
MOST_ROUNDS = 4
# Mean change of a target's pixels, relative to their mean, above which it is fitted again. In a room of six materials
# two of them saw 0.016 and 0.018 after the second round, the other four at most 0.006, which is within the noise of a
# recording; all looked the same in the end. Smaller: rounds that follow noise. Larger: light that is not right.
LIGHT_MOVED = 0.01
NOT_YET = "The fit was stopped before it came to this material."
FAILED = "A fit of this material failed ({what}): what was found before it stays; the log holds the details."


Recorded = RecordedScene | RecordedSheet | None  # None where whole light paths are traced


@dataclass(frozen=True)
class Member:
    """One of the materials: what a user calls it, its renderer and the settings of its fit."""

    name: str
    renderer: MitsubaRenderer | SheetRenderer
    settings: FitSettings


@dataclass(frozen=True)
class Turns:
    """Where the turns have ended: each one's own last fit, not judged yet, its values, and how many rounds it took."""

    outcomes: tuple[FitOutcome, ...]
    present: tuple[NDArray[np.float64], ...]
    rounds: int
    still: bool


def check_members(members: Sequence[Member], reference: Image) -> list[Recorded]:
    """Refuse what cannot be fitted together; what records each of the members.

    Raises
    ------
    BadInputError
        If there are too many values, the preset fits one material alone, or no camera sees one of them.
    """
    counts = {member.name: member.renderer.table.length for member in members}
    total = sum(counts.values())
    if total > MOST_VALUES and not members[0].settings.queue:
        names, over = [], total - MOST_VALUES
        for name, count in sorted(counts.items(), key=lambda pair: -pair[1]):
            if over <= 0:
                break
            names, over = [*names, f"'{name}' ({count})"], over - count
        raise BadInputError(
            f"The {len(counts)} materials have {total} free values, and at most {MOST_VALUES} are fitted together: "
            f"leave out {' and '.join(names)}, or choose fewer parameters, or a queue."
        )
    if members[0].settings.preset == "paper":
        raise BadInputError(
            "The preset 'paper' fits one material alone: choose 'fast', 'balanced' or 'best' for several."
        )
    recorded: list[Recorded] = []
    for member in members:
        renderer = member.renderer
        if not renderer.table.length:
            raise BadInputError(f"Material '{member.name}' has no value that can be fitted: leave it out.")
        try:
            mask = check_reference(reference, renderer.target_mask())
        except BadInputError as error:
            raise BadInputError(f"Material '{member.name}': {error}") from error
        try:
            recorded.append(recorded_scene(renderer, mask, reference.counts))
        except UnrecordableError:
            recorded.append(None)
    return recorded


def take_turns(members: Sequence[Member], tasks: Sequence[FitTask], recorded: Sequence[Recorded]) -> Turns:
    """Fit each material in the light that the others give with their newest values, until that holds still.

    The first round searches from nothing, quickly. The second has the preset's plan and searches again what sees other
    light than at its own first fit: in wrong light a coat or a sheen is easily missed, and no solution nearby has it.
    Those after it fit again what sees other light than at its own last fit, from its values there. A queue ends with
    the first. `recorded` is what `check_members` says. A material whose fit fails without a reason that a user can do
    something about stays as it is from then on, and a note says so.

    Raises
    ------
    UnrecordableError
        If one of the materials cannot be fitted, with its name.
    Interrupted
        If it was asked to stop before one of them had been fitted.
    """
    whole, masks = tasks[0], [task.mask for task in tasks]
    seed, queue, should_stop = whole.settings.seed, whole.settings.queue, whole.should_stop
    present = evened_light([member.renderer for member in members], masks, whole.light, Stream.TOGETHER.seed(seed))
    course = WholeCourse([member.name for member in members], whole.listener, SHARES[:1] if queue else SHARES)
    outcomes: list[FitOutcome | None] = [None for _ in members]
    failed: dict[int, Exception] = {}
    now: Pixels | None = None  # all materials as they are now, and as each was left by its own last fit
    seen: list[Pixels | None] = [None for _ in members]
    order = sorted(range(len(members)), key=lambda k: -int(masks[k].sum()))  # what lights the others most comes first
    number, still = 0, False
    while not (still or number == MOST_ROUNDS or should_stop()):
        number += 1
        still = number > 2 or queue
        for k in order:
            if should_stop():
                still = False
                break
            if k in failed:
                continue
            moved = _moved(now, seen[k], masks[k]) > LIGHT_MOVED
            if number > 2 and not moved:
                continue
            still = queue
            member = members[k]
            _share_needs(recorded, k)
            quick = replace(member.settings, preset="fast", verify_spp=LOOK_SAMPLES, losses=None)
            plan = None if number == 1 else RecordedPlan.of(member.settings.preset).among_others()
            if queue:  # whose first round is the last
                plan = RecordedPlan.of(quick.preset).of_a_small_target()
            try:
                outcome = recover_material(
                    member.renderer, whole.reference, quick if number == 1 else member.settings,
                    display=whole.display, listener=course.of(k, number), should_stop=should_stop, hand_over=False,
                    plan=plan, recorded=recorded[k],
                    begin=None if number < 3 and moved else present[k], judged=False,
                )  # fmt: skip
            except UnrecordableError as error:
                raise UnrecordableError(f"Material '{member.name}' cannot be fitted with others: {error}") from error
            except MfoError:
                raise
            except Exception as error:
                traceback.print_exc(file=sys.stderr)
                failed[k] = error
                continue
            if outcome.result.status is Status.CANCELLED and number > 1:
                break  # the round before has said more
            outcomes[k] = outcome
            present[k] = member.renderer.table.pack(outcome.result.recovered)
            now = seen[k] = None if queue else _look(members, present, seed)
    if not any(outcomes):
        raise next(iter(failed.values()), Interrupted())
    ended = [outcome or _as_it_was(member) for outcome, member in zip(outcomes, members, strict=True)]
    for k, error in failed.items():
        ended[k] = _without_certainty(outcomes[k] or _as_it_was(members[k], Status.DIFFERENT), error)
    values = [x if outcome else m.renderer.start for x, outcome, m in zip(present, outcomes, members, strict=True)]
    return Turns(tuple(ended), tuple(values), number, still)


def _share_needs(recorded: Sequence[Recorded], at: int) -> None:
    """Record light over other surfaces for all where the one `at` this place needs it: that is asked with many rays."""
    one = recorded[at]
    if one is None or one.needs.depth <= DIRECT:
        return
    for other in recorded:
        if other is not None:
            other.needs = one.needs


def _as_it_was(member: Member, status: Status = Status.CANCELLED) -> FitOutcome:
    """The outcome of a material of which no fit has ended: its turn did not come, or it failed."""
    renderer, mask = member.renderer, member.renderer.target_mask()
    result = result_at(renderer, renderer.start, status, status.sentence, 0.0)
    nothing = np.zeros((*mask.shape, 3), np.float32)
    notes = (NOT_YET,) if status is Status.CANCELLED else ()
    return FitOutcome(replace(result, notes=notes), nothing, nothing, mask)


def _without_certainty(before: FitOutcome, error: Exception) -> FitOutcome:
    """The outcome before a fit that failed, with a note; no value is sure in it."""
    notes = (*before.result.notes, FAILED.format(what=f"{type(error).__name__}: {first_line(error)}"))
    return replace(before, result=replace(before.result, notes=notes, certainty={}, weak_combinations=()))


def show_all(members: Sequence[Member], vectors: Sequence[NDArray[np.float64]]) -> None:
    """Give every material these values."""
    for member, vector in zip(members, vectors, strict=True):
        member.renderer.show(vector)


def _look(members: Sequence[Member], present: Sequence[NDArray[np.float64]], seed: int) -> Pixels:
    """A picture of all materials as they are now; all of them have the same random numbers."""
    show_all(members, present)
    return members[0].renderer.image(present[0], seed=Stream.TOGETHER.seed(seed), spp=LOOK_SAMPLES)


def _moved(now: Pixels | None, before: Pixels | None, mask: NDArray[np.bool_]) -> float:
    """Mean change of a target's pixels, relative to their mean; any where it was not seen before."""
    if now is None or before is None:
        return np.inf
    level = float(now[mask].mean(dtype=np.float64))
    return float(np.abs(now[mask] - before[mask]).mean(dtype=np.float64)) / max(level, 1e-30)
