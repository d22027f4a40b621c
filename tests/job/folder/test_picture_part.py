# SPDX-License-Identifier: Apache-2.0
"""Which pixels of a reference count under a crop, a mask and its alpha, and what is said of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image as Picture

from mfo_backend.job.folder.checked_object import CheckedObject
from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.picture_part import NO_ALPHA, PicturePart, part_from_json, part_to_json, with_part
from mfo_backend.scene.image_file import read_image, write_png
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

KEYS = ("crop", "mask", "alpha", "region")


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


def test_half_clear_pixels_of_a_display_picture_do_not_count(tmp_path):
    """Over a transparent film a PNG's edges are as bright as the object: *check the camera and the shape* was said."""
    alpha = np.ones((6, 8), np.float32)
    alpha[0], alpha[1] = 0.0, 0.5
    shown = Image(np.ones((6, 8, 3), np.float32), Encoding.SRGB, alpha)
    found, (note,) = with_part(shown, PicturePart(), JobFolder(tmp_path))
    np.testing.assert_array_equal(found.counts, alpha != 0.5)
    assert "(16.7 %)" in note
    faint = replace(shown, alpha=np.full((6, 8), 0.5, np.float32))  # nothing would be left
    for other in (picture(alpha=alpha), faint):  # the first as of an EXR
        found, notes = with_part(other, PicturePart(), JobFolder(tmp_path))
        assert (found.counts, notes) == (None, ())


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


REGION = (0.25, 0.25, 0.75, 0.5)
INSIDE = np.s_[24:48, 24:72]  # of 96 x 96 pixels


def of_region(beside, encoding=Encoding.SRGB, alpha=None):
    """A busy region in a picture of one colour."""
    pixels = np.full((96, 96, 3), beside, np.float32)
    pixels[INSIDE] = np.random.default_rng(1).random((24, 48, 3))
    return Image(pixels, encoding, alpha)


def with_region(image, folder):
    found, notes = with_part(image, PicturePart(region=REGION), JobFolder(folder))
    return found.counts, notes


@pytest.mark.parametrize("beside", [0.0, (0.1, 0.1, 0.5)], ids=["black", "as False Color shows black"])
@pytest.mark.parametrize("encoding", Encoding)
def test_beside_a_render_region_nothing_counts_where_the_picture_is_empty(beside, encoding, tmp_path):
    counts, notes = with_region(of_region(beside, encoding), tmp_path)
    expected = np.zeros((96, 96), bool)
    expected[INSIDE] = True
    assert np.array_equal(counts, expected)
    assert notes == (
        "12.5 % of the reference's pixels count (Render Region); the others have no part in the fit and its verdict.",
    )


def test_what_a_jpeg_blurs_over_the_edge_of_the_region_is_empty(tmp_path):
    Picture.fromarray(np.rint(of_region(0.0).pixels * 255).astype(np.uint8)).save(tmp_path / "a.jpg", quality=60)
    image = read_image(tmp_path / "a.jpg")
    assert image.pixels[20:24, 24:72].max() > 0.02  # it is blurred
    assert with_region(image, tmp_path)[0].sum() == 24 * 48


def test_what_is_transparent_beside_the_region_is_empty_whatever_its_colour(tmp_path):
    alpha = np.zeros((96, 96), np.float32)
    alpha[INSIDE] = 1.0
    image = of_region(np.random.default_rng(2).random((96, 96, 3)), alpha=alpha)
    assert with_region(image, tmp_path)[0].sum() == 24 * 48


def test_a_picture_that_shows_more_than_the_render_region_counts_as_a_whole(tmp_path):
    image = of_region(0.0, Encoding.LINEAR)
    image.pixels[70:80, 10:30] = 0.01  # two per cent of what is beside
    counts, notes = with_region(image, tmp_path)
    assert counts is None
    assert notes == ("Render Region is on, and the reference shows more than the region: all of it counts.",)


def test_a_render_region_goes_through_json():
    part = PicturePart(region=REGION)
    assert part_from_json(CheckedObject(part_to_json(part), "reference", KEYS)) == part
    with pytest.raises(BadInputError, match=r"The region is 50 %, 0 %, 50 %, 100 %"):
        PicturePart(region=(0.5, 0.0, 0.5, 1.0))
