# SPDX-License-Identifier: Apache-2.0
"""What the page on costs says of known points, and what a point counts."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from mfo_backend.render.paths.recorded_image import RecordedImage
from studies.cost.scaling import FEW, SERIES, Point, cost, exponents, page, plot

POINTS = [Point(x, 8 * x, {"evaluation": 1e-5 * x**0.5, "recording": 2e-5 * x}) for x in (100, 400, 1600)]
_note = RecordedImage.note


def test_the_exponents_of_power_laws() -> None:
    assert exponents(POINTS) == "evaluation 0.50, recording 1.00"


def test_the_page_has_points_and_exponents() -> None:
    text = page({"pixels": POINTS})
    assert "Fitted exponents: evaluation 0.50, recording 1.00." in text
    assert "| 400 | 3200 | 0.2 | 8 |" in text
    assert "![pixels](pixels.svg)" in text
    ElementTree.fromstring(plot(SERIES["pixels"], POINTS))


def test_no_evaluation_is_a_remembered_one(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    monkeypatch.setattr(RecordedImage, "note", lambda self, x, answer: made.append(x) or _note(self, x, answer))
    cost(1, 4, size=16, names=FEW)
    assert len({x.tobytes() for x in made}) == len(made) == 1 + 4  # the first is not timed


def test_light_paths_grow_with_pixels_and_rays() -> None:
    few, pixels, rays = (
        cost(1, 2, names=FEW, **more) for more in ({"size": 64, "grid": 2}, {"size": 128, "grid": 2}, {"size": 64})
    )
    # four times the pixels or the rays: but for the silhouette, which a pixel has or has not
    assert pixels.work == pytest.approx(4 * few.work, rel=0.1)
    assert rays.work == pytest.approx(4 * few.work, rel=0.1)
