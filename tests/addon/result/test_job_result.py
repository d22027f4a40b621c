# SPDX-License-Identifier: Apache-2.0
"""Reading a job's result: what may be missing, and how large a file may be."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("bpy")

from blender_addon.result import job_result
from blender_addon.result.job_result import JobResultError, read_job_result


@pytest.fixture
def job(tmp_path: Path) -> Path:
    request = {"schema_version": 1, "target": {}}
    result = {"schema_version": 1, "status": "converged", "model": "principled", "recovered": {"roughness": 0.1}}
    for name, data in (("request", request), ("result", result)):
        (tmp_path / f"{name}.json").write_text(json.dumps(data))
    return tmp_path


def test_what_is_missing_is_empty(job: Path) -> None:
    found = read_job_result(job)
    assert (found.recovered, found.image, found.verdict, found.pictures) == ({"roughness": 0.1}, (0, 0), "", ())


def test_a_file_may_be_as_large_as_the_limit(job: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    size = max((job / name).stat().st_size for name in ("request.json", "result.json"))
    monkeypatch.setattr(job_result, "LARGEST_FILE", size)
    assert read_job_result(job).status == "converged"
    monkeypatch.setattr(job_result, "LARGEST_FILE", size - 1)
    with pytest.raises(JobResultError, match="is larger than"):
        read_job_result(job)
