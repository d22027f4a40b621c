# SPDX-License-Identifier: Apache-2.0
"""How far recovered values are from the true ones, seen in pictures no fit has used."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...metrics.compare import compare_images
from ...metrics.judgement import judge_images
from ...metrics.judges.hdr_vdp_program import is_configured
from ...metrics.judges.packages import require_pycvvdp
from ...render.pictures.plain_picture import PlainScene
from ...render.pictures.renderer import Renderer, load_renderer
from ...scene.image_file import read_image
from ...types.errors import MfoError
from ...types.image import Encoding, Image, Pixels
from ...types.parameter import Value
from ..scenes.scene import SHAPE, BenchScene

# far from each other and from the seeds of fits, which follow from the scenes' numbers (`fit/random_streams.py`)
_REFERENCE_STREAM, _JUDGE_STREAM, _NEXT_PART = 0x0BEF0000, 0x70D6E000, 0x10001
JUDGE_SPP = 256
UNPAIRED_SPP = 512  # where the truth is another material's or renderer's, so that noise is not the same in both
# Behind glass the same random numbers make other paths, and the noise of the judge's own two pictures lowers the score:
# two pictures of one truth got 8.2 to 9.0 JOD with 256 samples. A score below the first is taken again with so many
# times the samples, if two pictures of the truth are below the second.
DOUBTED_JOD, CLEAR_JOD = 9.0, 9.5
MORE_PARTS = 8


@dataclass(frozen=True)
class Difference:
    """Means over the object, and scores of the whole picture: ColorVideoVDP's and HDR-VDP-3's, None where missing."""

    flip: float
    hdr_flip: float
    relative_rmse: float
    jod: float | None = None
    q_jod: float | None = None


@dataclass(frozen=True)
class TruePictures:
    """What only depends on the scene: it is rendered once and can be sent to another process.

    `truth` is under the reference's light and then under those of the judge; `floor` is the difference of the
    reference from it, its noise, and `start` that of the start. `gap_flip` is that of our own picture of the true
    values where another renderer made the truth.
    """

    reference: Pixels
    truth: tuple[Pixels, ...]
    mask: NDArray[np.bool_]
    floor: Difference
    start: Difference
    gap_flip: float | None = None


class Judge:
    """Judges values against a scene's truth; without `pictures` it renders them when they are needed."""

    def __init__(self, scene: BenchScene, pictures: TruePictures | None = None) -> None:
        self._scene = scene
        self._renderer = self._load(scene.file)
        self._seed = _JUDGE_STREAM + scene.number
        self._spp = JUDGE_SPP if scene.truth and not scene.given else UNPAIRED_SPP
        table = self._renderer.table
        self.truth = table.clip(table.pack(scene.truth)) if scene.truth else None
        self._known = pictures

    @functools.cached_property
    def pictures(self) -> TruePictures:
        """The scene's true pictures and what is measured on them once."""
        return self._known or self._render()

    @functools.cached_property
    def _true_picture(self) -> Pixels:
        """The truth under the reference's light: all that a score alone needs."""
        if self._known:
            return self._known.truth[0]
        if self._scene.given:
            return read_image(self._scene.given[1]).pixels
        if self.truth is None:
            return PlainScene(self._scene.true_files[0]).image(seed=self._seed, spp=self._spp)
        return self._picture(self._renderer, self.truth)

    @functools.cached_property
    def _relit_renderers(self) -> list[Renderer]:
        """Those of the lights that no fit sees."""
        return [self._load(file) for file in self._scene.relit]

    @property
    def reference(self) -> Image:
        """What the fits see."""
        return Image(self.pictures.reference, Encoding.LINEAR)

    def picture(self, values: Mapping[str, Value]) -> Pixels:
        """The judge's picture of these values under the reference's light."""
        return self._picture(self._renderer, self._renderer.table.pack(values))

    def pair(self, values: Mapping[str, Value], spp: int | None) -> tuple[Pixels, Pixels]:
        """What a row is scored on: the truth and these values, with `Row.judge_spp` samples a pixel."""
        picture = self.picture(values)
        if spp is None or spp <= self._spp or self.truth is None:
            return self._true_picture, picture
        return self._finer_truth, self._finer(self._renderer.table.pack(values), picture)

    def difference(self, values: Mapping[str, Value]) -> Difference:
        """Of the pictures of these values and of the true ones, under the same random numbers."""
        return self.difference_of(self.picture(values))

    def difference_of(self, picture: Pixels) -> Difference:
        """Of a picture of the judge's and the true one."""
        return _difference(self._true_picture, picture, self.pictures.mask)

    def settled(self, difference: Difference, values: Mapping[str, Value], picture: Pixels) -> tuple[Difference, int]:
        """The difference of a `picture` of the values with scores that the judge's own noise does not lower, and the
        samples a pixel of the pictures they are for."""
        if difference.jod is None or difference.jod >= DOUBTED_JOD or self.truth is None or self._scene.given:
            return difference, self._spp
        itself = _difference(self._true_picture, self._second_truth, self.pictures.mask).jod
        if itself is None or itself >= CLEAR_JOD:
            return difference, self._spp
        found = self._finer(self._renderer.table.pack(values), picture)
        finer = _difference(self._finer_truth, found, self.pictures.mask)
        return replace(difference, jod=finer.jod, q_jod=finer.q_jod), MORE_PARTS * self._spp

    @functools.cached_property
    def _second_truth(self) -> Pixels:
        """The truth under other random numbers: the second part of a finer picture."""
        assert self.truth is not None
        return self._part(self.truth, 1)

    @functools.cached_property
    def _finer_truth(self) -> Pixels:
        assert self.truth is not None
        return self._finer(self.truth, self._true_picture, self._second_truth)

    def _finer(self, vector: NDArray[np.float64], *parts: Pixels) -> Pixels:
        """The mean of `MORE_PARTS` pictures, the first of which are there."""
        more = (self._part(vector, part) for part in range(len(parts), MORE_PARTS))
        return sum(more, start=sum(parts, start=np.zeros_like(parts[0]))) / np.float32(MORE_PARTS)

    def _part(self, vector: NDArray[np.float64], part: int) -> Pixels:
        return self._renderer.image(vector, seed=self._seed + part * _NEXT_PART, spp=self._spp)

    def flip(self, values: Mapping[str, Value]) -> float:
        """Mean FLIP alone, without the judges' scores."""
        return self._flip(self._true_picture, self._renderer.table.pack(values), self.pictures.mask)

    def reference_flip(self, picture: Pixels) -> float:
        """Mean FLIP of a picture of the judge's and the reference, whose noise is in it."""
        return _difference(picture, self.pictures.reference, self.pictures.mask, judges=False).flip

    def relit(self, values: Mapping[str, Value]) -> list[Difference]:
        """The same under the lights no fit sees."""
        found = []
        for renderer, truth in zip(self._relit_renderers, self.pictures.truth[1:], strict=True):
            picture = self._picture(renderer, renderer.table.pack(values))
            found.append(_difference(truth, picture, self.pictures.mask, judges=False))
        return found

    def parameter_errors(self, values: Mapping[str, Value]) -> dict[str, float]:
        """Largest absolute error of each parameter's components; empty where there is no true value."""
        table = self._renderer.table
        if self.truth is None:
            return {}
        error = np.abs(table.pack(values) - self.truth)
        return {name: float(error[table.slice_of(name)].max()) for name in table.names}

    def true_values(self) -> dict[str, Value]:
        """The truth of every fitted parameter, inside the box of the fit."""
        return {} if self.truth is None else self._renderer.table.unpack(self.truth)

    def _render(self) -> TruePictures:
        scene, spp = self._scene, self._scene.scenario.reference_spp
        seed = _REFERENCE_STREAM + scene.number
        relit = []
        if scene.given:
            reference = read_image(scene.given[0]).pixels
        elif self.truth is None:
            reference = PlainScene(scene.true_files[0]).image(seed=seed, spp=spp)
            relit = [PlainScene(file).image(seed=self._seed, spp=self._spp) for file in scene.true_files[1:]]
        else:
            reference = self._renderer.image(self.truth, seed=seed, spp=spp)
            relit = [self._picture(renderer, self.truth) for renderer in self._relit_renderers]
        truth = (self._true_picture, *relit)
        mask = self._renderer.target_mask()
        floor = _difference(truth[0], reference, mask, judges=False)
        start = _difference(truth[0], self._picture(self._renderer, self._renderer.start), mask, judges=False)
        gap = self._flip(truth[0], self.truth, mask) if scene.given and self.truth is not None else None
        return TruePictures(reference, truth, mask, floor, start, gap)

    def _flip(self, truth: Pixels, vector: NDArray[np.float64], mask: NDArray[np.bool_]) -> float:
        return _difference(truth, self._picture(self._renderer, vector), mask, judges=False).flip

    def _load(self, file: Path) -> Renderer:
        chosen = self._scene.scenario
        return load_renderer(file, SHAPE, model=chosen.model, parameters=chosen.fitted, materials=self._scene.materials)

    def _picture(self, renderer: Renderer, vector: NDArray[np.float64]) -> Pixels:
        return renderer.image(vector, seed=self._seed, spp=self._spp)


def relative_rmse(test: Pixels, truth: Pixels, mask: NDArray[np.bool_]) -> float:
    """Root mean square of the difference over that of the truth, inside the mask."""
    inside, true = test[mask].astype(np.float64), truth[mask].astype(np.float64)
    return float(np.sqrt(np.mean((inside - true) ** 2) / np.mean(true**2)))


@functools.cache
def judges_present() -> bool:
    """Whether a judge's score can be computed here."""
    try:
        require_pycvvdp()
    except MfoError:
        return is_configured()
    return True


def _difference(truth: Pixels, pixels: Pixels, mask: NDArray[np.bool_], *, judges: bool = True) -> Difference:
    true, test = Image(truth, Encoding.LINEAR), Image(pixels, Encoding.LINEAR)
    metrics = compare_images(true, test, mask=mask).metrics
    means = _number(metrics["flip"]), _number(metrics["hdr_flip"]), relative_rmse(pixels, truth, mask)
    if not judges or not judges_present():
        return Difference(*means)
    said = judge_images(true, test)
    return Difference(*means, said.jod, said.hdrvdp3_q_jod)


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
