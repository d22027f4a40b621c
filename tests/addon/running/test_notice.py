# SPDX-License-Identifier: Apache-2.0
"""The end of a fit is in the status bar, and is heard or noticed where the preferences ask for it."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

SENTENCE = "The result does not match the reference."


@pytest.fixture
def notice(addon: object, monkeypatch: pytest.MonkeyPatch):
    from blender_addon.running import notice

    shown: list[str | None] = []
    monkeypatch.setattr(notice, "_show", shown.append)
    monkeypatch.setattr(notice, "asked", "NOTHING", raising=False)
    monkeypatch.setattr(notice, "preference", lambda _context, name: notice.asked if name == "when_done" else "")
    monkeypatch.setattr(notice, "shown", shown, raising=False)
    yield notice
    notice.close()


def test_status_bar_has_the_sentence_until_a_while_later(notice: Any) -> None:
    notice.tell(SENTENCE)
    assert notice.shown == [f"Material Fit: {SENTENCE}"]
    assert notice._held == []
    notice.close()
    assert notice.shown[1:] == [None]
    notice.close()
    assert notice.shown[1:] == [None]  # another's text stays


def test_the_system_says_it_in_the_language_of_the_panel(
    notice: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from blender_addon.sentences import translated

    program, said = tmp_path / "notify-send", tmp_path / "said"
    program.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" > "{said}"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(translated, "_language", lambda: "de_DE")
    notice.asked = "NOTICE"
    notice.tell(SENTENCE)
    assert notice._held[0].wait(5) == 0
    assert said.read_text().splitlines()[-2:] == ["Material Fit", "Das Ergebnis passt nicht zur Referenz."]


def test_a_sentence_is_no_part_of_a_script(notice: Any) -> None:
    evil = '" & (do shell script "true") & "'
    *command, last = notice.notice_command(evil, "darwin")
    assert last == evil
    assert not any(evil in word for word in command)
    assert notice.notice_command(evil, "win32") == []


def test_two_tones_are_played(notice: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    class Sound:
        def __getattr__(self, name: str) -> Any:
            return lambda *_arguments: self

    played: list[object] = []
    device = SimpleNamespace(play=lambda sound: played.append(sound) or "handle")
    fake = SimpleNamespace(Sound=Sound(), Device=lambda: device, error=RuntimeError)
    monkeypatch.setitem(sys.modules, "aud", fake)
    notice.asked = "SOUND"
    notice.tell(SENTENCE)
    assert len(played) == 1
    assert notice._held == ["handle"]

    def no_device() -> None:
        raise RuntimeError

    fake.Device = no_device
    notice.tell(SENTENCE)
