# SPDX-License-Identifier: Apache-2.0
"""A job folder appears whole or not at all, and never replaces what is not ours."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path
from typing import Any

import pytest

from blender_addon.export.files.job_folder import new_job_folder
from blender_addon.export.findings import ExportError


def fill(partial: Path, text: str = "{}") -> None:
    (partial / "request.json").write_text(text)
    (partial / "meshes").mkdir()


OURS = json.dumps({"generator": {"name": "material_fit_mfo"}})


def test_appears_whole(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "job"
    with new_job_folder(folder) as partial:
        fill(partial)
        assert not folder.exists()
    assert sorted(path.name for path in folder.iterdir()) == ["meshes", "request.json"]
    assert [path.name for path in folder.parent.iterdir()] == ["job"]


def test_failure_leaves_nothing(tmp_path: Path) -> None:
    def stop() -> None:
        with new_job_folder(tmp_path / "new" / "er" / "job") as partial:
            fill(partial)
            raise RuntimeError("stop")

    with pytest.raises(RuntimeError, match="stop"):
        stop()
    assert list(tmp_path.iterdir()) == []


def test_earlier_job_is_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "job"
    with new_job_folder(folder) as partial:
        fill(partial, OURS)
    (folder / "result.json").write_text("{}")
    (folder / "reference.exr").write_text("")
    with new_job_folder(folder) as partial:
        fill(partial, OURS)
    assert not (folder / "result.json").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["job"]


def test_failure_keeps_the_earlier_job(tmp_path: Path) -> None:
    folder = tmp_path / "job"
    with new_job_folder(folder) as partial:
        fill(partial, OURS)
    with pytest.raises(ExportError, match="disk is full"), new_job_folder(folder):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert (folder / "request.json").read_text() == OURS
    assert [path.name for path in tmp_path.iterdir()] == ["job"]


@pytest.mark.parametrize("names", [["holiday.jpg"], ["request.json"], ["request.json", "thesis.txt"]])
def test_foreign_folder_is_refused(names: list[str], tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    for name in names:
        (folder / name).write_text(OURS if len(names) == 2 else "{}")
    sentence = "holds other files than a job; choose an empty or a new folder"
    with pytest.raises(ExportError, match=sentence), new_job_folder(folder):
        pytest.fail("must not start")
    assert sorted(path.name for path in folder.iterdir()) == sorted(names)


def test_file_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "job").write_text("")
    with pytest.raises(ExportError, match="is a file; choose a folder"), new_job_folder(tmp_path / "job"):
        pytest.fail("must not start")


@pytest.mark.parametrize(
    ("number", "sentence"),
    [(errno.ENOSPC, "The disk is full"), (errno.EACCES, "cannot be written: choose a folder you may write to"),
     (errno.EROFS, "cannot be written: choose a folder you may write to"), (errno.EIO, "Input/output error")],
)  # fmt: skip
def test_what_the_system_says(number: int, sentence: str, tmp_path: Path, monkeypatch: Any) -> None:
    def refuse(*_: Any, **__: Any) -> str:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("tempfile.mkdtemp", refuse)
    with pytest.raises(ExportError, match=sentence), new_job_folder(tmp_path / "job"):
        pytest.fail("must not start")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/proc/version").exists(), reason="needs a folder nobody may write to")
def test_folder_that_cannot_be_written() -> None:
    with pytest.raises(ExportError, match="cannot be written"), new_job_folder(Path("/proc/job")):
        pytest.fail("must not start")
