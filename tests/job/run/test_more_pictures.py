# SPDX-License-Identifier: Apache-2.0
"""Jobs of several pictures: what their folders say, and what is refused before a fit."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.request import MOST_PICTURES, read_request, request_from_json, request_to_json
from mfo_backend.job.run.more_pictures import JobPicture, label, without_repeats
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image


def change(folder: Path, **keys: object) -> None:
    path = folder / "request.json"
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | keys), "utf-8")


@pytest.fixture
def two(job: Path) -> Path:
    """The job with a second picture beside it."""
    inner = job / "more_pictures" / "2"
    shutil.copytree(job, inner)
    change(inner, picture={"number": 2, "name": "side.exr", "frame": 3, "camera": "Side"})
    change(job, picture={"number": 1, "name": "front.exr"}, more_pictures=["more_pictures/2"])
    return job


def test_a_further_picture_is_a_whole_job_of_its_own(two: Path) -> None:
    request = read_request(JobFolder.open(two))
    ((path, more),) = request.more_pictures
    assert path == "more_pictures/2"
    assert (label(request), label(more)) == ("1 (front.exr)", "2 (side.exr)")
    assert (more.picture.frame, more.picture.camera) == (3, "Side")
    assert read_request(JobFolder.open(two / path)) == more
    written = request_to_json(request)
    assert written["more_pictures"] == [path]
    assert request_from_json(written).picture == request.picture


def test_one_picture_says_nothing_of_several(job: Path) -> None:
    written = request_to_json(read_request(JobFolder.open(job)))
    assert "picture" not in written
    assert "more_pictures" not in written


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"more_pictures": ["more_pictures/3"]}, "more_pictures/3/request.json', which is not in the job folder"),
        ({"more_pictures": ["../elsewhere"]}, "leaves the job folder"),
        ({"more_pictures": "more_pictures/2"}, "it must be a list of strings"),
        ({"more_pictures": ["more_pictures/2"] * MOST_PICTURES}, f"at most {MOST_PICTURES} are fitted together"),
        ({"picture": {"number": 0}}, "picture.number is 0: it must be a whole number from 1"),
        ({"picture": {"eye": "left"}}, "unknown key 'eye'"),
    ],
)
def test_wrong_lists_are_refused(two: Path, keys: dict[str, object], sentence: str) -> None:
    change(two, **keys)
    with pytest.raises(BadInputError, match=sentence):
        read_request(JobFolder.open(two))


def test_a_further_picture_has_no_further_ones(two: Path) -> None:
    change(two / "more_pictures" / "2", more_pictures=["meshes"])
    with pytest.raises(BadInputError, match="name all in the first one's"):
        read_request(JobFolder.open(two))


def picture(folder: Path, number: int, level: float) -> JobPicture:
    request = request_from_json(
        json.loads((folder / "request.json").read_text("utf-8")) | {"picture": {"number": number}, "more_pictures": []}
    )
    reference = Image(np.full((6, 8, 3), level, np.float32), Encoding.LINEAR)
    return JobPicture(JobFolder.open(folder), request, reference, DisplayView())


def test_the_same_picture_twice_counts_once_and_it_is_said(two: Path) -> None:
    inner = two / "more_pictures" / "2"
    first, again, other = picture(two, 1, 0.5), picture(inner, 2, 0.5), picture(inner, 3, 0.6)
    kept, notes = without_repeats([first, again, other])
    assert [p.request.picture.number for p in kept] == [1, 3]
    assert notes == ["Picture 2 is picture 1 again, with the same scene: it was left out."]
    with pytest.raises(BadInputError, match="All pictures are the same one"):
        without_repeats([first, again])


def test_one_picture_for_two_scenes_is_kept_and_it_is_said(two: Path) -> None:
    inner = two / "more_pictures" / "2"
    (inner / "scene.xml").write_text('<scene version="3.0.0"><!-- turned --></scene>')
    kept, notes = without_repeats([picture(two, 1, 0.5), picture(inner, 2, 0.5)])
    assert len(kept) == 2
    assert notes == ["Pictures 1 and 2 are the same, but their scenes differ: one of them has a wrong file."]
