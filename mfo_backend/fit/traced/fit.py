# SPDX-License-Identifier: Apache-2.0
"""Materials whose light passes through them: least squares on traced paths, then FLIP."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...render.pictures.mitsuba_renderer import MitsubaRenderer
from ...render.sheet.sheet_renderer import SheetRenderer
from ...types.certainty import Certainty, Level
from ...types.errors import NoNearerError
from ...types.image import Pixels
from ...types.parameter import ParameterTable, Vector
from ..certainty.covariance import certainties, certainties_away
from ..judge.fit_task import FitTask
from ..judge.picture_judge import PictureJudge
from ..judge.verdict import judge
from ..judge.verification import Verification
from ..plans import TransmissionPlan
from ..random_streams import Stream
from ..result.course import Course
from ..result.outcome import Choice, End, RouteEnds, kept_note
from ..squares.stage_residuals import finishing_residuals
from ..tolerances import VISIBLE, WEAK_BELOW
from .choose_end import choose_end
from .linear_pictures import LinearPictures
from .perceptual_stages import FLIP, lower_seen_error
from .pictures import TracedTiles
from .polish import polish
from .polished import CORE, Polished
from .search import Setting, race, scan

if TYPE_CHECKING:  # the modules need Mitsuba's variant to be set
    from ...render.sheet.traced_sheet import TracedSheet
    from ...render.traced.traced_paths import TracedPaths

STAGES = ("scan", "race", "polish")
_LOOK_SPP = 32  # of a picture between two stages; its noise is taken out of what is compared
_PREVIEW_PATHS, _PREVIEW_SPP = 1 << 15, 2  # a quarter of a launch, whatever the size of the picture


class TracedRoute:
    """A fit on whole light paths, which may `begin` at values of an earlier one instead of the search for a start.

    Ends of the stages are compared on paths no stage has seen, and the best of them with the scene's own values on
    path-traced pictures, by mean FLIP.

    Raises
    ------
    UnrecordableError
        If the model has no traced version.
    BadInputError
        If one of the settings' losses is not defined for the reference.
    """

    def __init__(self, task: FitTask, renderer: MitsubaRenderer | SheetRenderer, begin: Vector | None = None) -> None:
        from ...render.sheet.traced_sheet import TracedSheet
        from ...render.traced.traced_paths import TracedPaths

        settings, encoding = task.settings, task.reference.encoding
        self._task, self._renderer, self._plan, self._begin = task, renderer, TransmissionPlan(), begin
        self._paths = TracedSheet(renderer) if isinstance(renderer, SheetRenderer) else TracedPaths(renderer)
        self._seen_residuals = finishing_residuals(settings, encoding, task.light, task.mask, task.view)
        own = STAGES if begin is None else STAGES[2:]
        self.stages = (*own, *self._seen_residuals, *([FLIP] if settings.preset == "best" else []))
        self.verification = Verification(renderer, task)

    def fit(self) -> RouteEnds:
        """Run the stages."""
        task, renderer, paths = self._task, self._renderer, self._paths
        seed, should_stop = task.settings.seed, task.should_stop
        course = Course(
            renderer,
            self.stages,
            task.listener,
            should_stop,
            task.began,
            picture=lambda x: _preview(paths, x, task.mask.shape, Stream.PREVIEW.seed(seed)),
        )
        pictures = TracedTiles(paths, task.light, task.mask, task.clipped, should_stop)
        setting = Setting(pictures, renderer.start, self._plan, seed, course)

        ends: Sequence[Polished] = ()
        freest = 0
        if self._begin is None:
            nodes = scan(setting)
            raced_to = race(setting, nodes) if not should_stop() else nodes
        else:
            raced_to = [self._begin]
        found = [raced_to[0]]
        if not should_stop():
            self._look(raced_to[0])
        if not should_stop():
            ends, pictures = polish(setting, raced_to)
            candidates = [end.x for end in reversed(ends)] + found
            chosen = choose_end(pictures, candidates, self._plan, seed, Stream.CHOOSE)
            raced = chosen == len(ends)
            found = [candidates[chosen]]
            ends = ends if raced else ends[: len(ends) - chosen]
            freest = int(np.argmin([end.kept.sum() for end in ends]))
            if raced or (chosen == 0 and freest < len(ends) - 1):
                # by the noisy squares values may go back to the user's, and a race look better, where no eye agrees
                found.append(ends[freest].x)
            if raced:
                ends = ends[: freest + 1]
        judge: PictureJudge | None = None
        nearer: list[Vector] = []
        if self._seen_residuals and ends and not should_stop():
            linear = LinearPictures(pictures, seed)
            if linear.are_worth_it(found[0], task.reference, task.view):
                judge = task.judge(task.light, blurred=task.linear)
                end = lower_seen_error(
                    linear, judge, self._seen_residuals, found[0], ends[-1].kept, course, flip=FLIP in self.stages
                )
                nearer = [] if np.array_equal(end, found[0]) else [end]
        counts = pictures.counts
        notes = ()
        if counts is not None:
            notes = (
                f"The picture is as noisy as one of {counts.count} samples a pixel: compressed pixels of as many "
                "samples were compared, so that no firefly decides.",
            )
        of_kept = self._known(ends)

        def away(x: Vector) -> dict[str, Certainty]:
            return certainties_away(of_kept[0], x - found[0], renderer.table)

        # the second end is the freest, where there are two
        known = [of_kept, self._known(ends[: freest + 1])] if len(found) == 2 else [of_kept]
        return RouteEnds(
            ends=(
                *(End("polish", x, certainty, notes=back) for x, (certainty, back) in zip(found, known, strict=True)),
                *(End(self.stages[-1], x, away(x), notes=of_kept[1]) for x in nearer),
            ),
            by_squares=len(found),
            choose=self._choose(len(found), judge if nearer else None),
            stages=tuple(course.reports),
            notes=notes,
        )

    def _look(self, x: Vector) -> None:
        """Stop a fit from another class which the race did not bring nearer than what it has to be better than."""
        task = self._task
        if task.nearer_than is None:
            return
        image = self._renderer.image(x, seed=Stream.LOOK.seed(task.settings.seed), spp=_LOOK_SPP)
        judgement = judge(task.reference, image, task.mask, task.view)
        if judgement is not None and judgement.target.visible > task.nearer_than:
            raise NoNearerError(time.monotonic() - task.began, self._renderer.passes)

    def _choose(self, squares: int, judge: PictureJudge | None) -> Callable[[Sequence[Pixels]], Choice]:
        """The first end unless the eye sees that another is better; a perceptual one is judged below the noise."""

        def choose(images: Sequence[Pixels]) -> Choice:
            plain = self._task.judge(images[0], blurred=False)
            start, *seen = (plain.value(image) for image in images)
            best = 0 if squares == 1 or seen[0] <= seen[1] + VISIBLE else 1
            if judge is not None and best == 0 and judge.value(images[-1]) < judge.value(images[1]):
                best = len(seen) - 1
            return Choice(best, seen[best] < start)

        return choose

    def _known(self, ends: Sequence[Polished]) -> tuple[dict[str, Certainty], tuple[str, ...]]:
        """How sure the last end's values are, and a sentence on those that went back to the user's unseen."""
        if not ends:
            return {}, ()
        table = self._renderer.table
        certainty = _certainty(ends, table)
        back = [name for name in certainty if ends[-1].kept[table.slice_of(name)].all()]
        unseen = [name for name in back if certainty[name].level is Level.NOT_VISIBLE]
        return certainty, ((kept_note(unseen, table),) if unseen else ())


def _preview(paths: TracedPaths | TracedSheet, x: Vector, shape: tuple[int, ...], seed: int) -> Pixels:
    """A coarse picture: few paths of one pixel in each block, so that its cost does not grow with the picture."""
    height, width = shape
    block = math.ceil(math.sqrt(height * width * _PREVIEW_SPP / _PREVIEW_PATHS))
    rows, columns = (np.arange(min(block // 2, n - 1), n, block) for n in shape)
    pixels = (rows[:, None] * width + columns).ravel()
    seen = paths.images(x[None], pixels, seed=seed, samples=_PREVIEW_SPP, jacobian=False)[0, :, :, 0]
    coarse = seen.reshape(len(rows), len(columns), 3)
    filled = np.repeat(np.repeat(coarse, block, axis=0), block, axis=1)
    short = ((0, max(0, height - len(filled))), (0, max(0, width - filled.shape[1])), (0, 0))
    return np.pad(filled, short, mode="edge")[:height, :width]


def _certainty(ends: Sequence[Polished], table: ParameterTable) -> dict[str, Certainty]:
    """How sure each value is, given those that went back to the user's; these are as unsure as when they were free.

    A value of the glass itself that the picture does not determine is hardly the user's, so given it nothing is surer.
    """
    variance = np.zeros(table.length)
    doubted = np.any(ends[-1].kept & table.mask_of(CORE))
    for end in ends:
        spread = end.covariance + _of_one_absorption(end, table)
        found = np.maximum(variance, np.diag(spread)) if doubted else np.diag(spread)
        variance = np.where(end.kept, variance, found)
    least = np.where(ends[-1].unseen, WEAK_BELOW * table.width, 0.0)
    spread = ends[-1].covariance + _of_one_absorption(ends[-1], table)
    return certainties(np.maximum(np.sqrt(variance), least), table, spread)


def _of_one_absorption(end: Polished, table: ParameterTable) -> Vector:
    """Covariance of density and colour of a volume that absorbs the same: density (1 - colour) alone is seen.

    The equations hold that way of no effect at all as far as their noise goes, which is too sure of it.
    """
    away = np.zeros(table.length)
    both = ("absorption_density", "absorption_color")
    if set(both) <= set(table.names) and not end.kept[table.mask_of(both)].any():
        density, color = map(table.slice_of, both)
        away[density], away[color] = end.x[density], 1.0 - end.x[color]
    return np.outer(away, away)
