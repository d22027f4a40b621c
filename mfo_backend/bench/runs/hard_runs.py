# SPDX-License-Identifier: Apache-2.0
"""Fits of the hard cases: what came out, and which guard spoke."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...fit.recorded.where_to_look import detail_grid
from ...fit.recover_material import recover_material
from ...fit.settings import FitSettings
from ...metrics.compare import compare_images
from ...metrics.display.tone_mapping import DisplayView
from ...render.camera.highlight_cells import Highlights
from ...render.camera.widened_mask import widened
from ...render.pictures.mitsuba_renderer import MitsubaRenderer
from ...render.pictures.renderer import Renderer, load_renderer
from ...types.certainty import Level
from ...types.errors import MfoError
from ...types.image import Encoding, Image, Pixels
from ...types.parameter import ParameterTable, Value
from ...types.result import FitResult
from ..judge.judge import relative_rmse
from ..judge.promise import is_wrongly_determined, miss
from ..scenes.hard_cases import HardCase, HardScene, write_hard_scene
from ..scenes.scene import SHAPE

_REFERENCE_SEED, _JUDGE_SEED = 0x4A2D0000, 0x4A2D8000
_JUDGE_SPP = 256
_FINE = Highlights(share=0.2, most=400_000)


@dataclass(frozen=True)
class HardRun:
    """One fit of one case.

    `error` is what the case's limit is for. `guards` are the sentences in which the fit said what it left out, kept or
    refused. `finite` says that no value and no error is NaN or infinite. `wrong` names values that the fit calls
    determined and that are not the truth's: a run that is not solved and has some failed in silence.
    """

    case: str
    seed: int
    solved: bool
    error: float
    start_error: float
    finite: bool
    passes: float
    guards: tuple[str, ...]
    wrong: tuple[str, ...] = ()


def run_hard_case(case: HardCase, seed: int, size: int, folder: Path, preset: str = "balanced") -> HardRun:
    """Fit one scene of a case and judge it in pictures that the fit has not seen."""
    scene = write_hard_scene(case, seed, size, folder)
    try:
        renderer = _load(scene, scene.file)
    except MfoError as error:  # a refusal in words is the right end where all is locked
        return HardRun(case.name, seed, not case.fitted, 0.0, 0.0, True, 0.0, (str(error),))
    true = _load(scene, scene.true_file)
    exact = None if case.noisy else ExactPicture(true, true.table.pack(scene.truth))
    reference, view = _reference(case, scene, true, exact)
    settings = FitSettings(model=case.model, preset=preset, seed=seed, max_iterations=60)
    result = recover_material(
        renderer, reference, settings, display=view, listener=lambda event: None, should_stop=lambda: False
    ).result

    mask = renderer.target_mask()
    vectors = renderer.start, renderer.table.pack(result.recovered)
    if exact is not None and not case.other_object:
        shown = [exact(x) for x in vectors]
    else:
        shown = [renderer.image(x, seed=_JUDGE_SEED + seed, spp=_JUDGE_SPP) for x in vectors]
    truth = true.table.pack(scene.truth)
    truth = exact(truth) if exact else true.image(truth, seed=_JUDGE_SEED + seed, spp=_JUDGE_SPP)
    truth = truth * np.float32(case.gain)
    start_error, error = (_error(case, picture, truth, reference, view, mask) for picture in shown)
    values = np.concatenate([np.ravel(value) for value in result.recovered.values()])
    finite = bool(np.isfinite([*values, error, start_error]).all())
    # errors of pictures with noise: a start that is the best cannot be told from the result by less
    solved = finite and error <= case.limit and error <= start_error + 0.005
    guards = tuple(result.notes) if "so the start was kept" not in result.message else (*result.notes, result.message)
    known = np.isfinite(case.limit)  # elsewhere no value is right
    wrong = wrongly_determined(result, scene.truth, true.table) if known else ()
    return HardRun(case.name, seed, solved, error, start_error, finite, result.passes, guards, wrong)


def _load(scene: HardScene, file: Path) -> Renderer:
    case = scene.case
    return load_renderer(file, SHAPE, model=case.model, parameters=case.fitted, materials=scene.materials)


def wrongly_determined(result: FitResult, truth: Mapping[str, Value], table: ParameterTable) -> tuple[str, ...]:
    """Names of values called determined that miss the truth by more than three of their standard deviations and by
    more than "determined" promises."""
    wrong = []
    for name, certainty in result.certainty.items():
        missed = miss(result.recovered[name], truth[name], table[name])
        if certainty.level is Level.DETERMINED and is_wrongly_determined(missed, certainty.sd, table[name]):
            wrong.append(name)
    return tuple(wrong)


class ExactPicture:
    """Pictures under lights of no extent, with many rays where the picture of one vector has detail.

    Path tracing finds a highlight that is narrower than a pixel by luck only.
    """

    def __init__(self, renderer: Renderer, vector: NDArray[np.float64]) -> None:
        from ...render.paths.recorded_scene import RecordedScene

        assert isinstance(renderer, MitsubaRenderer)
        mask = renderer.target_mask()
        scene = RecordedScene(renderer, int(mask.sum()))
        self._shape = (*mask.shape, 3)
        grid: int | NDArray[np.int64] = 6
        for _ in range(2):
            self._paths = scene.record(vector, grid=grid, seed=_JUDGE_SEED, near=False, highlights=_FINE)
            self._evaluate = scene.evaluator(self._paths, self._paths.pixel_groups())
            picture = self(vector)
            lit = picture.max(axis=2) > 0.0
            # where light ends, at silhouettes and shadows, a sliver of a pixel may be all that is lit
            grid = 2 * detail_grid(picture, mask, widened(lit, 1) & widened(~lit, 1)) + 2

    def __call__(self, vector: NDArray[np.float64]) -> Pixels:
        """The linear picture; black beside the target."""
        image = np.zeros(self._shape, np.float32)
        image.reshape(-1, 3)[self._paths.pixel] = self._evaluate(vector)[:, :, 0]
        return image


def _reference(
    case: HardCase, scene: HardScene, true: Renderer, exact: ExactPicture | None
) -> tuple[Image, DisplayView | None]:
    truth = true.table.pack(scene.truth)
    pixels = exact(truth) if exact else true.image(truth, seed=_REFERENCE_SEED + scene.seed, spp=case.spp)
    pixels = pixels * np.float32(case.gain)
    if not case.white:
        return Image(pixels, Encoding.LINEAR), None
    brightest = np.quantile(pixels[true.target_mask()].max(-1), 1.0 - case.white)
    view = DisplayView(exposure_ev=float(-np.log2(max(brightest, 1e-6))))
    return Image(view.display(pixels), Encoding.SRGB), view


def _error(
    case: HardCase, picture: Pixels, truth: Pixels, reference: Image, view: DisplayView | None, mask: np.ndarray
) -> float:
    if view is not None:  # above white any value is right
        picture, truth = (np.minimum(image, 2.0**-view.exposure_ev) for image in (picture, truth))
    if not case.noisy:
        return relative_rmse(picture, truth, mask)
    noise, misfit = (
        compare_images(reference, Image(image, Encoding.LINEAR), mask=mask, display=view).metrics["flip"]
        for image in (truth, picture)
    )
    return float((misfit or 0.0) - (noise or 0.0))
