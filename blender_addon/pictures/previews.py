# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a job as icons for the panel; loaded by the timer, never while drawing."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import bpy.utils.previews
import numpy as np
from numpy.typing import NDArray

from .thumbnail import Thumbnail, is_wide, opaque, paired, read_thumbnail

# names of pictures that are compared with each other
PAIRS = (
    ("reference", "current"),
    ("difference", "current"),
    ("reference", "result"),
    ("reference", "cycles"),
    ("cycles", "engine"),
)

_collection: Any = None
_shown: dict[str, str] = {}
_thumbnails: dict[str, Thumbnail] = {}
_serial = 0
_SWATCH = 16  # pixels


def register() -> None:
    """Make the collection the icons live in."""
    global _collection
    _collection = bpy.utils.previews.new()


def unregister() -> None:
    """Free every icon."""
    global _collection
    clear()
    if _collection is not None:
        bpy.utils.previews.remove(_collection)
        _collection = None


def show(name: str, pictures: Path) -> None:
    """Make the picture of this name in a job's folder of pictures an icon, replacing an earlier one.

    A thumbnail is there at once. Where there is none, Blender loads the picture itself after its first draw and shows
    an empty place meanwhile.
    """
    if _collection is None or bpy.app.background:
        return
    with suppress(OSError):
        show_thumbnail(name, pictures / "thumbnails" / f"{name}.ppm")
        return
    path = pictures / f"{name}.png"
    if path.is_file():
        _thumbnails.pop(name, None)
        _load(name, path)


def show_file(name: str, path: Path) -> None:
    """Make a thumbnail, or any picture that Blender reads, the icon called `name`.

    Raises
    ------
    OSError
        If a thumbnail cannot be read.
    """
    if path.suffix == ".ppm":
        _make(name, opaque(read_thumbnail(path)))
    elif _collection is not None and not bpy.app.background:
        _load(name, path)


def show_thumbnail(name: str, path: Path) -> None:
    """Make a thumbnail the icon called `name`, and one with each picture that it is compared with.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    picture = read_thumbnail(path)
    _thumbnails[name] = picture
    _make(name, opaque(picture))
    for first, second in PAIRS:
        if name in (first, second) and first in _thumbnails and second in _thumbnails:
            both = paired(_thumbnails[first], _thumbnails[second])
            if both is not None:
                _make(f"{first} {second}", both)


def pair(first: str, second: str) -> tuple[int, bool] | None:
    """Icon number of two pictures in one, and whether the first is above, else left; None where they are not paired."""
    number = icon(f"{first} {second}")
    return (number, is_wide(_thumbnails[first])) if number and first in _thumbnails else None


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
    _thumbnails.clear()
    if _collection is not None:
        _collection.clear()


def icon(name: str) -> int:
    """Icon number for `UILayout.template_icon`, 0 where there is none."""
    key = _shown.get(name)
    return _collection[key].icon_id if _collection is not None and key in _collection else 0


def _make(name: str, pixels: NDArray[np.uint8]) -> None:
    """An icon of a picture (height, width, 4), first row at the top."""
    if _collection is None or bpy.app.background:
        return
    key = _next_key(name)
    made = _collection.new(key)
    made.image_size = pixels.shape[1::-1]
    made.image_pixels.foreach_set(np.ascontiguousarray(pixels[::-1]).view(np.int32).ravel())
    _replace(name, key)


def _load(name: str, path: Path) -> None:
    key = _next_key(name)
    _collection.load(key, str(path), "IMAGE")
    _replace(name, key)


def _next_key(name: str) -> str:
    """A new key each time: Blender keeps the picture of a known one."""
    global _serial
    _serial += 1
    return f"{name} {_serial}"


def _replace(name: str, key: str) -> None:
    old = _shown.get(name)
    _shown[name] = key
    if old is not None:
        del _collection[old]
