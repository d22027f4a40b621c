# SPDX-License-Identifier: Apache-2.0
"""A hand for walks through Blender's windows: mouse and keys, and buttons found as a hand finds them.

With `--enable-event-simulate` the events begin in Blender, without it in the X server. The mouse goes down a region,
and Blender says what lies under it. Everything yields the seconds to wait before its next step.
"""

import subprocess
import sys
from pathlib import Path
from typing import Any

import bpy

STEP = 14  # pixels between two looks of the mouse, less than the height of a button at scale 1
SCREEN_HEIGHT = 1000  # pixels
# pixels at scale 1 from a sidebar's edge to where Blender 4.3 and 5.2 let it be dragged
GRIP = 7  # over the view
GRIP_BESIDE = 2  # beside it, without region overlap
SETTLED = 0.3  # seconds after which Blender knows what is under a mouse that rests, on busy cores
_screen: Any = None
_last = None  # height at which a button was found
_window = None  # that the hand is over; the first where none is named


def scale():
    return bpy.context.preferences.view.ui_scale


def window():
    return _window or bpy.context.window_manager.windows[0]


def go_to(other):
    """Work in another window; None: the first."""
    global _window
    _window = other


def real() -> Any:
    """The X server, where events come from there."""
    global _screen
    if _screen is None and "--enable-event-simulate" not in sys.argv:
        from desktop.screen import Screen

        _screen = Screen()
    return _screen


def on_screen(x, y):
    """A place of the window, from below, on the screen, from above."""
    return window().x + x, SCREEN_HEIGHT - window().y - y


def area():
    return next(a for a in window().screen.areas if a.type == "VIEW_3D")


def side_bar():
    return next(r for r in area().regions if r.type == "UI")


def view():
    return next(r for r in area().regions if r.type == "WINDOW")


def move(x, y):
    if real():
        real().move(*on_screen(x, y))
    else:
        window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=int(x), y=int(y))


def button(x, y, *, down, kind="LEFTMOUSE"):
    if real():
        real().button(kind, down=down)
    else:
        window().event_simulate(type=kind, value="PRESS" if down else "RELEASE", x=int(x), y=int(y))


def click(x, y):
    """Press and release; Blender needs a moment in between, as with a hand."""
    move(x, y)
    yield 0.1
    button(x, y, down=True)
    yield 0.1
    button(x, y, down=False)
    yield 0.3


def drag(begin, end):
    """With the left button from one place to another."""
    move(*begin)
    yield 0.2
    button(*begin, down=True)
    for share in (0.3, 0.7, 1.0):
        yield 0.1
        move(*(a + share * (b - a) for a, b in zip(begin, end, strict=True)))
    yield 0.1
    button(*end, down=False)
    yield 0.3


def drop(path, x, y):
    """A file from another program, at a place of the window."""
    place = [str(int(value)) for value in on_screen(x, y)]
    program = subprocess.Popen(
        [sys.executable, str(Path(__file__).parent / "desktop" / "screen.py"), str(path), *place]
    )
    while program.poll() is None:
        yield 0.1
    yield 0.5


def key(kind, x, y, text="", **held):
    if real():
        names = [{"ctrl": "Control_L", "shift": "Shift_L"}[name] for name in held]
        for name in names:
            real().key(name, down=True)
        for down in (True, False):
            real().key(text or kind.lower() if len(kind) == 1 else text or kind, down=down)
            yield 0.02
        for name in names:
            real().key(name, down=False)
        yield 0.02
        return
    window().event_simulate(type=kind, value="PRESS", x=int(x), y=int(y), unicode=text, **held)
    yield 0.05
    window().event_simulate(type=kind, value="RELEASE", x=int(x), y=int(y), **held)
    yield 0.05


def typed(text, x, y):
    for letter in text:
        kind = letter.upper() if letter.isalpha() and letter.isascii() else "ZERO"
        yield from key(kind, x, y, letter)
    yield from key("RET", x, y)


def under_mouse(place=None, region=None):
    """What Blender would do if the button under the mouse were pressed, as Python; empty where there is none."""
    bpy.context.window_manager.clipboard = ""
    with bpy.context.temp_override(window=window(), area=place or area(), region=region or side_bar()):
        for copy in (bpy.ops.ui.copy_python_command_button, bpy.ops.ui.copy_data_path_button):
            if copy.poll():
                copy()
                if bpy.context.window_manager.clipboard:
                    return bpy.context.window_manager.clipboard
    return ""


def wheel(turns):
    """Over the sidebar; the wheel's events are as a mouse sends them."""
    region = side_bar()
    x, y = region.x + region.width // 3, region.y + region.height // 2
    if real():
        move(x, y)
    for _ in range(abs(turns)):
        kind = "WHEELDOWNMOUSE" if turns > 0 else "WHEELUPMOUSE"
        button(x, y, down=True, kind=kind)
        if real():
            button(x, y, down=False, kind=kind)
        yield 0.03
    yield 0.4


def find(words, place, part=0.3, turns=12):
    """Move down the sidebar until a button's command has these words; `place` gets x and y.

    What lies below the last one is looked at first, then what is in sight, then all of the sidebar from its top.
    """
    global _last
    place.clear()
    for turn in range(-1, turns):
        yield from look_for(words, place, area(), side_bar(), part, begin=_last if turn < 0 else None)
        if place:
            _last = place[1] + 2 * STEP * scale()
            return
        if turn >= 0:
            yield from wheel(6 if turn else -60)
    raise AssertionError(f"no button for {words}")


def look_for(words, place, where, region, part=0.3, begin=None):
    """Move down a region of an area once, from its top or `begin`; `place` stays empty where nothing has the words."""
    place.clear()
    x, top = region.x + part * (region.width - 24 * scale()), region.y + region.height - 8 * scale()
    for y in range(int(top if begin is None else min(top, begin)), region.y + 4, -int(STEP * scale())):
        move(x, y)
        yield 0.06 if real() else 0.01  # the server has to send it first
        if words not in under_mouse(where, region):
            continue
        for at in (y, y + STEP * scale()):  # Blender may still have spoken of the place before
            move(x, at)
            yield SETTLED
            if words in under_mouse(where, region):
                place.extend((x, at))
                return


def widen(width):
    """Drag the sidebar's edge, as its width is no property."""
    over = bpy.context.preferences.system.use_region_overlap
    region, grip = side_bar(), (GRIP if over else GRIP_BESIDE) * scale()
    y, target = region.y + region.height // 2, region.x + region.width - width
    yield from drag((region.x + grip, y), (target + grip, y))
    yield 0.3
    assert abs(region.width - width) < 2 * scale(), f"the sidebar is {region.width} pixels wide, not {width}"
