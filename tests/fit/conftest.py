# SPDX-License-Identifier: Apache-2.0
"""A renderer in closed form, so that fits can be tested without Mitsuba: a sphere under one sun, seen from above."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from mfo_backend.render.pictures.pass_counter import PassCounter
from mfo_backend.types.image import Encoding, Image, Pixels
from mfo_backend.types.parameter import Parameter, ParameterTable

SIZE = 24
TABLE = ParameterTable(
    [
        Parameter("base_color", 3, 1e-3, 0.999, (0.5, 0.5, 0.5)),
        Parameter("roughness", 1, 0.2, 1.0, 0.5),
        Parameter("specular", 1, 0.0, 1.0, 0.5),
    ]
)


class SphereRenderer:
    """Lambert plus an isotropic GGX lobe without shadowing. `noise` is the deviation of its seeded pixel noise."""

    model = "sphere"
    graph = None  # no values inside nodes
    table = TABLE

    def __init__(self, start: NDArray[np.float64], noise: float = 0.0) -> None:
        self.start = start
        self.counter = PassCounter()
        self.noise = noise
        self.calls: list[tuple[int, int]] = []  # seed, spp
        y, x = np.mgrid[0:SIZE, 0:SIZE]
        x, y = (x + 0.5) / SIZE * 2.2 - 1.1, (y + 0.5) / SIZE * 2.2 - 1.1
        self._inside = x**2 + y**2 < 1.0
        normal = np.stack([x, y, np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))], axis=-1)
        light = np.array([0.3, -0.4, 0.8660254])
        half = light + np.array([0.0, 0.0, 1.0])
        half /= np.linalg.norm(half)
        self._cos_light = np.maximum(normal @ light, 0.0) * self._inside
        self._cos_half_sq = (normal @ half) ** 2

    @property
    def passes(self) -> float:
        return self.counter.count

    def shade(self, vector: NDArray) -> NDArray:
        alpha_sq = vector[3] ** 4
        lobe = alpha_sq / (np.pi * (self._cos_half_sq * (alpha_sq - 1.0) + 1.0) ** 2)
        shaded = vector[:3] / np.pi + 0.1 * vector[4] * lobe[..., None]
        return 3.0 * shaded * self._cos_light[..., None]

    def image(self, vector: NDArray[np.float64], *, seed: int, spp: int) -> Pixels:
        self.counter.add(1.0)
        self.calls.append((seed, spp))
        noise = self.noise / np.sqrt(spp) * np.random.default_rng(seed).normal(size=(SIZE, SIZE, 3))
        return (self.shade(vector) + noise * self._inside[..., None]).astype(np.float32)

    def image_and_pullback(
        self, vector: NDArray[np.float64], *, seed: int, spp: int
    ) -> tuple[Pixels, Callable[[Pixels], NDArray[np.float64]]]:
        def pullback(gradient: Pixels) -> NDArray[np.float64]:
            self.counter.add(2.0)
            tangents = 1e-20j * np.eye(len(vector))  # complex steps: derivatives to float64 rounding
            return np.array([np.sum(gradient * self.shade(vector + t).imag * 1e20) for t in tangents])

        return self.image(vector, seed=seed, spp=spp), pullback

    def target_mask(self) -> NDArray[np.bool_]:
        return self._inside

    def otherwise_mask(self) -> NDArray[np.bool_]:
        return np.zeros_like(self._inside)

    def reference(self, truth: NDArray[np.float64]) -> Image:
        return Image(self.shade(truth).astype(np.float32), Encoding.LINEAR)


TRUTH = np.array([0.7, 0.2, 0.1, 0.35, 0.8])
START = np.array([0.3, 0.5, 0.4, 0.7, 0.3])


@pytest.fixture
def sphere() -> SphereRenderer:
    return SphereRenderer(START)


@pytest.fixture
def noisy_sphere() -> SphereRenderer:
    return SphereRenderer(START, noise=0.2)


@pytest.fixture
def truth() -> NDArray[np.float64]:
    return TRUTH
