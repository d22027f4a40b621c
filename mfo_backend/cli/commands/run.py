# SPDX-License-Identifier: Apache-2.0
"""`mfo run JOB`: the worker. Its protocol is in `docs/reference/job_folder.md`."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NoReturn

from ...job.output.progress import EventWriter
from ...job.output.protocol_stream import take_stdout
from ...job.run.fit_scene import Fitter, fit_scene, load_everything
from ...job.run.run_job import run_job
from ...job.run.stop import ORPHAN_GRACE, StopSignal
from ...job.run.waiting import wait_for_job
from ...types.status import Status


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo run`."""
    parser = subparsers.add_parser("run", help="run a job folder", description="Run the job in a folder.")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("job", type=Path, nargs="?", help="folder with a request.json")
    what.add_argument(
        "--wait",
        type=float,
        metavar="SECONDS",
        help='load everything and wait so long for a line {"cmd": "run", "job": FOLDER} on stdin',
    )
    parser.add_argument(
        "--progress",
        choices=("json", "bar", "none"),
        default="bar",
        help="JSON lines on stdout, a bar on stderr, or neither (default: bar)",
    )
    parser.add_argument("--parent", type=int, metavar="PID", help="stop when this process is gone")
    parser.add_argument("--control", choices=("stdin",), help="read commands from stdin and stop at its end")
    parser.add_argument(
        "--blender-server",
        type=_words,
        default=(),
        metavar="JSON",
        help="command line, as a list, of a Blender with the add-on's probe/server.py: it evaluates the nodes while "
        "values inside them are fitted",
    )
    add_trust_option(parser)
    parser.set_defaults(func=run)


def add_trust_option(parser: argparse.ArgumentParser) -> None:
    """Add ``--trust``."""
    parser.add_argument(
        "--trust", action="store_true", help="take meshes and textures that Mitsuba reads unchecked (OBJ, PNG, ...)"
    )


def _words(text: str) -> tuple[str, ...]:
    """A command line as a JSON list."""
    words = json.loads(text)
    if not isinstance(words, list) or not all(isinstance(word, str) for word in words):
        raise ValueError(text)
    return tuple(words)


def run(arguments: argparse.Namespace) -> int:
    """Run the job and end the process with its status' exit code.

    Nothing is left to do: Python would take a tenth of a second to take the renderer down, and after a cancel native
    code may still be at work.
    """
    fitter = partial(fit_scene, blender=arguments.blender_server)
    end_process(work(arguments, fitter, prepare=load_everything))


def leave(status: Status) -> int:
    """The exit code of a job; after a cancel the process ends here, because native code may still be at work."""
    if status is Status.CANCELLED:
        end_process(status)
    return status.exit_code


def end_process(status: Status) -> NoReturn:
    """End this process at once with the status' exit code."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status.exit_code)


def work(
    arguments: argparse.Namespace,
    fitter: Fitter,
    *,
    orphan_grace: float = ORPHAN_GRACE,
    prepare: Callable[[], object] = lambda: None,
) -> Status:
    """Run the job with a given fit; an orphan that does not stop within `orphan_grace` seconds is ended.

    With ``--wait`` the job is named later, and `prepare` is run before it is.
    """
    stream = take_stdout() if arguments.progress == "json" else None
    if arguments.wait is not None:
        arguments.control = "stdin"
        arguments.job = wait_for_job(
            sys.stdin.fileno(), stream, idle_seconds=arguments.wait, parent=arguments.parent, prepare=prepare
        )
    events = EventWriter(stream=stream, bar=arguments.progress == "bar")
    stop = StopSignal(
        cancel_file=arguments.job / "cancel",
        parent=arguments.parent,
        control=sys.stdin.fileno() if arguments.control == "stdin" else None,
        orphan_grace=orphan_grace,
    )
    with stop.watching():
        status = run_job(arguments.job, events, stop, fitter=fitter, trusted=arguments.trust)
    if stream is not None:
        with contextlib.suppress(OSError):  # its reader is gone
            stream.close()
    if arguments.progress != "json":
        print(f"mfo: {events.last_sentence}", file=sys.stderr)
    if stop.reason:
        print(f"mfo: stopped because {stop.reason}", file=sys.stderr)
    return status
