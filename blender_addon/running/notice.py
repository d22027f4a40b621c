# SPDX-License-Identifier: GPL-3.0-or-later
"""Say that a fit has ended: in the status bar, and by a sound or the system where the preferences ask for it."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
from typing import Any

import bpy

from ..backend.preferences import preference
from ..sentences.translated import translated

SHOWN = 12.0  # seconds that the status bar has the sentence, long enough to look up from other work
_PITCHES = (660.0, 880.0)  # Hz, one after the other
_TONE, _FADE, _VOLUME = 0.14, 0.05, 0.25  # seconds, seconds, of 1
_held: list[Any] = []  # a sound ends with its handle


def show(sentence: str) -> None:
    """Show the sentence in the user's language in every window for a while."""
    _show(f"Material Fit: {translated(sentence)}")
    if bpy.app.timers.is_registered(_clear):
        bpy.app.timers.unregister(_clear)
    bpy.app.timers.register(_clear, first_interval=SHOWN, persistent=True)


def tell(sentence: str) -> None:
    """`show`, with the noise that was asked for."""
    show(sentence)
    text = translated(sentence)
    asked = preference(bpy.context, "when_done")
    if asked == "SOUND":
        _play()
    elif asked == "NOTICE":
        _notify(text)


def close() -> None:
    """Take the sentence away."""
    if bpy.app.timers.is_registered(_clear):
        bpy.app.timers.unregister(_clear)
        _clear()


def notice_command(text: str, platform: str = sys.platform) -> list[str]:
    """The system's own command for a notice; empty where it has none (Windows)."""
    if platform == "darwin":
        script = ("on run words", 'display notification (item 1 of words) with title "Material Fit"', "end run")
        return ["osascript", *(part for line in script for part in ("-e", line)), text]
    return [] if platform == "win32" else ["notify-send", "--app-name=Blender", "Material Fit", text]


def _show(text: str | None) -> None:
    for workspace in {window.workspace for window in bpy.context.window_manager.windows}:
        workspace.status_text_set(text)


def _clear() -> None:
    _show(None)
    _held.clear()


def _play() -> None:
    try:
        import aud  # type: ignore[import-not-found]  # comes with Blender, unless it was built without sound
    except ImportError:
        return
    with contextlib.suppress(aud.error):  # no device
        tones = [aud.Sound.sine(pitch, 48000).limit(0.0, _TONE).fadeout(_TONE - _FADE, _FADE) for pitch in _PITCHES]
        _held[:] = [aud.Device().play(tones[0].join(tones[1]).volume(_VOLUME))]


def _notify(text: str) -> None:
    command = notice_command(text)
    if command and shutil.which(command[0]):
        with contextlib.suppress(OSError):
            quiet = subprocess.DEVNULL
            _held[:] = [subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)]
