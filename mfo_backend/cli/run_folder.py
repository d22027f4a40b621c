# SPDX-License-Identifier: Apache-2.0
"""Running a job folder for someone at a terminal: a bar, Ctrl-C, and the content of result.json."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..job.output.progress import EventWriter
from ..job.run.fit_scene import Fitter
from ..job.run.run_job import run_job
from ..job.run.stop import StopSignal
from ..types.status import Status


@dataclass(frozen=True)
class FolderRun:
    """How a job ended; `result` is the content of result.json, None where there is nothing to keep."""

    status: Status
    sentence: str
    result: Mapping[str, Any] | None


def run_folder(folder: Path, fitter: Fitter, *, is_new: bool, trusted: bool = False) -> FolderRun:
    """Run the job in `folder` with a progress bar on stderr; a new folder whose job is refused is removed."""
    events = EventWriter(bar=True)
    with (stop := StopSignal(cancel_file=folder / "cancel")).watching():
        status = run_job(folder, events, stop, fitter=fitter, trusted=trusted)
    path = folder / "result.json"
    if is_new and status is Status.BAD_INPUT:
        shutil.rmtree(folder, ignore_errors=True)
    result = json.loads(path.read_text("utf-8")) if path.is_file() else None
    return FolderRun(status, events.last_sentence, result)
