# SPDX-License-Identifier: Apache-2.0
"""Errors of the pixels that count, against whole maps of the metrics."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.judge.picture_errors import picture_errors
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip import block_means as blocks
from mfo_backend.metrics.flip.exposure_range import lit_exposures
from mfo_backend.metrics.flip.flip_error import flip_error
from mfo_backend.metrics.flip.hdr_flip import hdr_flip_map
from mfo_backend.types.image import Encoding, Image

HEIGHT, WIDTH = 90, 110
MASK = np.hypot(*(np.indices((HEIGHT, WIDTH)) - np.array([[[40]], [[60]]]))) < 25
VIEW = DisplayView(exposure_ev=0.5)


def pictures(*, even: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    reference = rng.uniform(0.5 if even else 0.05, 0.5 if even else 1.5, (HEIGHT, WIDTH, 3)).astype(np.float32)
    return reference, reference * np.float32(1.4), (reference + rng.normal(0, 0.02, reference.shape)).astype(np.float32)


@pytest.mark.parametrize("display", [None, VIEW])
@pytest.mark.parametrize("encoding", [Encoding.LINEAR, Encoding.SRGB])
def test_means_of_whole_maps(encoding: Encoding, display: DisplayView | None) -> None:
    reference, start, result = pictures()
    linear = encoding is Encoding.LINEAR
    view = display or (DisplayView.for_scene(reference, MASK) if linear else DisplayView())
    seen = Image(reference if linear else VIEW.display(reference), encoding)
    found = picture_errors(seen, start, result, MASK, MASK, display)
    assert set(found) == ({"flip", "mse", "hdr_flip"} if linear else {"flip", "mse"})
    for k, picture in enumerate((start, result)):
        flips = flip_error(seen, Image(picture, Encoding.LINEAR), display=view).map
        assert found["flip"][k] == pytest.approx(flips[MASK].mean(), rel=1e-5)  # float32 maps
        shown = picture if linear else view.display(picture)
        assert found["mse"][k] == pytest.approx(np.square(shown - seen.pixels)[MASK].mean(), rel=1e-5)
        if linear:
            hdr = hdr_flip_map(reference, picture, exposures=lit_exposures(reference, MASK))
            assert found["hdr_flip"][k] == pytest.approx(hdr[MASK].mean(), rel=1e-3)  # computed in float32


def test_what_does_not_count_does_not_matter() -> None:
    reference, start, result = pictures()
    far = np.ones_like(MASK)
    far[4:77, 24:97] = False  # further than the 11 pixels that FLIP looks around
    other = np.where(far[..., None], np.float32(7.0), result)
    image = Image(reference, Encoding.LINEAR)
    found, expected = (picture_errors(image, start, picture, MASK, MASK, VIEW) for picture in (other, result))
    assert found == expected
    everything = np.ones_like(MASK)
    assert picture_errors(image, start, other, MASK, everything, VIEW)["flip"][1] > 5 * expected["flip"][1]


def test_many_pixels_are_compared_at_a_fraction_of_their_size(monkeypatch: pytest.MonkeyPatch) -> None:
    reference, start, result = pictures(even=True)
    image = Image(reference, Encoding.LINEAR)
    whole = picture_errors(image, start, result, MASK, MASK, VIEW)
    monkeypatch.setattr(blocks, "MOST_COUNTED", np.count_nonzero(MASK) // 9 + 1)
    found = picture_errors(image, start, result, MASK, MASK, VIEW)
    # the start is 1.4 times as bright in every pixel, and the result has noise alone: a third of its deviation is left.
    # 240 blocks of three channels
    assert found["mse"][1] == pytest.approx(whole["mse"][1] / 9, rel=0.15)
    assert found["flip"][1] < 0.6 * whole["flip"][1]
    assert found["flip"][0] == pytest.approx(whole["flip"][0], rel=1e-3)


def test_blocks_are_those_of_the_whole_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    reference, start, result = pictures()
    counted = np.roll(MASK, (16, 15), (0, 1))  # whose box begins within a block
    monkeypatch.setattr(blocks, "MOST_COUNTED", np.count_nonzero(counted) // 4 + 1)
    found = picture_errors(Image(reference, Encoding.LINEAR), start, result, counted, counted, VIEW)
    seen = [blocks.block_means(Image(picture, Encoding.LINEAR), 2) for picture in (reference, result)]
    whole = flip_error(*seen, display=VIEW).map[blocks.full_blocks(counted, 2)].mean()
    assert found["flip"][1] == pytest.approx(whole, rel=1e-5)
