# SPDX-License-Identifier: Apache-2.0
"""The names of a job's files are those that docs/reference/job_folder.md lists."""

from __future__ import annotations

from pathlib import Path

import pytest

from mfo_backend.job.folder.job_folder import JobFolder

LISTED = Path(__file__).resolve().parents[3] / "docs" / "reference" / "job_folder.md"


@pytest.mark.parametrize("name", ["request", "progress", "cancel", "result", "partial", "pictures", "report"])
def test_files_are_where_the_reference_says(tmp_path: Path, name: str) -> None:
    path = getattr(JobFolder.open(tmp_path), name)
    assert path.parent == tmp_path.resolve()
    words = {line.split()[0].rstrip("/") for line in LISTED.read_text("utf-8").splitlines() if line[:1].isalpha()}
    assert path.name in words
    assert path.stem == name or name == "report"
