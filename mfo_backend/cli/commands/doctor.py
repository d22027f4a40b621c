# SPDX-License-Identifier: Apache-2.0
"""`mfo doctor`: what works on this machine, and how to mend what does not."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict

from ...job.output.protocol_stream import take_stdout
from ...types.status import Status
from ..checks.check import Check
from ..checks.machine_checks import check_machine

_MARKS = {"ok": "ok      ", "warning": "warning ", "problem": "PROBLEM "}


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo doctor`."""
    parser = subparsers.add_parser(
        "doctor",
        help="say what works here",
        description="Say what works here and how to mend what does not. Exit code 3: the backend cannot run.",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Check the machine; the exit code is 3 if the backend cannot run."""
    with take_stdout() as stream:  # native libraries print warnings of their own
        checks: list[Check] = []
        for check in check_machine():
            checks.append(check)
            if not arguments.json:
                print(_line(check), file=stream)
        works = not any(check.state == "problem" for check in checks)
        if arguments.json:
            print(json.dumps({"works": works, "checks": [asdict(check) for check in checks]}), file=stream)
        else:
            print("The backend can run." if works else "The backend cannot run; mend the problems above.", file=stream)
    return 0 if works else Status.SETUP.exit_code


def _line(check: Check) -> str:
    cure = f"\n        {check.cure}" if check.cure else ""
    return f"{_MARKS[check.state]}{check.name}: {check.found}{cure}"
