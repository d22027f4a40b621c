# SPDX-License-Identifier: Apache-2.0
"""How far recovered values are from the true ones, seen in pictures no fit has used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..metrics.compare import compare_images
from ..render.renderer import Renderer, load_renderer
from ..types.image import Encoding, Image, Pixels
from ..types.parameter import Value
from .scene import SHAPE, BenchScene

# far from each other and from the seeds of fits, which are the scenes' numbers and those ^ VERIFY_STREAM
_REFERENCE_STREAM, _JUDGE_STREAM = 0x0BEF0000, 0x70D6E000
JUDGE_SPP = 256


@dataclass(frozen=True)
class Difference:
    """Means over the object."""

    flip: float
    hdr_flip: float
    relative_rmse: float


class Judge:
    """Renders a scene's reference and judges values against its truth."""

    def __init__(self, scene: BenchScene) -> None:
        self._scene = scene
        self._renderer = self._load(scene.file)
        self._relit = self._load(scene.relit)
        self._seed = _JUDGE_STREAM + scene.number
        table = self._renderer.table
        self.truth = table.clip(table.pack(scene.truth))
        self._mask = self._renderer.target_mask()
        self._true = self._picture(self._renderer, self.truth)
        self._relit_true = self._picture(self._relit, self.truth)
        pixels = self._renderer.image(
            self.truth, seed=_REFERENCE_STREAM + scene.number, spp=scene.scenario.reference_spp
        )
        self.reference = Image(pixels, Encoding.LINEAR)
        self.floor = self._difference(pixels)
        self.start = self._difference(self._picture(self._renderer, self._renderer.start))

    def difference(self, values: Mapping[str, Value]) -> Difference:
        """Of the pictures of these values and of the true ones, under the same random numbers."""
        return self._difference(self._picture(self._renderer, self._renderer.table.pack(values)))

    def relit_relative_rmse(self, values: Mapping[str, Value]) -> float:
        """The same under the light no fit sees."""
        picture = self._picture(self._relit, self._relit.table.pack(values))
        return relative_rmse(picture, self._relit_true, self._mask)

    def parameter_errors(self, values: Mapping[str, Value]) -> dict[str, float]:
        """Largest absolute error of each parameter's components."""
        table = self._renderer.table
        error = np.abs(table.pack(values) - self.truth)
        return {name: float(error[table.slice_of(name)].max()) for name in table.names}

    def true_values(self) -> dict[str, Value]:
        """The truth of every fitted parameter, inside the box of the fit."""
        return self._renderer.table.unpack(self.truth)

    def _load(self, file: Path) -> Renderer:
        return load_renderer(file, SHAPE, model="mitsuba_principled", parameters=self._scene.scenario.fitted)

    def _picture(self, renderer: Renderer, vector: NDArray[np.float64]) -> Pixels:
        return renderer.image(vector, seed=self._seed, spp=JUDGE_SPP)

    def _difference(self, pixels: Pixels) -> Difference:
        metrics = compare_images(
            Image(self._true, Encoding.LINEAR), Image(pixels, Encoding.LINEAR), mask=self._mask
        ).metrics
        return Difference(
            _number(metrics["flip"]), _number(metrics["hdr_flip"]), relative_rmse(pixels, self._true, self._mask)
        )


def relative_rmse(test: Pixels, truth: Pixels, mask: NDArray[np.bool_]) -> float:
    """Root mean square of the difference over that of the truth, inside the mask."""
    inside, true = test[mask].astype(np.float64), truth[mask].astype(np.float64)
    return float(np.sqrt(np.mean((inside - true) ** 2) / np.mean(true**2)))


def _number(value: float | None) -> float:
    return float("nan") if value is None else value
