# SPDX-License-Identifier: Apache-2.0
"""What `run_job` refuses before it spends time, in the test's own process."""

from __future__ import annotations

import io
import json
import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image as Pillow

from mfo_backend.job.output.progress import EventWriter, finite
from mfo_backend.job.run.run_job import run_job
from mfo_backend.job.run.stop import StopSignal
from mfo_backend.scene.image_file import write_exr
from mfo_backend.types.status import Status


def never(*arguments, **options):
    raise AssertionError("the fit must not begin")


def refusal(job: Path, fitter=never) -> tuple[Status, dict]:
    stream = io.StringIO()
    status = run_job(job, EventWriter(stream=stream), StopSignal(), fitter=fitter)
    (event,) = [json.loads(line) for line in stream.getvalue().splitlines()]
    assert event["event"] == "failed"
    assert event["sentence"].endswith(".")
    assert "\n" not in event["sentence"]
    return status, event


def write_reference(job: Path, change) -> None:
    pixels = np.full((6, 8, 3), 0.5, np.float32)
    change(pixels)
    write_exr(job / "reference.exr", pixels)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda p: p.__setitem__((0, 0, 0), np.nan), "1 pixels with NaN"),
        (lambda p: p.__setitem__((0, 0), np.inf), "1 with infinite values"),
        (lambda p: p.fill(0), "all black"),
    ],
)
def test_a_reference_with_unusable_pixels(job: Path, change, words: str) -> None:
    write_reference(job, change)
    status, event = refusal(job)
    assert status is Status.BAD_INPUT
    assert words in event["sentence"]


def test_a_reference_of_another_size(job: Path) -> None:
    write_exr(job / "reference.exr", np.ones((4, 5, 3), np.float32))
    status, event = refusal(job)
    assert status is Status.BAD_INPUT
    assert event["sentence"].startswith("Reference is 5x4 but the scene renders 8x6: ")


@pytest.mark.parametrize("content", [b"", b"not an image", b"v/1\x01truncated"])
def test_an_unreadable_reference(job: Path, content: bytes) -> None:
    (job / "reference.exr").write_bytes(content)
    status, event = refusal(job)
    assert status is Status.BAD_INPUT
    assert "'reference.exr' cannot be read" in event["sentence"]


def test_the_encoding_is_the_request_s(job: Path, request_data: dict) -> None:
    Pillow.new("RGB", (8, 6), (128, 64, 32)).save(job / "reference.png")
    request_data["reference"] = {"path": "reference.png", "encoding": "srgb"}
    (job / "request.json").write_text(json.dumps(request_data))
    seen = []

    def look(folder, request, reference, view, **options):
        seen.append((reference.encoding.value, reference.pixels[0, 0].tolist(), view.exposure_ev))
        raise MemoryError

    refusal(job, look)
    assert seen == [("srgb", pytest.approx([128 / 255, 64 / 255, 32 / 255]), 1.0)]


def test_without_a_view_a_linear_reference_is_exposed_for(job: Path, request_data: dict) -> None:
    del request_data["view"]
    (job / "request.json").write_text(json.dumps(request_data))
    write_exr(job / "reference.exr", np.full((6, 8, 3), 4.0, np.float32))
    seen = []

    def look(folder, request, reference, view, **options):
        seen.append(view.exposure_ev)
        raise MemoryError

    refusal(job, look)
    assert seen == [pytest.approx(-2.0)]  # 4 becomes 1


def test_a_disk_without_space_is_found_before_the_fit(job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=500_000))
    status, event = refusal(job)
    assert status is Status.BAD_INPUT
    assert "has 0.5 MB left and the results need 1.1 MB: free some space" in event["sentence"]


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="needs a user whom permissions bind")
def test_a_folder_that_cannot_be_written(job: Path) -> None:
    job.chmod(0o555)
    try:
        status, event = refusal(job)
    finally:
        job.chmod(0o755)
    assert status is Status.BAD_INPUT
    assert "cannot be written (Permission denied)" in event["sentence"]


def test_a_folder_that_refuses_files(job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(**options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("mfo_backend.job.folder.job_folder.tempfile.TemporaryFile", refuse)
    status, event = refusal(job)
    assert status is Status.BAD_INPUT
    assert "cannot be written (Permission denied): free some space, change its permissions" in event["sentence"]


def test_json_has_no_nan() -> None:
    nested = {"a": [1.0, float("nan"), (float("inf"), "x")], "b": {"c": -float("inf"), "d": None}}
    assert finite(nested) == {"a": [1.0, None, [None, "x"]], "b": {"c": None, "d": None}}
