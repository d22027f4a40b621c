# SPDX-License-Identifier: Apache-2.0
"""A hand for walks through Blender's windows: simulated mouse and keys, and buttons found as a hand finds them.

Blender is started with `--enable-event-simulate`. The mouse goes down the sidebar, and Blender says what lies under it.
Everything yields the seconds to wait before its next step.
"""

import bpy

STEP = 9  # pixels between two looks of the mouse, less than half a button's height at scale 1


def scale():
    return bpy.context.preferences.view.ui_scale


def window():
    return bpy.context.window_manager.windows[0]


def area():
    return next(a for a in window().screen.areas if a.type == "VIEW_3D")


def side_bar():
    return next(r for r in area().regions if r.type == "UI")


def view():
    return next(r for r in area().regions if r.type == "WINDOW")


def move(x, y):
    window().event_simulate(type="MOUSEMOVE", value="NOTHING", x=int(x), y=int(y))


def click(x, y):
    """Press and release; Blender needs a moment in between, as with a hand."""
    move(x, y)
    yield 0.1
    window().event_simulate(type="LEFTMOUSE", value="PRESS", x=int(x), y=int(y))
    yield 0.1
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(x), y=int(y))
    yield 0.3


def key(kind, x, y, text="", **held):
    window().event_simulate(type=kind, value="PRESS", x=int(x), y=int(y), unicode=text, **held)
    yield 0.05
    window().event_simulate(type=kind, value="RELEASE", x=int(x), y=int(y), **held)
    yield 0.05


def typed(text, x, y):
    for letter in text:
        kind = letter.upper() if letter.isalpha() and letter.isascii() else "ZERO"
        yield from key(kind, x, y, letter)
    yield from key("RET", x, y)


def under_mouse():
    """What Blender would do if the button under the mouse were pressed, as Python; empty where there is none."""
    bpy.context.window_manager.clipboard = ""
    with bpy.context.temp_override(window=window(), area=area(), region=side_bar()):
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
    for _ in range(abs(turns)):
        kind = "WHEELDOWNMOUSE" if turns > 0 else "WHEELUPMOUSE"
        window().event_simulate(type=kind, value="PRESS", x=x, y=y)
        yield 0.03
    yield 0.4


def find(words, place, part=0.3, turns=12):
    """Move down the sidebar until a button's command has these words; `place` gets x and y.

    What is in sight is looked at first, then all of the sidebar from its top.
    """
    place.clear()
    for turn in range(turns):
        region = side_bar()
        x = region.x + part * (region.width - 24 * scale())
        for y in range(int(region.y + region.height - 8 * scale()), region.y + 4, -int(STEP * scale())):
            move(x, y)
            yield 0.01
            if words in under_mouse():
                place.extend((x, y))
                return
        yield from wheel(6 if turn else -60)
    raise AssertionError(f"no button for {words}")


def widen(width):
    """Drag the sidebar's edge, as its width is no property."""
    region = side_bar()
    y, target = region.y + region.height // 2, region.x + region.width - width
    move(region.x, y)
    yield 0.2
    window().event_simulate(type="LEFTMOUSE", value="PRESS", x=region.x, y=y)
    for share in (0.3, 0.6, 1.0):
        yield 0.1
        move(region.x + share * (target - region.x), y)
    window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(target), y=y)
    yield 0.5
