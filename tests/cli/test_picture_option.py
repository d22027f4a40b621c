# SPDX-License-Identifier: Apache-2.0
"""What `--reference PATH@KEY=VALUE,...` means."""

from __future__ import annotations

import pytest

from mfo_backend.cli.picture_option import PictureOption, is_plain, picture_option, picture_options
from mfo_backend.types.errors import BadInputError


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("a.exr", PictureOption("a.exr", 1)),
        ("a.exr@frame=3,camera=Side", PictureOption("a.exr", 1, frame=3, camera="Side")),
        ("a@b.exr", PictureOption("a@b.exr", 1)),
        ("me@home/a.exr@frame=-2", PictureOption("me@home/a.exr", 1, frame=-2)),
        ("a.exr@camera=Cam, left,layer=Rim", PictureOption("a.exr", 1, camera="Cam, left", view_layer="Rim")),
        ("a.exr@scene=x=y,exposure=-0.5", PictureOption("a.exr", 1, scene="x=y", exposure=-0.5)),
    ],
)
def test_a_picture_and_what_it_shows(text, meant):
    assert picture_option(text, 1) == meant


def test_a_file_that_exists_is_that_file(tmp_path):
    path = tmp_path / "a.exr@frame=3"
    path.write_bytes(b"")
    assert picture_option(str(path), 1) == PictureOption(str(path), 1)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("a.exr@frane=3", "unknown key 'frane': allowed are frame, camera, scene, layer, exposure"),
        ("a.exr@frame=three", "frame is 'three': it must be a whole number"),
        ("a.exr@exposure=bright", "exposure is 'bright': it must be a number of stops"),
        ("a.exr@frame=1,frame=2", "gives 'frame' twice"),
    ],
)
def test_wrong_words_are_refused(text, sentence):
    with pytest.raises(BadInputError, match=sentence):
        picture_option(text, 1)


def test_left_out_pictures_keep_the_others_numbers():
    kept = picture_options(["a.exr", "b.exr", "c.exr"], [2])
    assert [(picture.number, picture.reference) for picture in kept] == [(1, "a.exr"), (3, "c.exr")]
    with pytest.raises(BadInputError, match="--leave-out 4: the pictures are 1 to 3"):
        picture_options(["a.exr", "b.exr", "c.exr"], [4])
    with pytest.raises(BadInputError, match="leaves no picture"):
        picture_options(["a.exr"], [1])
    assert is_plain(picture_options(["a.exr"], []))
    assert not is_plain(picture_options(["a.exr@frame=1"], []))
