# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a job as icons for the panel; loaded by the timer, never while drawing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy.utils.previews
import numpy as np

from ..export.files.png_file import write_png
from ..process.temporary_folder import temporary_folder

_collection: Any = None
_shown: dict[str, str] = {}
_serial = 0
_is_warm = False
_SWATCH = 16  # pixels
_SMALL = 300_000  # bytes of a PNG that is read within some milliseconds


def register() -> None:
    """Make the collection the icons live in."""
    global _collection
    _collection = bpy.utils.previews.new()


def unregister() -> None:
    """Free every icon."""
    global _collection
    _shown.clear()
    if _collection is not None:
        bpy.utils.previews.remove(_collection)
        _collection = None


def warm_up() -> None:
    """Load a picture of one pixel: the first picture of a session costs Blender some 50 ms more than any other.

    An operator can afford them, the timer that shows the pictures of a running fit cannot.
    """
    global _is_warm
    if _collection is None or bpy.app.background or _is_warm:
        return
    _is_warm = True
    with temporary_folder("pixel") as folder:
        path = folder / "pixel.png"
        write_png(path, np.zeros((1, 1, 3), np.uint8))
        show("pixel", path, now=True)


def show(name: str, path: Path, *, now: bool = False) -> None:
    """Make the picture at `path` the icon called `name`, replacing an earlier one.

    Blender loads it after its first draw and shows an empty place meanwhile; with `now` a small one is loaded at once.
    """
    global _serial
    if _collection is None or bpy.app.background or not path.is_file():
        return
    _serial += 1
    key = f"{name} {_serial}"  # a new key each time: Blender keeps the picture of a known one
    picture = _collection.load(key, str(path), "IMAGE")
    if now and path.stat().st_size < _SMALL:
        _ = picture.image_size[0]  # asking loads it
    old = _shown.get(name)
    _shown[name] = key
    if old is not None:
        del _collection[old]


def swatch(color: Sequence[float]) -> str:
    """The hex code of a linear Rec.709 colour; an icon of that name shows it."""
    display = [_linear_to_srgb(min(max(component, 0.0), 1.0)) for component in color[:3]]
    name = "#" + "".join(f"{round(255 * component):02X}" for component in display)
    if _collection is not None and not bpy.app.background and name not in _collection:
        picture = _collection.new(name)
        picture.icon_size = (_SWATCH, _SWATCH)
        picture.icon_pixels_float = [*display, 1.0] * _SWATCH**2
        _shown[name] = name
    return name


def _linear_to_srgb(value: float) -> float:
    """IEC 61966-2-1."""
    return 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1.0 / 2.4) - 0.055


def clear() -> None:
    """Forget all icons."""
    _shown.clear()
    if _collection is not None:
        _collection.clear()


def icon(name: str) -> int:
    """Icon number for `UILayout.template_icon`, 0 where there is none."""
    key = _shown.get(name)
    return _collection[key].icon_id if _collection is not None and key in _collection else 0
