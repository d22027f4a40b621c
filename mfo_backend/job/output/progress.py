# SPDX-License-Identifier: Apache-2.0
"""Events of a fit as JSON lines, a terminal bar and preview pictures."""

from __future__ import annotations

import contextlib
import json
import math
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, TextIO

from ...types.event import Event, Preview, Started
from ...types.status import Status
from ..folder.atomic_file import write_atomically
from ..folder.job_folder import JobFolder, clear_outputs
from .progress_bar import ProgressBar

if TYPE_CHECKING:
    from ...report.live_pictures import LivePictures

REFERENCE_PATH = "pictures/thumbnails/reference.ppm"
PREVIEW_PATH = "pictures/thumbnails/current.ppm"
DIFFERENCE_PATH = "pictures/thumbnails/current_difference.ppm"
PREVIEW_SECONDS = 0.3  # a viewer cannot follow faster, and encoding costs about 10 ms at 256x256
DIFFERENCE_SECONDS = 1.0  # a FLIP map costs several times that


class EventWriter:
    """The listener of a fit.

    Parameters
    ----------
    stream
        Receives one JSON object a line; None writes none.
    bar
        Whether stderr shows a progress bar.
    """

    def __init__(self, *, stream: TextIO | None = None, bar: bool = False) -> None:
        self.last_sentence = ""
        self._stream = stream
        self._bar = ProgressBar() if bar else None
        self._folder: JobFolder | None = None
        self._pictures: LivePictures | None = None
        self._file: TextIO | None = None
        self._last_preview = self._last_difference = -math.inf
        self._lock = threading.Lock()
        self._ended = False

    def attach(self, folder: JobFolder, pictures: LivePictures | None = None) -> None:
        """Name the folder for progress.jsonl and previews; nothing is written there before the first event."""
        self._folder, self._pictures = folder, pictures

    def __call__(self, event: Event) -> None:
        """Report one event of the fit."""
        if isinstance(event, Preview):
            fields = self._show(event)
            if not fields:
                return
        else:
            fields: dict[str, Any] = asdict(event)
        if isinstance(event, Started):
            self._begin()
        self._write({"event": event.event, **fields})
        if self._bar is not None:
            self._bar.show(event)

    def finished(self, status: Status, sentence: str) -> None:
        """Report the last event of a job that has a result."""
        self._end({"event": "finished", "status": status.value, "sentence": sentence, "result": "result.json"})

    def failed(self, status: Status, sentence: str) -> None:
        """Report the last event of a job without a result."""
        self._end({"event": "failed", "status": status.value, "sentence": sentence})

    def _begin(self) -> None:
        """Clear what an earlier run left in the folder and open progress.jsonl."""
        if self._folder is None or self._file is not None:
            return
        clear_outputs(self._folder)
        self._file = open(self._folder.progress, "w", encoding="utf-8", newline="\n", buffering=1)  # noqa: SIM115

    def _end(self, message: dict[str, Any]) -> None:
        if self._bar is not None:
            self._bar.close()
        self.last_sentence = message["sentence"]
        self._write(message)
        with self._lock:
            self._ended = True
            if self._file is not None:
                self._file.close()

    def _write(self, message: dict[str, Any]) -> None:
        line = json.dumps(finite(message), ensure_ascii=False) + "\n"
        with self._lock:
            if self._ended:
                return  # the process is on its way out; the last event stays the last
            if self._stream is not None:
                try:
                    self._stream.write(line)
                    self._stream.flush()
                except (OSError, ValueError):
                    self._stream = None  # the reader is gone; stopping is the business of `StopSignal`
            if self._file is not None:
                try:
                    self._file.write(line)
                    self._file.flush()
                except OSError as error:  # a full disk: the result itself will say so if it does not fit either
                    print(f"mfo: progress.jsonl cannot be written: {error.strerror}", file=sys.stderr)
                    with contextlib.suppress(OSError):  # it tries once more
                        self._file.close()
                    self._file = None

    def _show(self, preview: Preview) -> dict[str, str]:
        """Write what a viewer has time for; the paths, none where nothing was written."""
        pictures, now = self._pictures, time.monotonic()
        if pictures is None or now - self._last_preview < PREVIEW_SECONDS:
            return {}
        if self._last_preview == -math.inf:
            self._write_picture(REFERENCE_PATH, pictures.reference)
        if not self._write_picture(PREVIEW_PATH, lambda: pictures.current(preview.image)):
            return {}
        # each names the reference, for of several events a slow reader takes the last one alone
        fields, self._last_preview = {"path": PREVIEW_PATH, "reference": REFERENCE_PATH}, time.monotonic()
        if self._last_preview - self._last_difference >= DIFFERENCE_SECONDS and self._write_picture(
            DIFFERENCE_PATH, lambda: pictures.difference(preview.image)
        ):
            fields["difference"] = DIFFERENCE_PATH
            self._last_difference = time.monotonic()
        return fields

    def _write_picture(self, path: str, encode: Callable[[], bytes]) -> bool:
        if self._folder is None or not self._folder.thumbnails.is_dir():
            return False
        try:
            write_atomically(self._folder.root / path, encode())
        except OSError:  # on Windows also when a viewer holds the old one; the next preview comes soon
            return False
        return True


def finite(value: Any) -> Any:
    """The same JSON value with NaN and infinity, which JSON does not know, as null."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
