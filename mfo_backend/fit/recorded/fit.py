# SPDX-License-Identifier: Apache-2.0
"""The presets `fast`, `balanced` and `best`: a global start and bounded least squares on recorded light paths."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...render.camera.primary_rays import TILE
from ...render.paths.recorded_scene import RecordedScene
from ...render.pictures.mitsuba_renderer import MitsubaRenderer
from ...render.sheet.recorded_sheet import RecordedSheet
from ...render.sheet.sheet_renderer import SheetRenderer
from ...render.sheet.turned_camera import View, view_of
from ...types.certainty import Certainty
from ...types.image import Pixels
from ...types.result import Contradiction, NextPicture
from ..alike.compare import compare
from ..certainty.covariance import certainties_away
from ..certainty.weak_combinations import weak_combinations
from ..judge.fit_task import FitTask
from ..judge.verification import FIRST_SAMPLES, FIRST_SAMPLES_EXACT, Verification
from ..pictures.contradiction import contradiction
from ..pictures.next_picture import Doubt, Evidence, Known, next_picture, open_values
from ..plans import RecordedPlan
from ..random_streams import Stream
from ..result.course import Course
from ..result.outcome import Choice, End, RouteEnds
from ..squares.residuals import RelativeResidual, log_residual
from ..squares.stage_residuals import finishing_residuals
from ..tolerances import AT_NOISE, NOISY, VISIBLE
from .keep_user_values import Judged, Kept, keep_values
from .perceptual_stages import perceptual_ends
from .plateaus import with_plateaus
from .recording import Setting, Vector
from .refine import OnRecording, refine_exact, refine_sampled
from .start import Started, start_from_nothing

TILES_OF_A_PICTURE = 300  # that are asked whether pictures agree: a wrong lamp shows in all
STAGES = ("scan", "start", "refine")
NOTHING_SEEN = "What is left of the picture ({:.1g} %) nobody sees: perceptual stages were left out."
NOTHING_BUT_NOISE = (
    "The fit has reached the noise of the picture and of its own rays ({:.2g} % a pixel): "
    "perceptual stages would fit that noise and were left out."
)


def recorded_scene(
    renderer: MitsubaRenderer | SheetRenderer, mask: NDArray[np.bool_], counts: NDArray[np.bool_] | None
) -> RecordedScene | RecordedSheet:
    """What records a renderer's target, which `mask` sees, where `counts` is True.

    Raises
    ------
    UnrecordableError
        For materials that recorded paths cannot hold.
    """
    if isinstance(renderer, SheetRenderer):
        return RecordedSheet(renderer, counts)
    return RecordedScene(renderer, int(mask.sum()), counts=counts)


class RecordedRoute:
    """A fit with no use of the material's start but as one guess; `plan` is that of the preset, unless it is given.

    Where light is sampled it may `begin` at values of an earlier fit in nearly the same light, instead of the search.
    `scene` is that of the renderer and of what counts, where there is one already.

    The result is the best of the scene's own values and the end of every finishing stage, judged on path-traced
    pictures: by the least-squares residual of tiles for `fast` and where the picture's noise is reached, by the last of
    the losses where the settings name them, else by FLIP (`fit.judge.picture_judge`).

    Raises
    ------
    UnrecordableError
        For materials that recorded paths cannot hold: what transmits light, an alpha that is free.
    BadInputError
        If one of the settings' losses is not defined for the reference.
    """

    def __init__(
        self,
        task: FitTask,
        renderer: MitsubaRenderer | SheetRenderer,
        plan: RecordedPlan | None,
        begin: Vector | None = None,
        scene: RecordedScene | RecordedSheet | None = None,
    ) -> None:
        settings = task.settings
        self._task, self._renderer = task, renderer
        self._plan = plan or RecordedPlan.of(settings.preset)
        self._finishing = finishing_residuals(settings, task.reference.encoding, task.light, task.mask, task.view)
        self._scene = scene or recorded_scene(renderer, task.mask, task.reference.counts)
        # where every light is exact the search is quick, and its recording serves for the refinement
        self._begin = begin if begin is not None and self._scene.needs.sampled else None
        self._alone = scene is None  # of a fit in turns with others nobody asks for a further picture
        self.stages = (
            *(STAGES if self._begin is None else STAGES[2:]),
            *self._finishing,
            *(["flip"] if settings.preset == "best" else []),
        )
        first = FIRST_SAMPLES_EXACT if self._scene.lights_exact else FIRST_SAMPLES
        self.verification = Verification(renderer, task, first)

    def fit(self) -> RouteEnds:
        """Run the stages.

        Raises
        ------
        UnrecordableError
            If no start gives finite numbers on the recorded paths.
        """
        task, scene, renderer = self._task, self._scene, self._renderer
        glance = partial(self.verification.glance, elsewhere=task.light) if self._alone else None
        course = Course(renderer, self.stages, task.listener, task.should_stop, task.began, glance)
        setting = Setting(
            scene, task.light, task.mask, self._plan, task.settings.seed, course, task.clipped,
            None if task.linear else task.view,
        )  # fmt: skip
        started = start_from_nothing(setting) if self._begin is None else Started(None, (self._begin,), None)
        first, *others = started.basins
        if task.should_stop():
            choose = self._choose_by(task.judge(task.light, blurred=False).value)
            return RouteEnds((End("start", first),), 1, choose, tuple(course.reports), tuple(scene.needs.notes))

        end = refine_sampled(setting, started.basins) if setting.sampled else refine_exact(setting, started)
        end = replace(end, refined=end.refined.near(setting.table, setting.user))
        del started  # and with it the first recording
        kept = keep_values(end, None if setting.sampled else task.judge(task.light, blurred=False).value)
        kept = with_plateaus(end, kept)
        disagree = self._contradiction(end, kept)
        later, notes, counts = self._perceptual(end, kept, others)
        notes = [*scene.needs.notes, *notes]
        if fireflies := setting.without_fireflies[1]:
            notes.append(f"{fireflies} fireflies in the reference were left out of the search for a start.")
        if setting.sampled and end.recording.number > 1:
            times = end.recording.number
            notes.append(f"The light was recorded {times} times: the solution had moved away from the first.")
        weak = tuple(weak_combinations(kept.spread, setting.table, kept.certainty, kept.held))
        # an earlier fit's values come back where an eye sees it: a noisy recording may prefer worse ones
        asked = (*end.refined.richer, *(() if self._begin is None else (self._begin,)))
        ends = [
            End("refine", kept.x, notes=kept.notes),
            *(End("refine", x) for x in asked),
            *(replace(other, notes=kept.notes) for other in later),
        ]

        def known(x: Vector) -> dict[str, Certainty]:
            return certainties_away(kept.certainty, x - kept.x, setting.table)

        return RouteEnds(
            ends=tuple(replace(end, certainty=known(end.x), weak_combinations=weak) for end in ends),
            by_squares=1 + len(asked),
            choose=self._unless_seen(len(asked), self._choose_by(counts)),
            stages=tuple(course.reports),
            notes=tuple(notes),
            contradiction=disagree,
            next_picture=None if disagree else self._next_picture(end, kept),
        )

    def _next_picture(self, end: OnRecording, kept: Kept) -> NextPicture | None:
        """The further picture that would tell most of the weak values."""
        task = self._task
        if task.settings.preset == "fast" or not self._alone or task.should_stop():
            return None
        scene = self._scene if isinstance(self._scene, RecordedScene) else self._scene.first
        wanted = open_values(kept.x, kept.certainty, self._renderer.start, self._renderer.table)
        if not wanted or scene.varies:
            return None
        pictures = 1 if task.sheet is None else len(task.sheet)
        setting = end.recording.setting
        doubts = tuple(
            Doubt(rival, (rival.x - kept.x) / setting.table.width, compare(end.refined.all, kept.x, rival.x))
            for rival in end.refined.rivals
        )
        judged = Judged(setting, end.refined)
        evidence = Evidence(*judged.rows(kept.x), judged.model_error, pictures)
        known = Known(kept.x, kept.spread, wanted, evidence, self._views(), doubts)
        return next_picture(scene, known, task.candidates, Stream.NEXT_PICTURE.seed(task.settings.seed))

    def _views(self) -> tuple[View, ...]:
        """Where the cameras of the pictures stand."""
        renderers = getattr(self._renderer, "renderers", (self._renderer,))
        found = (view_of(renderer.scene.sensors()[0]) for renderer in renderers)
        return tuple(view for view in found if view is not None)

    def _contradiction(self, end: OnRecording, kept: Kept) -> Contradiction | None:
        """Which of several pictures does not go with the others."""
        task, sheet = self._task, self._task.sheet
        if sheet is None or task.should_stop():
            return None
        recording, setting = end.recording.whole, end.recording.setting
        groups = recording.tiles(TILE)
        noise = recording.noise(recording.pixels(kept.x), TILE)
        some = np.arange(0, len(groups), max(len(groups) // (TILES_OF_A_PICTURE * len(sheet)), 1))
        groups, noise = groups.take(some), noise.take(some)
        makers = setting.censored(RelativeResidual), recording.weighing(noise, TILE)
        solved, judged = (recording.problem(groups, make) for make in makers)
        judged = replace(judged, evaluate=solved.evaluate)  # which remembers what it was asked
        numbers = sheet.numbers(groups.pixels[groups.first[:-1]])
        box = setting.table.lower, setting.table.upper
        return contradiction(solved, judged, numbers, sheet.labels, kept.x, box, task.should_stop)

    def _perceptual(
        self, end: OnRecording, kept: Kept, others: Sequence[Vector]
    ) -> tuple[list[End], list[str], Callable[[Pixels], float]]:
        """The ends of the perceptual stages where these have something to do, sentences, and what a picture counts."""
        task, plan, settings = self._task, self._plan, self._task.settings
        setting, blurred = end.recording.setting, False
        if not self._finishing:
            return [], [], _misfit(end)
        if settings.losses is None and task.linear:
            # under lights with extent residuals are in deviations of the noise
            left = np.inf if setting.sampled else float(np.sqrt(2.0 * end.refined.all.equations(kept.x).cost))
            if left < plan.seen_rms:
                return [], [NOTHING_SEEN.format(100 * left)], _misfit(end)
            deviations, noise = end.recording.whole.misfit(kept.x)
            if deviations < AT_NOISE:
                return [], [NOTHING_BUT_NOISE.format(100 * noise.level)], _misfit(end)
            blurred = setting.sampled or noise.level > NOISY
        judge = task.judge(task.light, blurred=blurred)
        basins = others if settings.preset == "best" else []
        later, notes = perceptual_ends(end, kept, basins, self._finishing, judge, settings)
        return later, notes, judge.value

    def _unless_seen(self, asked: int, choose: Callable[..., Choice]) -> Callable[..., Choice]:
        """A choice among start and ends, but for the `asked` ends after the first.

        One of these is taken where an eye sees that it is better.
        """
        if not asked:
            return choose
        seen = self._task.judge(self._task.light, blurred=self._task.linear).value

        def choice(images: Sequence[Pixels]) -> Choice:
            chosen = choose([*images[:2], *images[2 + asked :]])
            end = chosen.end if chosen.end == 0 else chosen.end + asked
            least, best = min((seen(images[1 + k]), k) for k in range(1, 1 + asked))
            if least < seen(images[1 + end]) - VISIBLE:
                return Choice(best, chosen.beats_start or least < seen(images[0]))
            return replace(chosen, end=end)

        return choice

    @staticmethod
    def _choose_by(error: Callable[[Pixels], float]) -> Callable[..., Choice]:
        return lambda images: Choice.of([error(i) if np.isfinite(i).all() else np.inf for i in images])


def _misfit(end: OnRecording) -> Callable[[Pixels], float]:
    """The least-squares measure of a path-traced picture: of the last problem where it knows the noise, else in log."""
    setting, problem = end.recording.setting, end.refined.all
    residual, groups = problem.residual, problem.groups
    if not setting.sampled:
        groups = end.recording.paths.tile_groups()
        residual = setting.censored(log_residual)(groups.average(setting.reference))
    return lambda image: float(np.sqrt(np.mean(residual(groups.average(image))[0] ** 2)))
