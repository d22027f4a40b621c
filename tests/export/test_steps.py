# SPDX-License-Identifier: Apache-2.0
"""Steps of an export that need something shown, and those that do not."""

from __future__ import annotations

from contextlib import contextmanager

from blender_addon.export.steps import Pause, drained, held


def test_nothing_is_shown_for_steps_apart() -> None:
    log: list[str] = []

    @contextmanager
    def show():
        log.append("shown")
        yield
        log.append("back")

    def picture(ends_apart: bool):
        log.append("read")
        for number in (1, 2):
            yield Pause(holds_scene=True, is_apart=True)
            log.append(f"apart {number}")
        if not ends_apart:
            yield Pause()
            log.append("written")
        return "fit"

    assert drained(held(picture(ends_apart=False), show, "", 0.0)) == "fit"
    assert log == ["shown", "read", "back", "apart 1", "apart 2", "shown", "written", "back"]
    log.clear()
    assert drained(held(picture(ends_apart=True), show, "", 0.0)) == "fit"
    assert log == ["shown", "read", "back", "apart 1", "apart 2"]
