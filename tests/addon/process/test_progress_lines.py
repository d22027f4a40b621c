# SPDX-License-Identifier: Apache-2.0
"""The backend's lines as events; a line that is too long is none, and neither is any part of it."""

from __future__ import annotations

from io import BytesIO

import pytest

from blender_addon.process import progress_lines
from blender_addon.process.progress_lines import read_events

EVENT = b'{"event": "finished"}\n'


@pytest.mark.parametrize("pieces", [1, 2, 5])
def test_the_tail_of_a_line_that_is_too_long_is_no_event(monkeypatch: pytest.MonkeyPatch, pieces: int) -> None:
    monkeypatch.setattr(progress_lines, "LINE_LIMIT", 40)
    too_long = b" " * (40 * pieces) + EVENT
    assert list(read_events(BytesIO(too_long))) == []
    assert list(read_events(BytesIO(EVENT + too_long + EVENT))) == [{"event": "finished"}] * 2


def test_a_line_of_just_the_limit_is_an_event(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress_lines, "LINE_LIMIT", len(EVENT))
    assert list(read_events(BytesIO(EVENT + EVENT))) == [{"event": "finished"}] * 2


def test_a_line_without_an_end_is_no_event() -> None:
    assert list(read_events(BytesIO(EVENT.rstrip()))) == []
