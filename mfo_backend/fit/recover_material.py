# SPDX-License-Identifier: Apache-2.0
"""A whole fit, for every route alike: check, choose the route, fit, verify, choose the end, judge the result."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from ..metrics.display.tone_mapping import View
from ..render.paths.recorded_scene import RecordedScene
from ..render.pictures.mitsuba_renderer import MitsubaRenderer
from ..render.pictures.renderer import Interrupted, Renderer, Vector
from ..render.sheet.recorded_sheet import RecordedSheet
from ..render.sheet.sheet_renderer import SheetRenderer
from ..types.errors import UnrecordableError
from ..types.event import Listener, Preview, Started
from ..types.image import Image, Pixels
from ..types.result import FitResult
from ..types.status import Status
from .candidates import NOTHING_ELSE, Candidates
from .judge.fit_task import FitTask, check_task
from .judge.mirror_end import smoothest
from .judge.model_gap import with_gap
from .judge.verification import Verification, VerifiedEnd, Verifier
from .paper.fit import PaperRoute
from .pictures.each_picture import TaskJudge
from .plans import RecordedPlan
from .random_streams import Stream
from .recorded.fit import RecordedRoute
from .result.outcome import Candidate, FitOutcome, RouteEnds, final_result
from .settings import FitSettings
from .traced.fit import TracedRoute

# One way to fit, made ready: its constructor, or the fit, raises `UnrecordableError` where another route has to do it
_Route = RecordedRoute | TracedRoute | PaperRoute
_ONE_PICTURE = "Leave out all pictures but one, or choose the preset 'paper'."
_Way = tuple[Callable[[], _Route], str]  # and what is said of a route that stands in for another


def recover_material(
    renderer: Renderer,
    reference: Image,
    settings: FitSettings,
    *,
    display: View | None = None,
    listener: Listener,
    should_stop: Callable[[], bool],
    plan: RecordedPlan | None = None,
    hand_over: bool = True,
    noted: bool = False,
    begin: Vector | None = None,
    judged: bool = True,
    nearer_than: float | None = None,
    candidates: Candidates = NOTHING_ELSE,
    recorded: RecordedScene | RecordedSheet | None = None,
) -> FitOutcome:
    """Recover the renderer's parameters from a picture of the same scene.

    The presets `fast`, `balanced` and `best` fit on recorded light paths. A material that these cannot hold, such as
    glass, is fitted on whole light paths; where those cannot do it either, by the preset `paper`. The last of the
    result's notes says which and why.

    Parameters
    ----------
    display
        View of a display-encoded reference; see `metrics.losses.loss.make_loss`.
    listener
        Hears the events of `types.event`.
    should_stop
        Polled before every iteration and between the stages and pictures after them.
    plan
        How much a recorded fit does, where that is not for the preset to say.
    hand_over
        Whether the preset `paper` may stand in for another one.
    noted
        Whether the export has left something out, which may be why a result does not match.
    begin
        Values of an earlier fit to go on from, where light is sampled or traced, instead of the search for a start.
    judged
        False leaves the verdict to the caller, who has other pictures for it.
    nearer_than
        FLIP beyond noise of a result of another class: stages on whole light paths stop where their first ones do not
        come below it.
    candidates
        The scene's other cameras and lights, from which a further picture could be proposed.
    recorded
        What records the renderer's target, where an earlier fit has made it.

    Raises
    ------
    NoNearerError
        If the first stages did not come `nearer_than` that.
    BadInputError
        If reference and scene do not fit together or the camera does not see the target.
    SetupError
        If one of the settings' losses needs a package that is missing.
    UnrecordableError
        If no route of the preset holds the material, and it may not be handed over.
    """
    task = check_task(renderer, reference, settings, display, listener, should_stop)
    task = replace(task, nearer_than=nearer_than, candidates=candidates, noted=noted)
    reasons: list[str] = []
    for make, says in _ways(task, plan, begin, recorded, hand_over=hand_over):
        try:
            return _fit_along(make(), task, reasons, says, judged=judged)
        except UnrecordableError as error:
            reasons.append(str(error))
    if task.sheet is not None:
        reasons.append(_ONE_PICTURE)
    raise UnrecordableError(" ".join(reasons))


def _ways(
    task: FitTask,
    plan: RecordedPlan | None,
    begin: Vector | None,
    recorded: RecordedScene | RecordedSheet | None,
    *,
    hand_over: bool,
) -> Iterator[_Way]:
    """The routes by their order."""
    renderer, settings = task.renderer, task.settings
    ours = renderer if isinstance(renderer, MitsubaRenderer | SheetRenderer) and settings.preset != "paper" else None
    no_losses = ""
    if ours is not None:
        yield lambda: RecordedRoute(task, ours, plan, begin, recorded), ""
        if ours.graph is not None:  # no other way has the slopes of values inside nodes
            return
        if settings.losses is None:
            yield lambda: TracedRoute(task, ours, begin), "So whole light paths were traced, by the stages {stages}."
        else:
            no_losses = "The stages on whole light paths know no losses of the user's choice. "
    if ours is None or (hand_over and task.sheet is None):  # over several pictures the loop takes too long to stand in
        of_paper = replace(task, settings=replace(settings, preset="paper"))
        said = f"{no_losses}So the preset 'paper' was used instead of {settings.preset!r}."
        yield lambda: PaperRoute(of_paper), said


def _fit_along(route: _Route, task: FitTask, reasons: Sequence[str], says: str, *, judged: bool) -> FitOutcome:
    """Fit, verify the ends by new random numbers, choose the best, and make the result.

    `reasons` say why the routes before this one could not do it, and `says` what it does instead.
    """
    renderer = task.renderer
    start = route.verification.begin(renderer.start)  # rendered while the kernels of the fit are compiled
    seconds = time.monotonic() - task.began
    task.listener(Started(stages=route.stages, parameters=renderer.table.names, seconds=seconds))
    found = route.fit()
    status, pictures = _verified(route.verification, start, found)
    choice = found.choose([picture.image for picture in pictures])
    best = choice.end + 1 if choice.beats_start else 0
    if judged and best and status is not Status.CANCELLED:
        found, pictures = _smoothed(found, pictures, best, renderer, route.verification)
    if pictures is not found.unverified:
        picture: Any = pictures[best]  # of the kind that the route's verification makes
        pictures = [*pictures[:best], route.verification.finished(picture), *pictures[best + 1 :]]
        task.listener(Preview(pictures[best].image))
    first, end = pictures[0], pictures[best]
    task = task.only_counted(end.image)
    judge = TaskJudge(task, first.image, end.image)
    result = final_result(
        renderer,
        found,
        choice,
        status=Status.CANCELLED if task.should_stop() else status,
        errors=judge.errors,
        began=task.began,
        notes=[" ".join([*reasons, says.format(stages=", ".join(map(repr, route.stages)))])] if reasons else [],
    )
    if not judged:
        return FitOutcome(result, first.image, end.image, task.counted)
    return _judged(task, result, first, end, judge)


def _verified(verification: Verifier, start: Callable[[], Any], found: RouteEnds) -> tuple[Status, Sequence[Candidate]]:
    """The pictures of start and ends; those of the fit itself where it was asked to stop before there were others."""
    if found.status is Status.CANCELLED and found.unverified:
        return found.status, found.unverified
    try:
        return found.status, verification.pictures(start, [end.x for end in found.ends])
    except Interrupted:
        return Status.CANCELLED, found.unverified


def _smoothed(
    found: RouteEnds, pictures: Sequence[Candidate], best: int, renderer: Renderer, verification: Verifier
) -> tuple[RouteEnds, Sequence[Candidate]]:
    """Ends and pictures, the chosen one as a mirror where the reference does not speak against that."""
    picture = pictures[best]
    if not (isinstance(picture, VerifiedEnd) and isinstance(verification, Verification)):
        return found, pictures
    try:
        end, picture = smoothest(found.ends[best - 1], picture, renderer.table, verification)
    except Interrupted:
        return found, pictures
    ends = (*found.ends[: best - 1], end, *found.ends[best:])
    return replace(found, ends=ends), [*pictures[:best], picture, *pictures[best + 1 :]]


def _halves(task: FitTask, end: Candidate) -> tuple[Pixels, Pixels] | None:
    """Two pictures of an end whose random numbers have nothing in common; None where there is no time for them.

    The halves of the verification picture will do: it only chose the result among a few ends.
    """
    if isinstance(end, VerifiedEnd):
        return end.halves
    seeds = [Stream.GAP.seed(task.settings.seed, half) for half in (0, 1)]
    spp = max(task.settings.verify_spp // 2, 1)
    if task.should_stop():
        return None
    try:
        with task.renderer.counter.uncounted():  # the result is known without them
            first, second = (task.renderer.image(end.vector, seed=seed, spp=spp) for seed in seeds)
    except Interrupted:
        return None
    return first, second


def _judged(task: FitTask, result: FitResult, first: Candidate, end: Candidate, judge: TaskJudge) -> FitOutcome:
    """The result with what its pictures say of it, from the start where the end is visibly worse.

    All verdicts on a result belong here: reference, result and two pictures of it with independent noise are at hand.
    """
    stopped = result.status is Status.CANCELLED or task.should_stop()
    if not stopped:
        result, shown = judge.judged(result)
        end = first if shown is first.image else end  # the gap below is that of what is shown
        halves = _halves(task, end)
        result = result if halves is None else with_gap(result, task, halves)
    result = replace(result, seconds=time.monotonic() - task.began)  # a verdict takes time as well
    return FitOutcome(result, first.image, end.image, task.counted)
