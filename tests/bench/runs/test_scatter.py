# SPDX-License-Identifier: Apache-2.0
"""Rows from Dask workers are those of one process, whatever happens to a worker."""

from __future__ import annotations

import os
import signal
import threading
from concurrent.futures import CancelledError
from dataclasses import replace

import pytest

pytest.importorskip("distributed", reason="needs the extra `cluster`")

from mfo_backend.bench.rows.row import Task
from mfo_backend.bench.rows.row_file import RowFile
from mfo_backend.bench.runs.run_bench import all_tasks, run_bench
from mfo_backend.bench.runs.scatter import run_scattered
from mfo_backend.job.batch import run_there
from mfo_backend.job.cluster import Outcome, as_they_come, open_client
from mfo_backend.types.errors import BadInputError, SetupError
from tests.bench.made_up_rows import FakeRecipe, NotingRunner

TASKS = all_tasks(["base", "noise"], ["mfo-hdr", "fast"], 3)


@pytest.fixture(scope="module")
def client():
    with open_client(None, 2) as client:
        yield client


def scatter(folder, client, recipe, *, tasks=TASKS, listener=lambda row: None, stop=lambda: False):
    return run_scattered(tasks, RowFile(folder), client, recipe, listener=listener, should_stop=stop)


def test_rows_are_those_of_one_process(tmp_path, client):
    there, here = tmp_path / "there", tmp_path / "here"
    there.mkdir()
    here.mkdir()
    recipe = FakeRecipe(str(tmp_path))
    assert scatter(there, client, recipe)
    runner = NotingRunner(recipe)

    def with_pictures(task, should_stop):
        return runner(task, should_stop, runner.pictures(task))

    with_pictures.size = 16
    run_bench(TASKS, RowFile(here), with_pictures, machine={"threads": 1}, listener=print, should_stop=lambda: False)
    found = {row.key: row for row in RowFile(there).read()}
    assert found == {row.key: row for row in RowFile(here).read()}
    assert len(RowFile(there).path.read_text().splitlines()) == len(TASKS)


def test_a_killed_worker_costs_no_row(tmp_path, client):
    killed = []

    def kill_one(row):
        if not killed:
            worker = next(iter(client.run(os.getpid).values()))
            killed.append(worker)
            os.kill(worker, signal.SIGKILL)

    assert scatter(tmp_path, client, FakeRecipe(str(tmp_path), seconds=0.2), listener=kill_one)
    rows = RowFile(tmp_path).read()
    assert killed
    assert sorted(row.key for row in rows) == sorted(task.key for task in TASKS)
    assert not any(row.error for row in rows)
    assert len(RowFile(tmp_path).path.read_text().splitlines()) == len(TASKS)


def test_a_task_that_kills_every_worker_is_a_row_with_its_error(tmp_path, client):
    deadly = TASKS[2]
    assert scatter(tmp_path, client, FakeRecipe(str(tmp_path), deadly=deadly), tasks=TASKS[:4])
    errors = {row.key: row.error for row in RowFile(tmp_path).read() if row.error}
    assert errors == {deadly.key: "RuntimeError: Every worker that tried this task has died."}


def test_a_stopped_bench_goes_on_where_it_was(tmp_path, client):
    seen = threading.Event()
    recipe = FakeRecipe(str(tmp_path), seconds=0.05)
    assert not scatter(tmp_path, client, recipe, listener=lambda row: seen.set(), stop=seen.is_set)
    assert 0 < len(RowFile(tmp_path).read()) < len(TASKS)
    assert scatter(tmp_path, client, replace(recipe, seconds=0.0))
    assert len(RowFile(tmp_path).path.read_text().splitlines()) == len(TASKS)


def test_jobs_run_on_workers_too(tmp_path, client):
    (tmp_path / "request.json").write_text('{"schema_version": 99}')
    (end,) = run_there([str(tmp_path)], client, lambda: False)
    assert (end.job, end.status) == (str(tmp_path), "bad_input")


def test_no_scheduler_is_said_in_one_sentence(monkeypatch):
    monkeypatch.setattr("mfo_backend.job.cluster._CONNECT_SECONDS", 0.2)
    with pytest.raises(BadInputError, match="No Dask scheduler answers"), open_client("tcp://127.0.0.1:1", 0):
        pass


class Ended:
    """A future that ended in a result; each try to fetch it meets the next of its ends, and the last one stays."""

    key = "row"

    def __init__(self, *ends):
        self.ends = list(ends)

    def add_done_callback(self, call):
        call(self)

    def exception(self, timeout):
        return None

    def result(self, timeout):
        end = self.ends.pop(0) if len(self.ends) > 1 else self.ends[0]
        if isinstance(end, BaseException):
            raise end
        return end


class Scheduler:
    """A client of another machine's scheduler, which knows these workers."""

    cluster = None

    def __init__(self, **workers):
        self.workers = workers

    def scheduler_info(self):
        return {"workers": self.workers}


def test_a_scheduler_that_is_lost_makes_no_row():
    with pytest.raises(SetupError, match="the same command goes on where it was"):
        next(as_they_come(None, {TASKS[0]: Ended(CancelledError())}, lambda: False))


def test_a_result_that_is_lost_is_waited_for():
    lost = Ended(TimeoutError(), "its row")
    assert list(as_they_come(Scheduler(one={}), {TASKS[0]: lost}, lambda: False)) == [(TASKS[0], Outcome("its row"))]


def test_workers_that_nobody_replaces_are_made_anew(tmp_path, client, monkeypatch):
    """As where one dies while it starts: its nanny lets it go."""

    async def let_go(self, exitcode):
        await self._unregister()

    monkeypatch.setattr("distributed.nanny.Nanny._on_worker_exit", let_go)
    monkeypatch.setattr("mfo_backend.job.cluster.RENEW_SECONDS", 0.5)
    for worker in client.run(os.getpid).values():
        os.kill(worker, signal.SIGKILL)
    assert scatter(tmp_path, client, FakeRecipe(str(tmp_path)), tasks=TASKS[:4])
    assert not any(row.error for row in RowFile(tmp_path).read())


def test_without_workers_it_ends(monkeypatch):
    monkeypatch.setattr("mfo_backend.job.cluster.NO_WORKER_SECONDS", 0.1)
    waiting = Ended("its row")
    waiting.add_done_callback = lambda call: None
    with pytest.raises(SetupError, match="No Dask worker is left"):
        next(as_they_come(Scheduler(), {TASKS[0]: waiting}, lambda: False))


def test_recipes_that_are_equal_share_a_runner(tmp_path):
    assert FakeRecipe(str(tmp_path)) == FakeRecipe(str(tmp_path))
    assert hash(Task("base", 0, "fast")) == hash(Task("base", 0, "fast"))
