# SPDX-License-Identifier: Apache-2.0
"""The worker as a real child process: protocol, every way to stop it, and how it ends."""

from __future__ import annotations

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.output.progress import EventWriter
from mfo_backend.job.run import stop
from mfo_backend.render.pictures import interruptible
from mfo_backend.types.event import Started
from mfo_backend.types.status import Status

STOP_SECONDS = 1.0  # the promise of docs/reference/job_folder.md
BUSY_SECONDS = 30.0  # what a busy machine may make of it; a fit that does not stop would take longer
ENDLESS = {"iterations": 10_000, "seconds": 0.02}
posix_only = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


def events_of(text: str) -> list[dict]:
    return [json.loads(line) for line in text.splitlines()]


def wait_for_event(child: subprocess.Popen, name: str) -> dict:
    assert child.stdout is not None
    assert child.stderr is not None
    while line := child.stdout.readline():
        event = json.loads(line)
        if event["event"] == name:
            return event
    raise AssertionError(f"no {name}: {child.stderr.read()}")


def test_the_waits_of_a_stop_fit_into_the_promised_second() -> None:
    assert stop.POLL_SECONDS + stop.LOADING_GRACE < STOP_SECONDS
    assert stop.POLL_SECONDS + interruptible.PATIENCE_SECONDS + 2 * interruptible.POLL_SECONDS < STOP_SECONDS


def assert_stops_with_result(child: subprocess.Popen, job: Path) -> None:
    last = wait_for_event(child, "finished")
    assert last["status"] == "cancelled"
    assert child.wait(BUSY_SECONDS) == 4
    result = json.loads((job / "result.json").read_text("utf-8"))
    assert result["partial"] is True
    assert result["status"] == "cancelled"
    assert 0 < len(result["stages"][0]["curve"]) < ENDLESS["iterations"]
    assert result["recovered"]["roughness"] < 0.5


def test_stdout_carries_the_protocol_alone(start_worker, job: Path) -> None:
    child = start_worker("--progress", "json")
    out, err = child.communicate(timeout=60)
    events = events_of(out)
    assert child.returncode == 0, err
    assert [e["event"] for e in events if e["event"] != "preview"] == [
        "started",
        *["progress"] * 5,
        "stage_end",
        "finished",
    ]
    assert events[0] == {"event": "started", "stages": ["mse-hdr"], "parameters": ["roughness"], "seconds": 0.0}
    progress = [e for e in events if e["event"] == "progress"]
    assert progress[2] | {"loss": 0, "best": 0} == {
        "event": "progress",
        "stage": "mse-hdr",
        "stage_index": 0,
        "stage_count": 1,
        "iteration": 2,
        "loss": 0,
        "best": 0,
        "fraction": 0.4,
        "seconds": 0.0,
        "remaining_seconds": None,  # the fake says NaN, which JSON does not know
    }
    assert "a library prints" in err
    assert "native code writes" in err
    assert (job / "progress.jsonl").read_text("utf-8") == out


def test_a_finished_job_leaves_pictures_report_and_result(start_worker, job: Path) -> None:
    out, err = start_worker("--progress", "json").communicate(timeout=60)
    assert events_of(out)[-1] == {
        "event": "finished",
        "status": "stale",
        "sentence": "The best loss did not improve for ten iterations.",
        "result": "result.json",
    }, err
    result = json.loads((job / "result.json").read_text("utf-8"))
    assert result["schema_version"] == 1
    assert result["recovered"] == {"roughness": pytest.approx(0.45), "base_color": [0.25, 0.5, 0.75]}
    assert result["errors"] == {"flip": [0.2, 0.1], "mse": [0.1, None]}  # infinity is not JSON
    assert result["stages"][0]["curve"][1] == [1, 0.05, 0.05, 0.01, 3.0]
    assert result["versions"]["variant"] == "fake_variant"
    assert result["notes"] == ["Light 'Sun' <b>: specular factor is ignored."]
    assert result["partial"] is False
    names = {path.name for path in (job / "pictures").iterdir()}
    pictures = ("reference", "start", "result", "difference", "curve", "counted")
    assert names == {"result.exr", "thumbnails", *(f"{name}.png" for name in pictures)}
    small = {path.name for path in (job / "pictures" / "thumbnails").iterdir()}
    assert small == {f"{name}.ppm" for name in pictures[:4]}  # none of the picture on the way is left
    assert "Glaze · Vase" in (job / "index.html").read_text("utf-8")
    assert not [path for path in job.rglob("*") if path.suffix == ".tmp"]


@pytest.mark.parametrize("is_cancelled", [False, True])
def test_the_copy_of_the_file_goes_with_the_result(start_worker, job: Path, is_cancelled: bool) -> None:
    (job / "graph").mkdir()
    (job / "graph" / "scene.blend").write_bytes(b"a whole .blend")
    child = start_worker("--progress", "json", plan=ENDLESS if is_cancelled else {})
    wait_for_event(child, "progress")
    assert is_cancelled <= (job / "graph" / "scene.blend").exists()  # while it runs
    if is_cancelled:
        (job / "cancel").touch()
    child.communicate(timeout=60)
    assert list((job / "graph").iterdir()) == []


def test_a_second_run_in_the_folder_replaces_the_first(start_worker, job: Path) -> None:
    start_worker("--progress", "none").communicate(timeout=60)
    (job / "cancel").touch()
    child = start_worker("--progress", "none", plan=ENDLESS)
    child.communicate(timeout=60)
    assert child.returncode == 4
    assert not (job / "cancel").exists()  # it was answered, so a third run is not cancelled by it
    child = start_worker("--progress", "none")
    child.communicate(timeout=60)
    assert child.returncode == 0
    assert json.loads((job / "result.json").read_text("utf-8"))["status"] == "stale"


def test_the_cancel_file_stops_it(start_worker, job: Path) -> None:
    child = start_worker("--progress", "json", plan=ENDLESS)
    wait_for_event(child, "progress")
    (job / "cancel").touch()
    assert_stops_with_result(child, job)


@pytest.mark.parametrize("noise", ["", "no json\n", '["cmd"]\n{"cmd": "dance"}\n'])
def test_a_command_on_stdin_stops_it(start_worker, job: Path, noise: str) -> None:
    child = start_worker("--progress", "json", "--control", "stdin", plan=ENDLESS, stdin=subprocess.PIPE)
    wait_for_event(child, "progress")
    child.stdin.write(noise + '{"cmd": "cancel"}\n')
    child.stdin.flush()
    assert_stops_with_result(child, job)


def test_the_end_of_stdin_stops_it(start_worker, job: Path) -> None:
    child = start_worker("--progress", "json", "--control", "stdin", plan=ENDLESS, stdin=subprocess.PIPE)
    wait_for_event(child, "progress")
    child.stdin.close()
    assert_stops_with_result(child, job)


@posix_only
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_it(start_worker, job: Path, number: signal.Signals) -> None:
    child = start_worker("--progress", "json", plan=ENDLESS)
    wait_for_event(child, "progress")
    child.send_signal(number)
    assert_stops_with_result(child, job)
    assert "Traceback" not in child.stderr.read()


@posix_only
def test_a_second_signal_ends_a_deaf_fit_at_once(start_worker) -> None:
    child = start_worker("--progress", "json", plan={**ENDLESS, "deaf": True})
    wait_for_event(child, "progress")
    child.send_signal(signal.SIGTERM)
    time.sleep(0.3)
    assert child.poll() is None
    child.send_signal(signal.SIGTERM)
    assert child.wait(BUSY_SECONDS) == 4


def test_a_cancel_while_loading_ends_at_once(start_worker, job: Path) -> None:
    plan = {"load_seconds": 10 * BUSY_SECONDS}
    child = start_worker("--progress", "json", "--control", "stdin", plan=plan, stdin=subprocess.PIPE)
    child.stdin.write('{"cmd": "cancel"}\n')
    child.stdin.flush()
    out, _ = child.communicate(timeout=BUSY_SECONDS)
    assert events_of(out) == [
        {
            "event": "failed",
            "status": "cancelled",
            "sentence": "Cancelled before the fit had begun; nothing was changed.",
        }
    ]
    assert child.returncode == 4
    assert not (job / "result.json").exists()


PARENT = """
import subprocess, sys
child = subprocess.Popen([sys.executable, *sys.argv[1:]], stdin=subprocess.PIPE)
child.wait()
"""


@posix_only
@pytest.mark.parametrize("deaf", [False, True])
def test_it_ends_when_its_parent_is_killed(job: Path, deaf: bool) -> None:
    (job / "fake.json").write_text(json.dumps({**ENDLESS, "deaf": deaf}))
    worker = Path(__file__).parents[1] / "fake_worker.py"
    root = str(Path(__file__).resolve().parents[3])
    # the parent hands on its own stdout, which stays open, and --parent alone must do
    code = PARENT.replace("sys.argv[1:]]", "sys.argv[1:], '--parent', str(__import__('os').getpid())]")
    parent = subprocess.Popen(
        [sys.executable, "-c", code, str(worker), str(job), "--progress", "json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": root, "MFO_TEST_ORPHAN_GRACE": "1"},
    )
    wait_for_event(parent, "progress")
    parent.kill()
    parent.wait()
    # until the worker, which holds the other end, is really gone; a deaf one would go on for minutes
    assert parent.stdout is not None
    assert parent.stderr is not None
    rest = parent.stdout.read()
    log = parent.stderr.read()
    parent.stdout.close()
    parent.stderr.close()
    if deaf:
        assert not (job / "result.json").exists()
    else:
        assert "stopped because the program that started this job has ended" in log
        assert events_of(rest)[-1]["status"] == "cancelled"
        assert json.loads((job / "result.json").read_text("utf-8"))["partial"] is True


@pytest.mark.parametrize(
    ("problem", "code", "status", "sentence"),
    [
        ("bad_input", 2, "bad_input", "Unknown parameter 'rough': this material has roughness."),
        ("setup", 3, "setup", "No LLVM library was found: get one."),
        ("bug", 1, "failed", "The fit failed (ZeroDivisionError: a bug): the log holds the details."),
        ("import", 3, "setup", "A package cannot be loaded (libgone.so: cannot allocate memory): run `mfo doctor`"),
        ("memory", 1, "failed", "The fit ran out of memory: lower the resolution or the samples per pixel."),
        ("space", 2, "bad_input", "No space left on device"),
    ],
)
def test_a_failure_is_one_sentence_and_a_code(
    start_worker, job: Path, problem: str, code: int, status: str, sentence: str
) -> None:
    before = sorted(path.name for path in job.iterdir())
    child = start_worker("--progress", "json", plan={"problem": problem})
    out, err = child.communicate(timeout=60)
    assert child.returncode == code
    (event,) = events_of(out)
    assert event["event"] == "failed"
    assert event["status"] == status
    assert sentence in event["sentence"]
    assert "\n" not in event["sentence"]
    assert ("Traceback" in err) == (problem not in ("bad_input", "setup"))
    assert sorted(path.name for path in job.iterdir()) == sorted({*before, "fake.json"})


def test_bad_input_leaves_the_folder_as_it_was(start_worker, job: Path) -> None:
    (job / "scene.xml").unlink()
    start = start_worker("--progress", "json")
    before = {path: path.stat().st_mtime_ns for path in job.rglob("*")}
    out, _ = start.communicate(timeout=60)
    assert start.returncode == 2
    assert "scene.xml" in events_of(out)[-1]["sentence"]
    assert {path: path.stat().st_mtime_ns for path in job.rglob("*")} == before


@posix_only
def test_it_goes_on_when_nobody_reads_its_stdout(start_worker, job: Path) -> None:
    child = start_worker("--progress", "json", plan={"iterations": 50, "seconds": 0.01})
    wait_for_event(child, "progress")
    child.stdout.close()
    assert child.wait(60) == 0
    assert json.loads((job / "result.json").read_text("utf-8"))["status"] == "stale"


@posix_only
def test_a_full_disk_for_progress_does_not_cost_the_result(job: Path, capsys: pytest.CaptureFixture) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full here")
    out = io.StringIO()
    events = EventWriter(stream=out)
    events.attach(JobFolder.open(job))
    events(Started((), (), 0.0))
    assert events._file is not None
    events._file.close()
    events._file = open("/dev/full", "w", buffering=1)  # noqa: SIM115
    events.finished(Status.STALE, "Done.")
    assert "progress.jsonl cannot be written: No space left on device" in capsys.readouterr().err
    assert events_of(out.getvalue())[-1]["event"] == "finished"


@posix_only
def test_links_in_a_strangers_folder_are_not_written_through(start_worker, job: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    for name in ("diary.txt", "result.exr", "reference.png"):
        (mine / name).write_text("precious")
    for name in ("progress.jsonl", "result.json", "index.html"):
        (job / name).symlink_to(mine / "diary.txt")
    (job / "pictures").symlink_to(mine)
    child = start_worker("--progress", "json")
    child.communicate(timeout=60)
    assert child.returncode == 0
    assert {path.read_text() for path in mine.iterdir()} == {"precious"}
    assert len(list(mine.iterdir())) == 3
    assert not (job / "pictures").is_symlink()
    assert (job / "pictures" / "result.exr").is_file()


def test_a_log_gets_lines_instead_of_a_bar(start_worker) -> None:
    child = start_worker("--progress", "bar")
    out, err = child.communicate(timeout=60)
    assert child.returncode == 0
    assert "native code writes" in out  # without a protocol stdout is left alone
    assert err.splitlines() == [
        "mse-hdr: 0.1 -> 0.02 in 5 iterations. The best loss did not improve for ten iterations.",
        "mfo: The best loss did not improve for ten iterations.",
    ]


@posix_only
def test_a_terminal_gets_a_bar(start_worker) -> None:
    import pty

    ours, theirs = pty.openpty()
    child = start_worker("--progress", "bar", plan={"iterations": 10, "seconds": 0.1}, stderr=theirs)
    os.close(theirs)
    shown = ""
    with contextlib.suppress(OSError):  # the other end was closed
        while piece := os.read(ours, 4096):
            shown += piece.decode()
    os.close(ours)
    assert child.wait(BUSY_SECONDS) == 0
    assert "mse-hdr (1/1)" in shown
    assert "loss 0.0167, iteration 5" in shown
    assert "mse-hdr: 0.1 -> 0.01 in 10 iterations." in shown
