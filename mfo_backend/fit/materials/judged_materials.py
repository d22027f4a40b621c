# SPDX-License-Identifier: Apache-2.0
"""One verdict for each of several materials, on pictures that show all of them as they ended."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...metrics.display.tone_mapping import View
from ...types.event import Listener
from ...types.image import Image, Pixels
from ...types.result import FitResult
from ...types.status import Status
from ..judge.fit_task import FitTask, check_task
from ..judge.model_gap import with_gap
from ..judge.verification import MOST_WHOLE, SHOWN_SAMPLES
from ..pictures.each_picture import TaskJudge
from ..random_streams import Stream
from ..result.outcome import FitOutcome
from .evened_light import LOOK_SAMPLES
from .rounds import MOST_ROUNDS, Member, Turns, check_members, show_all, take_turns

# Times `verify_spp`: samples of that picture at most. Noise of its own hides what few pixels show: with 64 samples a
# pixel in rooms of six, errors of 0.016 to 0.053 looked the same (docs/notebook/several_materials.md).
MORE_SAMPLES = 4
NOT_STILL = (
    "The light between the materials still moved after {rounds} rounds: fit again from the applied values, or fit "
    "fewer at once."
)
ONCE = (
    "Each material of the queue was fitted once, beside the others' base colours: fit together what does not match or "
    "gives much light to others."
)
OTHERS_HELD = "How sure a value is holds with the other materials as they were found."


@dataclass(frozen=True)
class Together:
    """What became of each material, in their order, and after how many rounds."""

    outcomes: tuple[FitOutcome, ...]
    rounds: int


def fit_together(
    members: Sequence[Member],
    reference: Image,
    *,
    display: View | None,
    listener: Listener,
    should_stop: Callable[[], bool],
    noted: bool = False,
    begin: Callable[[], object] = lambda: None,
) -> Together:
    """Recover several materials from a picture, or a sheet of several, that each scene is loaded for once.

    `noted` and `display` are as of `recover_material`.

    Each result has a verdict on its own pixels of a picture with all materials as found, beside one with all as they
    were. A material that looks worse there than before goes back to what it was. `begin` is called when nothing speaks
    against the fit any more.

    Raises
    ------
    BadInputError
        If they cannot be fitted together, or a picture does not show one of them.
    UnrecordableError
        If one of the materials cannot be fitted.
    Interrupted
        If it was asked to stop before one of them had been fitted.
    """
    recorded = check_members(members, reference)
    tasks = [check_task(m.renderer, reference, m.settings, display, listener, should_stop) for m in members]
    tasks = [replace(task, noted=noted) for task in tasks]
    begin()
    turns = take_turns(members, tasks, recorded)
    starts = [member.renderer.start for member in members]
    # it only says from where the errors came
    start = np.mean(_halves(members, starts, LOOK_SAMPLES), axis=0, dtype=np.float32)
    judged, halves = _judged_all(members, tasks, turns, start, turns.present)
    back = [_is_back(result, before.result) for result, before in zip(judged, turns.outcomes, strict=True)]
    if any(back) and not all(back):  # the others are judged beside what they stand beside now
        kept = [s if gone else x for s, x, gone in zip(starts, turns.present, back, strict=True)]
        again, halves = _judged_all(members, tasks, turns, start, kept)
        judged = [first if gone else new for first, new, gone in zip(judged, again, back, strict=True)]
    end = np.mean(halves, axis=0, dtype=np.float32)
    stopped = should_stop()
    said = () if turns.still or stopped else (NOT_STILL.format(rounds=MOST_ROUNDS),)
    if members[0].settings.queue:
        said = (*said, ONCE)
    outcomes = []
    for result, task in zip(judged, tasks, strict=True):
        result = replace(result, notes=(*result.notes, OTHERS_HELD, *said))
        if stopped:
            result = replace(result, status=Status.CANCELLED, message=Status.CANCELLED.sentence)
        else:
            result = with_gap(result, task.only_counted(end), halves)
        outcomes.append(FitOutcome(result, start, end, task.counted))
    return Together(tuple(outcomes), turns.rounds)


def _judged_all(
    members: Sequence[Member],
    tasks: Sequence[FitTask],
    turns: Turns,
    start: Pixels,
    vectors: Sequence[np.ndarray],
) -> tuple[list[FitResult], tuple[Pixels, Pixels]]:
    """The results by a picture of all these vectors, and its halves."""
    stopped = tasks[0].should_stop()
    halves = _halves(members, vectors, SHOWN_SAMPLES if stopped else MORE_SAMPLES * members[0].settings.verify_spp)
    end = np.mean(halves, axis=0, dtype=np.float32)
    fitted = np.any([task.mask for task in tasks], axis=0)
    judged = []
    for task, outcome in zip(tasks, turns.outcomes, strict=True):
        judge = TaskJudge(task.only_counted(end), start, end)
        judged.append(judge.judged(replace(outcome.result, errors=judge.errors), fitted)[0])
    return judged, halves


def _halves(members: Sequence[Member], vectors: Sequence[np.ndarray], most: int) -> tuple[Pixels, Pixels]:
    """Two pictures of all materials with these values, without common random numbers."""
    show_all(members, vectors)
    renderer, settings = members[0].renderer, members[0].settings
    pixels = renderer.target_mask().size
    samples = max(min(most, MOST_WHOLE // pixels), SHOWN_SAMPLES) // 2
    seeds = [Stream.GAP.seed(settings.seed, half) for half in (0, 1)]
    first, second = (renderer.image(vectors[0], seed=seed, spp=samples) for seed in seeds)
    return first, second


def _is_back(judged: FitResult, before: FitResult) -> bool:
    """Whether a verdict has put the user's values back."""
    return judged.recovered != before.recovered and judged.recovered == judged.initial
