# SPDX-License-Identifier: Apache-2.0
"""The last stage for glass. Oracle: FLIP, by another picture, to what the reference shows without noise."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit import traced_flip
from mfo_backend.fit.course import Course
from mfo_backend.fit.picture_judge import PictureJudge
from mfo_backend.fit.settings import FitSettings
from mfo_backend.fit.traced_tiles import TracedTiles
from mfo_backend.metrics.loss import make_loss
from mfo_backend.metrics.tone_mapping import DisplayView
from mfo_backend.types.image import Encoding, Image
from tests.fit.glass import TRUTH, fit, load

OTHER = {"base_color": (0.2, 0.5, 0.7), "roughness": 0.1, "ior": 1.2, "transmission_weight": 0.2}


@pytest.fixture(scope="module")
def blend(tmp_path_factory):
    """A renderer and a maker of pictures that no values give."""
    renderer = load(tmp_path_factory.mktemp("blend"), size=48)
    truths = [renderer.table.pack(values) for values in (TRUTH, OTHER)]
    return renderer, lambda seed, spp: np.mean([renderer.image(x, seed=seed, spp=spp) for x in truths], axis=0)


def test_flip_is_lower_where_no_values_give_the_picture(blend):
    renderer, picture = blend
    reference, clean = picture(5, 32), picture(7, 512)
    flip = make_loss("flip-hdr", Image(clean, Encoding.LINEAR), mask=renderer.target_mask())
    errors = {}
    for preset in ("balanced", "best"):
        result, _ = fit(renderer, reference, preset=preset)
        assert (result.stages[-1].name == traced_flip.FLIP) == (preset == "best")
        assert ("'flip'" in result.notes[-1]) == (preset == "best")  # what was done instead of recorded paths
        found = renderer.image(renderer.table.pack(result.recovered), seed=9, spp=512)
        errors[preset] = flip.value(found)
    assert errors["best"] < 0.99 * errors["balanced"]  # 4 % lower when this was written


def test_the_linear_picture_has_the_slope_of_its_pullback():
    random = np.random.default_rng(0)
    mask = np.zeros((3, 4), bool)
    mask[1:, 1:] = True
    rows = random.normal(size=(6, 3, 1 + 2)).astype(np.float32)

    def whole(values):
        image = np.zeros((*mask.shape, 3), np.float32)
        image[mask] = values
        return image

    at = np.array([0.4, 0.6])
    picture = traced_flip._LinearPicture(rows, at, whole, mask)
    gradient = random.normal(size=(3, 4, 3)).astype(np.float32)
    image, pullback = picture(at)
    np.testing.assert_array_equal(image[mask], rows[..., 0])
    step = np.array([0.5, -0.3])
    moved, _ = picture(at + step)
    gained = float(np.sum((moved - image) * gradient, dtype=np.float64))
    # single precision, sums of 18 numbers of size 1
    assert gained == pytest.approx(step @ pullback(gradient), abs=1e-5)


def test_values_that_are_kept_stay(blend):
    renderer, picture = blend
    from mfo_backend.render.traced_paths import TracedPaths

    mask, reference = renderer.target_mask(), Image(picture(5, 32), Encoding.LINEAR)
    view = DisplayView.for_scene(reference.pixels, mask)
    settings = FitSettings(model="blender_principled", preset="best")
    judge = PictureJudge("flip-hdr", reference, reference.pixels, mask, settings, view, blurred=True)
    tiles = TracedTiles(TracedPaths(renderer), reference.pixels, mask, None, lambda: False)
    course = Course(renderer, ("flip",), lambda event: None, lambda: False, 0.0)
    start, kept = renderer.table.pack(TRUTH), renderer.table.mask_of(["base_color"])
    (end,) = traced_flip.lower_traced_flip(tiles, judge, reference, view, start, kept, course, seed=1)
    np.testing.assert_array_equal(end[kept], start[kept])
    assert np.all(end[~kept] != start[~kept])
    (report,) = course.reports
    assert report.loss_best < report.loss_start


def test_a_large_target_goes_without(blend, monkeypatch):
    renderer, picture = blend
    monkeypatch.setattr(traced_flip, "MOST_PIXELS", 10)
    result, _ = fit(renderer, picture(5, 32), preset="best")
    assert [stage.name for stage in result.stages] == ["scan", "race", "polish"]


def test_the_end_of_the_squares_is_kept_where_flip_is_not_better(blend, monkeypatch):
    renderer, picture = blend
    reference = picture(5, 32)
    squares, _ = fit(renderer, reference)
    monkeypatch.setattr(
        "mfo_backend.fit.fit_transmission.lower_traced_flip", lambda *given: [renderer.table.pack(OTHER)]
    )
    result, _ = fit(renderer, reference, preset="best")
    assert result.recovered == squares.recovered
    assert any("'polish' was kept" in note for note in result.notes)
