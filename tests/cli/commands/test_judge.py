# SPDX-License-Identifier: Apache-2.0
"""`mfo judge`: the numbers of `mfo compare` under the view of the job, and its pictures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.cli.main import main
from mfo_backend.fit.judge.picture_errors import picture_errors
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip import block_means
from mfo_backend.metrics.flip.flip_error import flip_error
from mfo_backend.report.picture import mask_png
from mfo_backend.scene.image_file import read_image, write_exr
from mfo_backend.types.image import Encoding, Image

from ...job.conftest import job, request_data  # noqa: F401  # fixtures


def test_numbers_and_pictures(job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:  # noqa: F811
    other = tmp_path / "cycles.exr"
    write_exr(other, np.random.default_rng(2).uniform(0.1, 2.0, (6, 8, 3)).astype(np.float32))
    assert main(["judge", str(job), str(other), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    reference, test = read_image(job / "reference.exr"), read_image(other)
    expected = flip_error(reference, test, display=DisplayView(exposure_ev=1.0, gamma=1.0))  # what the request says
    assert answer["metrics"]["flip"] == pytest.approx(expected.mean, rel=1e-6)  # the same code on the same pixels
    found = {p.relative_to(job / "pictures").as_posix() for p in (job / "pictures").rglob("*.p*")}
    small = {"thumbnails/cycles.ppm", "thumbnails/cycles_difference.ppm"}
    assert found == {"cycles.png", "cycles_difference.png", *small}


def test_another_size_is_refused(job: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:  # noqa: F811
    write_exr(tmp_path / "small.exr", np.ones((4, 4, 3), np.float32))
    assert main(["judge", str(job), str(tmp_path / "small.exr"), "--json"]) == 2
    assert "4x4" in capsys.readouterr().out


@pytest.mark.parametrize("side", [1, 2])
def test_errors_are_taken_where_those_of_the_result_are(
    job: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    side: int,
) -> None:
    picture = np.random.default_rng(2).uniform(0.1, 2.0, (6, 8, 3)).astype(np.float32)
    write_exr(tmp_path / "cycles.exr", picture)
    counted = np.zeros((6, 8), bool)
    counted[2:4, 2:6] = True
    (job / "pictures").mkdir(exist_ok=True)
    (job / "pictures" / "counted.png").write_bytes(mask_png(counted))
    monkeypatch.setattr(block_means, "MOST_COUNTED", 8 // side**2)
    assert main(["judge", str(job), str(tmp_path / "cycles.exr"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    reference = read_image(job / "reference.exr").pixels
    view = DisplayView(exposure_ev=1.0, gamma=1.0)  # what the request says
    expected = picture_errors(Image(reference, Encoding.LINEAR), picture, picture, counted, counted, view)
    assert answer["metrics"]["flip"] == pytest.approx(expected["flip"][1], rel=1e-6)
    assert answer["metrics"]["mse"] == pytest.approx(expected["mse"][1], rel=1e-6)


def test_a_mask_of_another_size_is_refused(
    job: Path,  # noqa: F811
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_exr(tmp_path / "cycles.exr", np.ones((6, 8, 3), np.float32))
    (job / "pictures").mkdir(exist_ok=True)
    (job / "pictures" / "counted.png").write_bytes(mask_png(np.ones((3, 4), bool)))
    assert main(["judge", str(job), str(tmp_path / "cycles.exr"), "--json"]) == 2
    assert "mask" in capsys.readouterr().out
