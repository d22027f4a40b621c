# SPDX-License-Identifier: Apache-2.0
"""Where pictures lie on a sheet."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mfo_backend.render.camera.primary_rays import TILE
from mfo_backend.render.sheet.contact_sheet import APART, ContactSheet

sizes = st.lists(st.tuples(st.integers(1, 40), st.integers(1, 40)), min_size=1, max_size=4)


def sheet_of(given_sizes):
    gains = tuple(0.5 + number for number in range(len(given_sizes)))
    return ContactSheet(tuple(given_sizes), gains, tuple(map(str, range(len(gains)))))


@given(sizes)
def test_what_is_put_on_a_sheet_is_found_there(given_sizes):
    sheet, rng = sheet_of(given_sizes), np.random.default_rng(0)
    pictures = [rng.random((*size, 3), np.float32) for size in given_sizes]
    whole = sheet.radiance(pictures)
    assert whole.shape == (*sheet.shape, 3)
    for number, picture in enumerate(pictures):
        np.testing.assert_allclose(sheet.picture(whole, number), picture, rtol=1e-6)
        own = np.arange(picture.shape[0] * picture.shape[1])
        on_sheet = sheet.on_sheet(own, number)
        np.testing.assert_array_equal(
            whole.reshape(-1, 3)[on_sheet], (picture * np.float32(sheet.gains[number])).reshape(-1, 3)
        )
        assert (sheet.numbers(on_sheet) == number).all()
    between = sheet.numbers(np.arange(whole.shape[0] * whole.shape[1])) == -1
    assert not whole.reshape(-1, 3)[between].any()


@given(sizes)
def test_parts_are_told_apart_whatever_their_order(given_sizes):
    sheet, rng = sheet_of(given_sizes), np.random.default_rng(1)
    pixels = rng.permutation(sheet.shape[0] * sheet.shape[1])
    found = np.zeros(len(pixels), bool)
    for number, chosen, own in sheet.parted(pixels):
        np.testing.assert_array_equal(sheet.on_sheet(own, number), pixels[chosen])
        found[chosen] = True
    assert found.sum() == sum(height * width for height, width in given_sizes)


def test_no_tile_and_no_filter_of_an_eye_sees_two_pictures():
    sheet = sheet_of([(5, 7), (30, 17)])
    first, second = (sheet.on_sheet(np.array([0, width - 1]), n) for n, (_, width) in enumerate(sheet.sizes))
    columns = np.concatenate([first, second]) % sheet.shape[1]
    assert APART % TILE == 0
    assert columns[0] % TILE == columns[2] % TILE == 0
    assert columns[2] - columns[1] > APART
