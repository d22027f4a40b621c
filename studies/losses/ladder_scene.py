# SPDX-License-Identifier: Apache-2.0
"""One scene of the ladder study: every loss, pair and ladder from the same start, judged without noise.

The loop is that of the preset `paper`, on recorded paths instead of new ones: with the fixed seed of that loop both are
the same sum over the same samples, and a recorded one costs a few milliseconds.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mfo_backend.bench.scenes.assets import Assets
from mfo_backend.bench.scenes.scenario import Scenario
from mfo_backend.bench.scenes.scene import SHAPE, write_scene
from mfo_backend.fit.judge.checked_reference import stage_losses
from mfo_backend.fit.paper.loop import run_stages
from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.result.outcome import Candidate
from mfo_backend.fit.settings import FitSettings
from mfo_backend.metrics.compare import compare_images
from mfo_backend.metrics.losses.loss import Loss, make_loss
from mfo_backend.metrics.losses.loss_names import loss_in_range
from mfo_backend.render.pictures.pass_counter import PassCounter
from mfo_backend.types.image import Encoding, Image, Pixels

Vector = NDArray[np.float64]
Ladder = tuple[str, ...]

SCENARIOS = (
    Scenario("ladder-point", "point", "reduced", reference_spp=1024, fit_spp=16, max_depth=2),
    Scenario("ladder-probe", "probe", "reduced", reference_spp=64, fit_spp=16, max_depth=2),
)
LOW = ("mse", "log", "relative", "pu21", "itp")
SLOW = ("mse", "itp")  # what the slow judge starts from
PRESETS: dict[str, dict[str, Any]] = {
    "fast": {"preset": "fast"},
    "balanced": {"preset": "balanced"},
    "fast > itp": {"preset": "fast", "losses": ("itp",)},
    "fast > pu21": {"preset": "fast", "losses": ("pu21",)},
    "fast > mse": {"preset": "fast", "losses": ("mse",)},
}
_REFERENCE_SEED, _JUDGE_SEED, _VERIFY_SEED = 0x0BEF0000, 0x70D6E000, 0x5EED0000
_GRID, _JUDGE_GRID = 4, 8  # squared: camera rays of a pixel


def ladders(judged: bool) -> list[Ladder]:
    """All ladders of the study, each after those it continues."""
    found: list[Ladder] = [(name,) for name in (*LOW, "flip", "mse-ldr", "flip-ldr")]
    found += [(low, high) for high in ("flip", "itp", "pu21") for low in LOW if low != high]
    found += [("mse-ldr", "flip-ldr"), ("mse", "itp", "flip"), ("log", "itp", "flip"), ("log", "pu21", "flip")]
    if judged:
        found += [("cvvdp",), *((low, "cvvdp") for low in SLOW)]
    return found


def prepare() -> None:
    """Load Mitsuba."""
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    from mfo_backend.render.machine.variant import load_variant

    load_variant()


class RecordedRenderer:
    """`render.renderer.Renderer` from one recording; pixels off the target are those of `background`."""

    def __init__(self, scene: Any, background: Pixels, *, grid: int, seed: int, at: Vector, near: bool) -> None:
        renderer = scene.renderer
        self.model, self.table, self.start = renderer.model, renderer.table, renderer.start
        self.counter = PassCounter()
        paths = scene.record(at, grid=grid, seed=seed, near=near)
        groups = paths.pixel_groups()
        self._evaluate: Callable[[Vector], NDArray[np.float32]] = scene.evaluator(paths, groups)
        self._pixels = groups.pixels
        self._background = background
        self._mask = renderer.target_mask()

    @property
    def passes(self) -> float:
        """See `Renderer`."""
        return self.counter.count

    def target_mask(self) -> NDArray[np.bool_]:
        """See `Renderer`."""
        return self._mask

    def otherwise_mask(self) -> NDArray[np.bool_]:
        """See `Renderer`."""
        return np.zeros_like(self._mask)

    def image(self, vector: Vector, *, seed: int, spp: int) -> Pixels:
        """See `Renderer`; seed and samples are those of the recording."""
        self.counter.add(1.0)
        return self._image(self._evaluate(vector))

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Callable[[Pixels], Vector]]:
        """See `Renderer`; counts the three passes such a step takes with `prb`."""
        self.counter.add(3.0)
        table = self._evaluate(vector)
        slopes = table[:, :, 1:].reshape(-1, table.shape[2] - 1).astype(np.float64)

        def pullback(gradient: Pixels) -> Vector:
            return gradient.reshape(-1, 3)[self._pixels].ravel().astype(np.float64) @ slopes

        return self._image(table), pullback

    def _image(self, table: NDArray[np.float32]) -> Pixels:
        image = self._background.copy()
        image.reshape(-1, 3)[self._pixels] = table[:, :, 0]
        return image


class _Judge:
    """Errors of values against the true ones, both from the same fine recording near the truth."""

    def __init__(self, fine: RecordedRenderer, truth: Vector, *, judged: bool) -> None:
        self._fine, self._truth = fine, truth
        self._true = Image(fine.image(truth, seed=0, spp=0), Encoding.LINEAR)
        self._jod = make_loss("cvvdp-hdr", self._true, mask=fine.target_mask()) if judged else None

    def __call__(self, vector: Vector) -> dict[str, float | None]:
        pixels = self._fine.image(vector, seed=0, spp=0)
        mask = self._fine.target_mask()
        metrics = compare_images(self._true, Image(pixels, Encoding.LINEAR), mask=mask).metrics
        table = self._fine.table
        error = np.abs(vector - self._truth) / (table.upper - table.lower)
        return {
            "flip": metrics["flip"],
            "hdr_flip": metrics["hdr_flip"],
            "de_itp": metrics["de_itp"],
            "lost_jod": None if self._jod is None else self._jod.value(pixels),
            "parameter": float(error.mean()),
        }


def measure_scene(number: int, size: int, folder: Path) -> dict[str, Any]:
    """Errors and cost of every ladder and preset in scene `number`; even ones have a point light, odd ones a probe."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scenario = SCENARIOS[number % 2]
    written = write_scene(scenario, number, size, Assets(None), folder / str(number))
    renderer = _load(written.file)
    table = renderer.table
    truth = table.clip(table.pack(written.truth))
    mask = renderer.target_mask()
    reference = Image(renderer.image(truth, seed=_REFERENCE_SEED + number, spp=scenario.reference_spp), Encoding.LINEAR)
    scene = RecordedScene(renderer, int(mask.sum()))
    background = renderer.image(renderer.start, seed=number, spp=scenario.fit_spp)

    def recorded(grid: int, seed: int, at: Vector, *, near: bool) -> RecordedRenderer:
        return RecordedRenderer(scene, background, grid=grid, seed=seed + number, at=at, near=near)

    judged = all(map(importlib.util.find_spec, ("torch", "pycvvdp")))
    judge = _Judge(recorded(_JUDGE_GRID, _JUDGE_SEED, truth, near=True), truth, judged=judged)
    fitted = recorded(_GRID, 0, renderer.start, near=False)
    verified = recorded(_GRID, _VERIFY_SEED, renderer.start, near=False)
    study = _Study(fitted, verified, reference, mask)
    methods = {"start": {**judge(renderer.start), "passes": 0.0, "iterations": {}}}
    for ladder in ladders(judged):
        vector, passes, iterations = study.climb(ladder)
        methods[" > ".join(ladder)] = {**judge(vector), "passes": passes, "iterations": iterations}
    for name, settings in PRESETS.items():
        fresh = _load(written.file)
        result = recover_material(
            fresh, reference, FitSettings(**settings), listener=lambda _: None, should_stop=lambda: False
        ).result
        vector = table.pack(result.recovered)
        methods[name] = {**judge(vector), "passes": result.passes, "iterations": {}}
    return {
        "scene": number,
        "light": scenario.light,
        "size": size,
        "methods": methods,
        "loss_passes": study.cost_of_losses(renderer),
    }


def _load(file: Path) -> Any:
    from mfo_backend.render.pictures.mitsuba_renderer import load_mitsuba_renderer

    return load_mitsuba_renderer(file, SHAPE, model="mitsuba_principled", parameters="reduced", materials={})


class _Study:
    """Climbs ladders; the stages two ladders share run once."""

    def __init__(
        self, fitted: RecordedRenderer, verified: RecordedRenderer, reference: Image, mask: NDArray[np.bool_]
    ) -> None:
        self._fitted, self._verified = fitted, verified
        self._reference, self._mask = reference, mask
        self._settings = FitSettings(preset="paper")
        self._losses: dict[str, Loss] = {}
        start = Candidate(fitted.start, fitted.image(fitted.start, seed=0, spp=0))
        # the ends of all stages of a ladder, the passes it took and the iterations under each loss
        self._ends: dict[Ladder, tuple[Sequence[Candidate], float, dict[str, int]]] = {(): ((start,), 1.0, {})}

    def climb(self, ladder: Ladder) -> tuple[Vector, float, dict[str, int]]:
        """Values a fit with these stages ends with: the best under the last loss on new samples; passes; iterations."""
        candidates, passes, iterations = self._run(ladder)
        loss = self._loss(ladder[-1])
        values = [loss.value(self._verified.image(c.vector, seed=0, spp=0)) for c in candidates]
        return candidates[int(np.argmin(values))].vector, passes + len(candidates), iterations

    def _run(self, ladder: Ladder) -> tuple[Sequence[Candidate], float, dict[str, int]]:
        if ladder not in self._ends:
            candidates, passes, iterations = self._run(ladder[:-1])
            before = self._fitted.passes
            outcome = run_stages(
                self._fitted,
                [self._loss(ladder[-1])],
                candidates[-1],
                self._settings,
                listener=lambda _: None,
                should_stop=lambda: False,
            )
            spent = {**iterations, ladder[-1]: outcome.reports[0].iterations}
            ends = (*candidates, outcome.candidates[-1])
            self._ends[ladder] = ends, passes + self._fitted.passes - before, spent
        return self._ends[ladder]

    def cost_of_losses(self, renderer: Any) -> dict[str, float]:
        """Time of a value with gradient of each loss over that of one of the three passes of a step in Mitsuba."""
        start, _, _ = self._run(())
        image = start[0].image

        def step() -> None:
            pixels, pullback = renderer.image_and_pullback(renderer.start, seed=0, spp=self._settings.spp)
            pullback(pixels)

        one_pass = _least_seconds(step) / 3.0
        return {
            name: _least_seconds(lambda each=loss: each.value_and_gradient(image)) / one_pass
            for name, loss in self._losses.items()
        }

    def _loss(self, name: str) -> Loss:
        if name not in self._losses:
            background = self._run(())[0][0].image
            full = loss_in_range(name, "hdr")
            (self._losses[name],) = stage_losses([full], self._reference, background, self._mask, self._settings, None)
        return self._losses[name]


def _least_seconds(work: Callable[[], object], rounds: int = 3) -> float:
    """The shortest of a few runs, after one that may compile."""
    work()
    seconds = []
    for _ in range(rounds):
        began = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - began)
    return min(seconds)
