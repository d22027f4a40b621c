# SPDX-License-Identifier: Apache-2.0
"""The first and the last steps of a walk by mouse and keys: install the zip from disk, leave Blender."""

import bpy
from hand import area, click, go_to, key, look_for, move, scale, typed, view, window


def windows():
    return list(bpy.context.window_manager.windows)


def opened(before, seconds=20):
    """Wait for a window that was not there before, and go to it."""
    for _ in range(int(seconds / 0.1)):
        new = [w for w in windows() if w not in before]
        if new:
            yield 1.0  # until it is drawn
            go_to(new[0])
            return
        yield 0.1
    raise AssertionError("no window opened")


def region_of(kind, place):
    return next(r for r in place.regions if r.type == kind)


def the(kind):
    """The area of a kind in the window that the hand is over."""
    return next(a for a in window().screen.areas if a.type == kind)


def install(package, shot):
    """Edit > Preferences by its keys, Get Extensions, the arrow at the top right, Install from Disk, the file."""
    before = windows()
    x, y = view().x + view().width // 2, view().y + view().height // 2
    move(x, y)
    yield 0.3
    yield from key("COMMA", x, y, ctrl=True)
    yield from opened(before)
    preferences = the("PREFERENCES")
    tabs = region_of("UI", preferences) if has(preferences, "UI") else region_of("NAVIGATION_BAR", preferences)
    for y in range(int(tabs.y + tabs.height - 10 * scale()), tabs.y, -int(18 * scale())):
        yield from click(tabs.x + tabs.width // 2, y)
        if bpy.context.preferences.active_section == "EXTENSIONS":
            break
    yield 1.0
    yield from shot("i1_get_extensions")
    place, pages = [], region_of("WINDOW", preferences)
    yield from look_for("extension_search", place, preferences, pages, part=0.1)
    assert place, "no field to search for extensions"
    yield from click(pages.x + pages.width - 20 * scale(), place[1])
    yield 0.5
    yield from shot("i2_arrow")
    yield from key("UP_ARROW", *place)  # the last entry
    yield 0.2
    before = windows()
    yield from key("RET", *place)
    yield from opened(before)
    files = the("FILE_BROWSER")
    yield from shot("i3_from_disk")
    yield from look_for("directory", place, files, region_of("UI", files), part=0.5)
    assert place, "no field for the folder"
    yield from write_over(package.parent, place)
    row = region_of("EXECUTE", files)
    yield from write_over(package.name, (row.x + 0.3 * row.width, row.y + 0.5 * row.height))
    yield from shot("i4_chosen")
    press = (row.x + 0.93 * row.width, row.y + 0.5 * row.height)
    count = len(windows())
    for _ in range(3):  # where the text is still being edited, the first press ends that
        if len(windows()) == count:
            yield from click(*press)
            yield 2.0


def write_over(text, place):
    """A double click edits a text."""
    for _ in range(2):
        yield from click(*place)
    yield from key("A", *place, ctrl=True)
    yield from typed(f"{text}", *place)
    yield 1.0


def has(place, kind):
    return any(r.type == kind for r in place.regions)


def installed(addon_id):
    for _ in range(300):
        if addon_id in bpy.context.preferences.addons:
            return
        yield 0.1
    raise AssertionError(f"{addon_id} was not installed")


def close_preferences():
    """What the window manager's button does; a virtual screen has none."""
    other = next(w for w in windows() if any(place.type == "PREFERENCES" for place in w.screen.areas))
    with bpy.context.temp_override(window=other):
        bpy.ops.wm.window_close()
    go_to(None)
    yield 0.5


def leave(shot):
    """Ctrl Q over the view, look at the question, and choose not to save."""
    x, y = view().x + view().width // 2, view().y + view().height // 2
    move(x, y)
    yield 0.3
    yield from key("Q", x, y, ctrl=True)
    yield 1.5
    yield from shot("q_leave")
    yield from key("D", x, y)  # the letter that Don't Save has underlined


def side_bar_by_key():
    """N over the view, then the tab of the panel."""
    x, y = view().x + view().width // 2, view().y + view().height // 2
    move(x, y)
    yield 0.3
    if not area().spaces.active.show_region_ui:
        yield from key("N", x, y)
        yield 0.8
    bar = region_of("UI", area())
    for y in range(int(bar.y + bar.height - 20 * scale()), bar.y, -int(30 * scale())):
        yield from click(bar.x + bar.width - 10 * scale(), y)
        if bar.active_panel_category == "Material Fit":
            return
    raise AssertionError("no tab Material Fit")
