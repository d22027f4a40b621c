# SPDX-License-Identifier: Apache-2.0
"""The presets `fast`, `balanced` and `best`: a global start and bounded least squares on recorded light paths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...metrics.baked_view import BakedView
from ...metrics.tone_mapping import DisplayView
from ...render.mitsuba_renderer import MitsubaRenderer
from ...types.image import Pixels
from ..alike.unneeded_lobes import box_holding
from ..certainty.weak_combinations import weak_combinations
from ..judge.fit_task import FitTask
from ..judge.picture_judge import NOISY, PictureJudge
from ..judge.verification import FIRST_SAMPLES, FIRST_SAMPLES_EXACT, Verification
from ..plans import RecordedPlan
from ..result.course import Course
from ..result.outcome import Choice, End, RouteEnds
from ..squares.problem import Problem
from ..squares.residuals import (
    CensoredResidual,
    DisplayedResidual,
    MakeResidual,
    MakeWeighted,
    RelativeResidual,
    WeightedResidual,
    log_residual,
)
from ..squares.stage_residuals import finishing_residuals
from .keep_user_values import keep_values
from .perceptual_stages import perceptual_ends
from .stages import RecordedFit

STAGES = ("scan", "start", "refine")
# Root mean square residual, in standard deviations of the noise, from which on there is more than noise to explain
AT_NOISE = 1.5


class RecordedRoute:
    """A fit with no use of the material's start but as one guess; `plan` is that of the preset, unless it is given.

    The result is the best of the scene's own values and the end of every finishing stage, judged on path-traced
    pictures: by the least-squares residual of tiles for `fast` and where the picture's noise is reached, by the last of
    the losses where the settings name them, else by FLIP (`fit.judge.picture_judge`).

    Raises
    ------
    UnrecordableError
        For materials that recorded paths cannot hold: textures, transmission.
    BadInputError
        If one of the settings' losses is not defined for the reference.
    """

    def __init__(self, task: FitTask, renderer: MitsubaRenderer, plan: RecordedPlan | None) -> None:
        from ...render.recorded_scene import RecordedScene

        settings = task.settings
        self._task, self._renderer = task, renderer
        self._plan = plan or RecordedPlan.of(settings.preset)
        named = None if settings.losses is None else settings.stage_names(task.reference.encoding)
        self._measure = named[-1] if named else task.measure
        self._finishing = finishing_residuals(settings, task.reference.encoding, task.light, task.mask, task.view)
        self._scene = RecordedScene(renderer, int(task.mask.sum()))
        self.stages = (*STAGES, *self._finishing, *(["flip"] if settings.preset == "best" else []))
        self.verification = Verification(
            renderer,
            task.reference,
            task.counted,
            task.view,
            seed=settings.seed,
            first=FIRST_SAMPLES_EXACT if self._scene.lights_exact else FIRST_SAMPLES,
            most=settings.verify_spp,
            should_stop=task.should_stop,
        )

    def fit(self) -> RouteEnds:
        """Run the stages.

        Raises
        ------
        UnrecordableError
            If no start gives finite numbers on the recorded paths.
        """
        task, scene, renderer, plan = self._task, self._scene, self._renderer, self._plan
        course = Course(renderer, self.stages, task.listener, task.should_stop, task.began)
        fit = RecordedFit(scene, task.light, task.mask, plan, task.settings.seed, course, task.clipped)
        basins = fit.start_from_nothing(_censored(log_residual, task))
        if task.should_stop():
            end = End("start", basins[0].x)
            choose = self._choose_by(self._judge(blurred=False).value)
            return RouteEnds((end,), 1, choose, tuple(course.reports), tuple(scene.needs.notes))

        make = RelativeResidual if scene.needs.sampled else log_residual
        first, *others = (basin.x for basin in basins)
        refined = fit.refine(first, _censored(make, task), _weighted(task), others)
        weighted = scene.needs.sampled and not isinstance(task.view, BakedView)
        kept = keep_values(fit, refined, weighted=weighted, seen=None if weighted else self._judge(blurred=False).value)
        fit.box = box_holding(fit.table, renderer.start, kept.held)
        notes = [*scene.needs.notes, *kept.notes]
        later: list[End] = []
        judge: PictureJudge | None = None
        left = np.inf  # under lights with extent residuals are in deviations of the noise
        if not scene.needs.sampled:
            left = float(np.sqrt(2.0 * refined.all.equations(kept.x).cost))
        enough = self._nothing_left(fit, kept.x, left)
        if enough:
            notes.append(enough)
        elif self._finishing:
            noise = fit.noise.level if fit.noise else 0.0
            may_blur = task.linear and task.settings.losses is None
            judge = self._judge(blurred=may_blur and (scene.needs.sampled or noise > NOISY))
            tried = others if task.settings.preset == "best" else []
            later = perceptual_ends(fit, refined.all, kept.x, tried, self._finishing, judge, task.settings, notes)
        if fit.fireflies:
            notes.append(f"{fit.fireflies} fireflies in the reference were left out of the search for a start.")
        if scene.needs.sampled and fit.recordings > 1:
            notes.append(f"The light was recorded {fit.recordings} times: the solution had moved away from the first.")
        counts = judge.value if judge else _misfit(fit, refined.all, _censored(log_residual, task))
        weak = tuple(weak_combinations(kept.spread, fit.table, kept.certainty, kept.held))
        ends = [End("refine", kept.x), *later]
        return RouteEnds(
            ends=tuple(replace(end, certainty=kept.certainty, weak_combinations=weak) for end in ends),
            by_squares=1,
            choose=self._choose_by(counts),
            stages=tuple(course.reports),
            notes=tuple(notes),
        )

    def _nothing_left(self, fit: RecordedFit, x: np.ndarray, left: float) -> str:
        """Why perceptual stages have nothing to do, one sentence; empty where they have, or are the user's choice."""
        optional = self._finishing and self._task.settings.losses is None and self._task.linear
        if not optional:
            return ""
        if left < self._plan.seen_rms:
            return f"What is left of the picture ({100 * left:.1g} %) nobody sees: perceptual stages were left out."
        if fit.misfit(x) >= AT_NOISE:
            return ""
        noise = fit.noise.level if fit.noise else 0.0
        return (
            f"The fit has reached the noise of the picture and of its own rays ({100 * noise:.2g} % a pixel): "
            "perceptual stages would fit that noise and were left out."
        )

    def _judge(self, *, blurred: bool) -> PictureJudge:
        task = self._task
        light, mask = task.light, task.mask
        return PictureJudge(self._measure, task.reference, light, mask, task.settings, task.view, blurred=blurred)

    @staticmethod
    def _choose_by(error: Callable[[Pixels], float]) -> Callable[..., Choice]:
        return lambda images: Choice.of([error(i) if np.isfinite(i).all() else np.inf for i in images])


def _censored(make: MakeResidual, task: FitTask) -> MakeResidual:
    """Residuals that expect no more of clipped pixels than a display shows."""
    view = task.view
    if task.linear:
        return make
    if isinstance(view, BakedView):
        return lambda target: DisplayedResidual(view, target)
    assert isinstance(view, DisplayView)
    limit = 2.0**-view.exposure_ev
    return lambda target: CensoredResidual(make(target), target, limit)


def _weighted(task: FitTask) -> MakeWeighted | None:
    """Residuals in standard deviations of the noise; None for a view that is no formula."""
    if isinstance(task.view, BakedView):
        return None
    return lambda target, weight: _censored(lambda t: WeightedResidual(t, weight), task)(target)


def _misfit(fit: RecordedFit, problem: Problem, compressed: MakeResidual) -> Callable[[Pixels], float]:
    """The least-squares measure of a path-traced picture: of the last problem where it knows the noise, else in log."""
    residual, groups = problem.residual, problem.groups
    if not fit.scene.needs.sampled:
        groups = fit.paths.tile_groups()
        residual = compressed(groups.average(fit.reference))
    return lambda image: float(np.sqrt(np.mean(residual(groups.average(image))[0] ** 2)))
