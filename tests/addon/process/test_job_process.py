# SPDX-License-Identifier: Apache-2.0
"""The process wrapper against workers that behave, crash, hang, flood and die; no Blender needed."""

from __future__ import annotations

import os
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from blender_addon.process import job_process
from blender_addon.process.backend_process import LOG, QUEUE_LIMIT
from blender_addon.process.job_process import JobProcess

pytestmark = pytest.mark.skipif(os.name == "nt", reason="fake workers are POSIX scripts")

PRELUDE = """
import json, os, signal, sys, time
def say(**event):
    print(json.dumps(event), flush=True)
def wait_for_cancel():
    for line in sys.stdin:
        if json.loads(line)["cmd"] == "cancel":
            return True
    return False
"""
Start = Callable[..., JobProcess]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Start a fake backend from the body of its script; every process is closed afterwards."""
    started: list[JobProcess] = []

    def run(body: str) -> JobProcess:
        script = tmp_path / "fake_python"
        script.write_text(f"#!{sys.executable}\n{PRELUDE}\n{textwrap.dedent(body)}")
        script.chmod(0o755)
        folder = tmp_path / "Jöb folder"
        folder.mkdir(exist_ok=True)
        started.append(JobProcess(script, folder, root=tmp_path))
        return started[-1]

    yield run
    for process in started:
        process.close(0.1)


def drain(process: JobProcess, seconds: float = 20.0) -> list[dict]:
    events: list[dict] = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        events += process.poll()
        if process.outcome is not None:
            return events + process.poll()
        time.sleep(0.01)
    raise AssertionError(f"still running after {seconds} s, events {events[-3:]}")


def wait_for(process: JobProcess, name: str) -> dict:
    end = time.monotonic() + 20
    while time.monotonic() < end:
        for event in process.poll():
            if event["event"] == name:
                return event
        time.sleep(0.01)
    raise AssertionError(f"no event {name!r}")


def gone(pid: int, seconds: float = 5.0) -> bool:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
        # a killed grandchild stays a zombie where nobody reaps it
        stat = Path(f"/proc/{pid}/stat")
        if stat.exists() and stat.read_text().rsplit(")", 1)[1].split()[0] == "Z":
            return True
        time.sleep(0.02)
    return False


def test_events_arrive_in_order_and_the_last_one_decides(start: Start) -> None:
    process = start("""
        say(event="started", stages=["mse-hdr"], parameters=["roughness"], seconds=0.1)
        say(event="progress", stage="mse-hdr", fraction=0.5)
        say(event="stage_end", stage="mse-hdr", status="stale")
        say(event="unknown-to-us", anything=1)
        say(event="finished", status="stale", sentence="Grüße.", result="result.json")
    """)
    events = drain(process)
    names = [e["event"] for e in events if e["event"] != "progress"]
    assert names == ["started", "stage_end", "unknown-to-us", "finished"]
    assert process.outcome == job_process.Outcome("stale", "Grüße.")


def test_command_line_and_environment(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONHOME", "/nowhere")
    monkeypatch.setenv("PYTHONSTARTUP", "/nowhere")
    monkeypatch.setenv("VIRTUAL_ENV", "/nowhere")
    monkeypatch.setenv("MFO_KEPT", "yes")
    process = start("""
        say(event="hello", argv=sys.argv[1:], cwd=os.getcwd(), env=dict(os.environ), sid=os.getsid(0), pid=os.getpid())
    """)
    hello = wait_for(process, "hello")
    folder = process.folder
    expected = ["-m", "mfo_backend", "run", str(folder), "--progress", "json", "--control", "stdin"]
    assert hello["argv"] == [*expected, "--parent", str(os.getpid())]
    assert hello["cwd"] == str(folder.parent)
    assert hello["env"]["PYTHONPATH"] == str(folder.parent)
    assert hello["env"]["MFO_KEPT"] == "yes"
    assert not {"PYTHONHOME", "PYTHONSTARTUP", "VIRTUAL_ENV"} & set(hello["env"])
    assert hello["sid"] == hello["pid"] == process.pid


@pytest.mark.parametrize(
    ("body", "status", "words"),
    [
        ("raise RuntimeError('broken pipe dream')", "failed", ["failed", "broken pipe dream", "backend.log"]),
        ("print('No module named mitsuba', file=sys.stderr); sys.exit(3)", "setup", ["not installed", "mitsuba"]),
        ("sys.exit(2)", "bad_input", ["could not use its input", "log is empty"]),
        ("sys.exit(0)", "failed", ["without a result"]),
        ("sys.exit(77)", "failed", ["unknown exit code 77"]),
        ("os.kill(os.getpid(), signal.SIGKILL)", "failed", ["SIGKILL", "memory"]),
        ("os.abort()", "failed", ["The backend crashed (SIGABRT)"]),
        ("say(event='failed', status='bad_input', sentence='No camera.'); sys.exit(2)", "bad_input", ["No camera."]),
        ('sys.stdout.write(\'{"event": "finis\'); sys.stdout.flush(); os._exit(1)', "failed", ["The backend failed"]),
    ],
)
def test_every_end_has_a_sentence(start: Start, body: str, status: str, words: list[str]) -> None:
    process = start(body)
    drain(process)
    assert process.outcome is not None
    assert process.outcome.status == status
    for word in words:
        assert word in process.outcome.sentence


def test_noise_between_the_lines_is_ignored(start: Start) -> None:
    process = start("""
        print("WARNING from a library")
        print("[1, 2]"); print('{"no": "event"}'); print('{"event": 3}')
        sys.stdout.buffer.write(b"\\xff\\xfe\\n"); sys.stdout.flush()
        print("x" * 3_000_000)
        say(event="finished", status="stale", sentence="ok")
    """)
    assert [e["event"] for e in drain(process)] == ["finished"]


def test_a_line_written_in_pieces_is_one_event(start: Start) -> None:
    process = start("""
        for piece in ('{"event": "fin', 'ished", "status": "st', 'ale", "sentence": "ok"}', chr(10)):
            sys.stdout.write(piece); sys.stdout.flush(); time.sleep(0.05)
    """)
    assert drain(process) == [{"event": "finished", "status": "stale", "sentence": "ok"}]


def test_a_flood_keeps_the_newest_progress_and_little_memory(start: Start) -> None:
    process = start("""
        line = json.dumps({"event": "progress", "iteration": 0, "padding": "x" * 200})
        for i in range(20000):
            print(line.replace('"iteration": 0', '"iteration": %d' % i))
        for i in range(3000):
            say(event="stage_end", i=i)
        say(event="finished", status="stale", sentence="ok")
    """)
    while process.outcome is None:
        with process.backend.lock:
            assert len(process.backend.events) <= QUEUE_LIMIT
        process._check_end()
        time.sleep(0.01)
    events = process.poll()
    assert len(events) <= QUEUE_LIMIT + 1  # what one tick of the panel has to look at
    assert events[-1] == {"event": "progress", "iteration": 19999, "padding": "x" * 200}
    assert process.outcome.status == "stale"


def test_poll_does_not_wait_for_a_silent_worker(start: Start) -> None:
    process = start("say(event='started'); wait_for_cancel(); say(event='finished', status='cancelled', sentence='ok')")
    wait_for(process, "started")
    assert process.poll() == []  # a poll that waited would stay here: the worker is silent until it is asked to stop
    assert process.outcome is None
    process.cancel()
    assert [event["event"] for event in drain(process)] == ["finished"]


def test_cancel_keeps_what_the_backend_says(start: Start) -> None:
    process = start("""
        say(event="started")
        assert wait_for_cancel()
        say(event="finished", status="cancelled", sentence="Cancelled; the best values so far were kept.")
        sys.exit(4)
    """)
    wait_for(process, "started")
    process.cancel()
    assert process.cancelling
    drain(process, 5)
    assert process.outcome == job_process.Outcome("cancelled", "Cancelled; the best values so far were kept.")
    assert not process.cancelling


def test_a_worker_has_time_for_the_pictures_of_what_it_keeps(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of 1920 x 1080 took 20 seconds on busy cores."""
    process = start("""
        say(event="started")
        signal.signal(signal.SIGTERM, lambda *_: os._exit(1))
        while not os.path.exists("written"): time.sleep(0.01)
        say(event="finished", status="cancelled", sentence="The best values so far were kept.")
        sys.exit(4)
    """)
    wait_for(process, "started")
    process.cancel()
    later = SimpleNamespace(monotonic=lambda: time.monotonic() + 30.0)
    monkeypatch.setattr(job_process, "time", later)
    for _ in range(20):
        process.poll()
        time.sleep(0.01)
    (process.folder.parent / "written").touch()
    drain(process, 10)
    assert process.outcome == job_process.Outcome("cancelled", "The best values so far were kept.")


def test_a_worker_deaf_to_cancel_is_killed_with_its_children(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job_process, "CANCEL_GRACE", 0.2)
    monkeypatch.setattr(job_process, "TERMINATE_GRACE", 0.2)
    process = start("""
        import subprocess
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
        say(event="started", child=child.pid)
        time.sleep(60)
    """)
    child = wait_for(process, "started")["child"]
    process.cancel()
    drain(process, 5)
    assert process.outcome is not None
    assert process.outcome.status == "cancelled"
    assert "did not answer" in process.outcome.sentence
    assert gone(child)


@pytest.mark.parametrize(
    ("files", "body", "words", "kept"),
    [
        ({"partial": 1}, "os.kill(os.getpid(), signal.SIGKILL)", "killed (SIGKILL).*best values so far are kept", 1),
        ({"partial": 1}, "os.abort()", "crashed (SIGABRT).*best values so far are kept", 1),
        ({"partial": 1, "result": 2}, "os.kill(os.getpid(), signal.SIGKILL)", "killed (SIGKILL); the memory", 2),
        ({"partial": 1}, "say(event='failed', status='failed', sentence='A bug.'); sys.exit(1)", "A bug.", None),
        ({}, "os.kill(os.getpid(), signal.SIGKILL)", "killed (SIGKILL); the memory", None),
    ],
    ids=["killed", "crashed", "after its result", "own words", "too early"],
)
def test_the_best_values_of_a_dead_worker_become_its_result(
    start: Start, files: dict[str, int], body: str, words: str, kept: int | None
) -> None:
    write = f"[open(os.path.join(sys.argv[4], n + '.json'), 'w').write(str(v)) for n, v in {files}.items()]\n"
    process = start(write + body)
    drain(process)
    assert process.outcome is not None
    first, _, second = words.partition(".*")
    assert first in process.outcome.sentence
    assert second in process.outcome.sentence
    assert ("kept" in process.outcome.sentence) == (kept == 1)
    result = process.folder / "result.json"
    assert (int(result.read_text()) if result.exists() else None) == kept


@pytest.mark.parametrize(
    "body",
    [
        "say(event='finished', status='stale', sentence='ok')",
        "say(event='failed', status='failed', sentence='A bug.'); sys.exit(1)",
        "say(event='failed', status='cancelled', sentence='Cancelled before.'); sys.exit(4)",
        "os.kill(os.getpid(), signal.SIGKILL)",
    ],
    ids=["done", "failed", "cancelled", "killed"],
)
def test_the_copy_of_the_file_goes_with_the_fit(start: Start, tmp_path: Path, body: str) -> None:
    """It is a whole .blend, for values inside nodes; what else nodes gave stays."""
    graph = tmp_path / "Jöb folder" / "graph"
    graph.mkdir(parents=True)
    for name in ("scene.blend", "positions.npy"):
        (graph / name).write_bytes(b"a file")
    drain(start(body))
    assert [path.name for path in graph.iterdir()] == ["positions.npy"]


def test_a_worker_that_hangs_after_its_last_event_is_ended(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job_process, "EXIT_GRACE", 0.2)
    process = start("say(event='finished', status='stale', sentence='ok'); time.sleep(60)")
    drain(process, 10)
    assert process.outcome == job_process.Outcome("stale", "ok")


def test_a_grandchild_that_holds_the_pipe_does_not_hold_us(start: Start) -> None:
    process = start("""
        import subprocess
        wait = "import os, time\\nwhile not os.path.exists('let go'): time.sleep(0.01)"
        child = subprocess.Popen([sys.executable, "-c", wait])
        say(event="finished", status="stale", sentence="ok")
    """)
    drain(process)
    assert process.outcome == job_process.Outcome("stale", "ok")
    assert process.backend.reader.is_alive()  # the grandchild holds the pipe still
    (process.folder.parent / "let go").touch()
    process.backend.reader.join(10)
    process.backend.process.stdout.close()  # type: ignore[union-attr]


def test_close_ends_a_running_job_at_once(start: Start) -> None:
    process = start("say(event='started'); time.sleep(60)")
    wait_for(process, "started")
    process.close(0.1)
    assert gone(process.pid)
    assert process.outcome is not None


def test_stdin_ends_when_this_process_lets_go(start: Start, tmp_path: Path) -> None:
    process = start("""
        say(event="started")
        cancelled = wait_for_cancel()
        open(sys.argv[4] + "/ended", "w").write(str(cancelled))
    """)
    wait_for(process, "started")
    process.backend.close_stdin()
    drain(process)
    assert (process.folder / "ended").read_text() == "False"


def test_log_holds_stderr(start: Start) -> None:
    process = start("print('a warning', file=sys.stderr); say(event='finished', status='stale', sentence='ok')")
    drain(process)
    assert "a warning" in (process.folder / LOG).read_text()
