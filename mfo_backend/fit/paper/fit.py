# SPDX-License-Identifier: Apache-2.0
"""The preset `paper`: the loop of Multi-Fidelity Optimization on new pictures of the whole scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...render.pictures.renderer import Interrupted, Renderer, Vector
from ...types.image import Pixels
from ..judge.checked_reference import stage_losses
from ..judge.fit_task import FitTask
from ..random_streams import Stream
from ..result.outcome import Candidate, Choice, End, RouteEnds
from .loop import run_stages


class PaperRoute:
    """A fit of any renderer, by the settings' losses one after another.

    The result is the best of start and all stages under the last loss, measured on verification pictures. So it is
    never worse than the start, and the perceptual stage never makes the result of the stage before worse. A cancelled
    fit is not verified: its best values come back at once.

    Raises
    ------
    SetupError
        If a loss needs a package that is missing.
    BadInputError
        If a loss is not defined for the reference.
    """

    def __init__(self, task: FitTask) -> None:
        settings, renderer = task.settings, task.renderer
        self._task = task
        self.stages = settings.stage_names(task.reference.encoding)
        self._start = Candidate(renderer.start, renderer.image(renderer.start, seed=settings.seed, spp=settings.spp))
        image, mask = self._start.image, task.mask
        self._losses = stage_losses(self.stages, task.reference, image, mask, settings, task.display)
        self.verification = WholePictures(
            renderer, seed=Stream.VERIFY.seed(settings.seed), spp=settings.verify_spp, should_stop=task.should_stop
        )

    def fit(self) -> RouteEnds:
        """Run the stages."""
        task = self._task
        outcome = run_stages(
            task.renderer,
            self._losses,
            self._start,
            task.settings,
            listener=task.listener,
            should_stop=task.should_stop,
            began=task.began,
        )
        return RouteEnds(
            ends=tuple(End(r.name, c.vector) for r, c in zip(outcome.reports, outcome.candidates[1:], strict=True)),
            by_squares=len(outcome.reports),
            choose=self._choose,
            stages=outcome.reports,
            status=outcome.status,
            unverified=outcome.candidates,
        )

    def _choose(self, images: Sequence[Pixels]) -> Choice:
        return Choice.of([self._losses[-1].value(image) for image in images])


class WholePictures:
    """Pictures of `spp` samples a pixel for any renderer, rendered when they are asked for."""

    def __init__(self, renderer: Renderer, *, seed: int, spp: int, should_stop: Callable[[], bool]) -> None:
        self._renderer, self._seed, self._spp, self._should_stop = renderer, seed, spp, should_stop

    def begin(self, vector: Vector) -> Callable[[], Candidate]:
        """See `Verifier.begin`; nothing is rendered until then."""
        return lambda: self._candidate(vector)

    def pictures(self, start: Callable[[], Candidate], ends: Sequence[Vector]) -> list[Candidate]:
        """See `Verifier.pictures`."""
        return [start(), *(self._candidate(end) for end in ends)]

    def finished(self, end: Candidate) -> Candidate:
        """See `Verifier.finished`."""
        return end

    def _candidate(self, vector: Vector) -> Candidate:
        if self._should_stop():
            raise Interrupted
        return Candidate(vector, self._renderer.image(vector, seed=self._seed, spp=self._spp))
