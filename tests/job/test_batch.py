# SPDX-License-Identifier: Apache-2.0
"""Many job folders: each ends with a status of its own and costs no other."""

from __future__ import annotations

import json
import os
import sys

import pytest

from mfo_backend.cli.main import main
from mfo_backend.job import batch
from mfo_backend.job.batch import is_done, run_one


def folder(path, **files):
    path.mkdir()
    for name, content in files.items():
        (path / f"{name}.json").write_text(json.dumps(content))
    return path


@pytest.mark.parametrize(
    ("result", "done"),
    [({"partial": False}, True), ({"partial": True}, False), ({}, False), ([], False), (None, False)],
)
def test_only_a_whole_result_is_done(tmp_path, result, done):
    assert is_done(folder(tmp_path / "job", result=result)) is done
    assert not is_done(tmp_path)


def test_jobs_that_are_refused_are_named_and_done_ones_left_alone(tmp_path, capsys):
    refused = folder(tmp_path / "refused", request={"schema_version": 99})
    done = folder(tmp_path / "done", request={"schema_version": 99}, result={"partial": False})
    assert main(["batch", str(refused), str(done), str(refused), "--workers", "2", "--json"]) == 2
    (line,) = capsys.readouterr().out.splitlines()
    end = json.loads(line)
    assert (end["job"], end["status"]) == (str(refused), "bad_input")
    assert "schema_version" in end["sentence"]
    assert main(["batch", str(done)]) == 0


def test_a_folder_that_is_no_job_is_refused(tmp_path, capsys):
    assert main(["batch", str(tmp_path)]) == 2
    assert "No request.json" in capsys.readouterr().err


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("import os; os.kill(os.getpid(), 9)", "was killed (SIGKILL); the memory may have run out"),
        ("import os; os.kill(os.getpid(), 11)", "crashed (SIGSEGV); the memory may have run out"),
        ("raise SystemExit(77)", "ended with code 77"),
    ],
)
def test_a_process_that_cannot_say_why_it_ended(tmp_path, monkeypatch, code, words):
    fake = tmp_path / "python"
    fake.write_text(f"#!{sys.executable}\n{code}\n")
    fake.chmod(0o755)
    monkeypatch.setattr(batch.sys, "executable", str(fake))
    end = run_one(str(tmp_path))
    assert end.status == "failed"
    assert words in end.sentence
