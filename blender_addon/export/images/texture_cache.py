# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether Cycles reads pictures through its texture cache (Blender 5.2 and later).

The cache has smaller versions of a picture, which are shown where its pixels are narrower than those of the render,
averaged after decoding; without it Cycles takes single pixels there. A floor of random pixels was 8 % brighter by it.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import bpy

FOLDER = "blender_tx"  # beside a picture, where Blender's preferences name no other


def uses_texture_cache(render: bpy.types.RenderSettings, images: Iterable[bpy.types.Image]) -> bool:
    """Whether a render makes such files, or finds those of one of these images."""
    settings: Any = render  # not of every Blender
    if not getattr(settings, "use_texture_cache", False):
        return False
    folder = getattr(bpy.context.preferences.filepaths, "texture_cache_directory", "")
    paths = [Path(bpy.path.abspath(image.filepath, library=image.library)) for image in images if image.filepath]
    return bool(paths) and (settings.use_auto_generate_texture_cache or any(_is_cached(path, folder) for path in paths))


def _is_cached(picture: Path, folder: str) -> bool:
    """Whether there is a file of the cache for a picture, in the preferences' `folder` or in the usual one."""
    folders = {picture.parent / folder.removeprefix("//"), picture.parent / FOLDER}
    return any(found.suffix == ".tx" for place in folders for found in _named_after(picture, place))


def _named_after(picture: Path, folder: Path) -> list[Path]:
    try:
        start = picture.name.partition("<")[0] if "<" in picture.name else f"{picture.name}."  # of tiles
        return [path for path in folder.iterdir() if path.name.startswith(start)]
    except OSError:
        return []
