# SPDX-License-Identifier: GPL-3.0-or-later
"""How wide Blender draws a text, and texts broken or shortened to a width: labels and buttons cut what is too long."""

from __future__ import annotations

from functools import lru_cache

import blf
import bpy

_FONT = 0  # the interface's own


def ui_scale(context: bpy.types.Context) -> float:
    """Pixels of the screen in one of the widths here; a Blender without windows has none, and gets 1."""
    return context.preferences.system.ui_scale or 1.0


def text_width(context: bpy.types.Context, text: str) -> float:
    """Width of a text of the interface, in pixels at a scale of 1 (a row is 20 high)."""
    scale = ui_scale(context)
    return _measured(text, bpy.context.preferences.ui_styles[0].widget.points * scale) / scale


def wrapped(context: bpy.types.Context, text: str, width: float) -> list[str]:
    """The text in lines that are no wider than `width`, in pixels at a scale of 1; a longer word is broken."""
    found, line = [], ""
    for word in text.split():
        longer = f"{line} {word}" if line else word
        if text_width(context, longer) <= width:
            line = longer
            continue
        if line:
            found.append(line)
        while len(beginning := _beginning(context, word, width)) < len(word):
            found.append(beginning)
            word = word[len(beginning) :]
        line = word
    return [*found, line]


def shortened(context: bpy.types.Context, text: str, width: float) -> str:
    """The text, or as much of its beginning as a width in pixels at a scale of 1 holds, and three dots."""
    if text_width(context, text) <= width:
        return text
    return _beginning(context, text, width - text_width(context, "…")) + "…"


def _beginning(context: bpy.types.Context, text: str, width: float) -> str:
    """As many letters as fit, at least one."""
    end = len(text)
    while end > 1 and text_width(context, text[:end]) > width:
        end -= 1
    return text[:end]


@lru_cache(maxsize=4096)  # a panel is drawn at each move of the mouse
def _measured(text: str, points: float) -> float:
    blf.size(_FONT, points)
    return blf.dimensions(_FONT, text)[0]
