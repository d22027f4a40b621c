# SPDX-License-Identifier: Apache-2.0
"""Which pixels of a reference count under a crop, a mask and its alpha, and what is said of it."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.job.folder.checked_object import CheckedObject
from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.picture_part import NO_ALPHA, PicturePart, part_from_json, part_to_json, with_part
from mfo_backend.scene.image_file import write_png
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

KEYS = ("crop", "mask", "alpha")


def picture(height=6, width=8, alpha=None):
    return Image(np.ones((height, width, 3), np.float32), Encoding.LINEAR, alpha)


def test_pixels_whose_centre_is_in_the_rectangle_count(tmp_path):
    found, notes = with_part(picture(), PicturePart((0.25, 0.5, 0.75, 1.0)), JobFolder(tmp_path))
    expected = np.zeros((6, 8), bool)
    expected[3:, 2:6] = True
    assert np.array_equal(found.counts, expected)
    assert notes == (
        "25 % of the reference's pixels count (crop); the others have no part in the fit and its verdict.",
    )


def test_all_of_the_picture_counts_without_a_word(tmp_path):
    found, notes = with_part(picture(), PicturePart(), JobFolder(tmp_path))
    assert found.counts is None
    assert notes == ()


def test_white_of_a_mask_counts_and_another_size_is_scaled(tmp_path):
    mask = np.zeros((3, 4, 3), np.float32)
    mask[:, 2:] = 1.0
    write_png(tmp_path / "mask.png", mask)
    found, notes = with_part(picture(), PicturePart(mask="mask.png"), JobFolder(tmp_path))
    assert np.array_equal(found.counts, np.arange(8)[None, :].repeat(6, 0) >= 4)
    assert notes[0] == "The mask is 4x3 pixels and the reference 8x6: it was scaled to that."


def test_mask_crop_and_alpha_all_have_to_agree(tmp_path):
    write_png(tmp_path / "mask.png", np.tile(np.arange(8)[None, :, None] < 5, (6, 1, 3)).astype(np.float32))
    alpha = np.ones((6, 8), np.float32)
    alpha[0] = 0.5
    part = PicturePart((0.5, 0.0, 1.0, 1.0), "mask.png", alpha=True)
    found, notes = with_part(picture(alpha=alpha), part, JobFolder(tmp_path))
    assert np.argwhere(found.counts).tolist() == [[row, 4] for row in range(1, 6)]
    assert "(crop, mask, alpha)" in notes[-1]


def test_a_reference_without_alpha_says_so(tmp_path):
    found, notes = with_part(picture(), PicturePart(alpha=True), JobFolder(tmp_path))
    assert found.counts is None
    assert notes == (NO_ALPHA,)


def test_a_black_mask_is_refused(tmp_path):
    write_png(tmp_path / "mask.png", np.zeros((6, 8, 3), np.float32))
    with pytest.raises(BadInputError, match=r"Nothing of the reference is left \(mask\)"):
        with_part(picture(), PicturePart(mask="mask.png"), JobFolder(tmp_path))


@pytest.mark.parametrize("crop", [(0.5, 0.0, 0.2, 1.0), (0.0, 0.4, 1.0, 0.4), (-0.1, 0.0, 1.0, 1.0)])
def test_a_rectangle_has_its_edges_in_order(crop):
    with pytest.raises(BadInputError, match="left must be below right"):
        PicturePart(crop)


def test_json_holds_what_differs_from_the_whole_picture():
    part = PicturePart((0.0, 0.1, 1.0, 0.9), "mask.png", alpha=True)
    assert part_to_json(PicturePart()) == {}
    assert part_from_json(CheckedObject(part_to_json(part), "reference", KEYS)) == part
    assert part_from_json(CheckedObject({}, "reference", KEYS)) == PicturePart()


@pytest.mark.parametrize("crop", ["all", [0, 1], [0.0, 0.0, 1.0, "1"], [0.0, 0.0, 1.0, 2.0]])
def test_json_of_a_wrong_crop_is_refused(crop):
    with pytest.raises(BadInputError, match="crop"):
        part_from_json(CheckedObject({"crop": crop}, "reference", KEYS))
