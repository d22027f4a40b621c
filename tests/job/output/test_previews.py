# SPDX-License-Identifier: Apache-2.0
"""Previews: written before they are told, each with all that a reader needs who sees no other."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.output import progress
from mfo_backend.job.output.progress import EventWriter
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.report.live_pictures import LivePictures
from mfo_backend.types.event import Preview, Started
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.status import Status


def test_each_preview_names_its_reference(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A panel that is drawn seldom takes the newest event alone."""
    monkeypatch.setattr(progress, "PREVIEW_SECONDS", 0.0)
    pixels, out = np.full((9, 16, 3), 0.25, np.float32), io.StringIO()
    events = EventWriter(stream=out)
    events.attach(JobFolder(tmp_path), LivePictures(Image(pixels, Encoding.LINEAR), DisplayView()))
    events(Started((), (), 0.0))
    for _ in range(3):
        events(Preview(pixels))
    events.finished(Status.STALE, "Done.")
    told = [event for event in map(json.loads, out.getvalue().splitlines()) if event["event"] == "preview"]
    assert len(told) == 3
    for event in told:
        assert (tmp_path / event["path"]).read_bytes() == (tmp_path / event["reference"]).read_bytes()
    assert ["difference" in event for event in told] == [True, False, False]  # once a second
