# SPDX-License-Identifier: GPL-3.0-or-later
"""The file that a reference is chosen by: whether there is a picture at its path, and if not, what there is."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..findings import ExportError
from ..images.picture_header import PictureHeader, is_cut_off, read_header

LINEAR_SUFFIXES = (".exr", ".hdr")
DISPLAY_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")
_MOVIES = (".mp4", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".m4v", ".ogv", ".gif")
_RELATIVE = "//"  # to the folder of the .blend


def chosen_file(given: str | Path) -> tuple[Path, PictureHeader]:
    """The absolute path of a picture's file and its header.

    Raises
    ------
    ExportError
        If there is no file that can be read, or one of a kind or with an ending that no reference has, or no picture.
    """
    try:
        return _file(given)
    except OSError as problem:
        raise ExportError(
            f"The reference cannot be read ({problem.strerror or problem}): choose another file."
        ) from problem


def _file(given: str | Path) -> tuple[Path, PictureHeader]:
    path = absolute(given)
    if path.is_dir():
        raise ExportError(f"The reference {path} is a folder: choose one picture in it.")
    if not path.is_file():
        if not path.parent.is_dir():
            raise ExportError(
                f"The reference {path} is in a folder that does not exist: connect its drive, or choose another file."
            )
        raise ExportError(f"The reference {path} does not exist: choose another file.")
    refuse_suffix(path)
    if path.stat().st_size == 0:
        raise ExportError(f"The reference {path.name} is empty: wait until it is written, or choose another file.")
    if is_cut_off(path):
        raise ExportError(
            f"The reference {path.name} is not complete: wait until it is written, or choose another file."
        )
    header = read_header(path)
    if header is None:
        raise ExportError(
            f"The reference '{path.name}' holds no picture of the kind that its name says: choose another file."
        )
    refuse_kind(path, header)
    return path, header


def absolute(given: str | Path) -> Path:
    """A path as the user gave it, from the folder of the .blend where it begins with two slashes.

    Raises
    ------
    ExportError
        If the .blend has no folder yet.
    """
    if str(given).startswith(_RELATIVE) and not bpy.data.filepath:
        raise ExportError(
            f"The reference {given} is looked for beside the .blend, which was never saved: save it, or choose the "
            "picture anew."
        )
    return Path(bpy.path.abspath(str(given)))


def refuse_kind(path: Path, header: PictureHeader) -> None:
    """Raise `ExportError` for a scene-linear file with the name of a display picture, or the other way round."""
    is_linear = header.kind in ("OpenEXR", "Radiance HDR")
    if is_linear != (path.suffix.lower() in LINEAR_SUFFIXES):
        raise ExportError(f"The reference {path.name} is a {header.kind} file: give its name the ending of that kind.")


def refuse_suffix(path: Path) -> None:
    """Raise `ExportError` for the name of something that is no picture the backend reads."""
    suffix = path.suffix.lower()
    if suffix in LINEAR_SUFFIXES + DISPLAY_SUFFIXES:
        return
    if suffix in _MOVIES:
        raise ExportError(f"The reference {path.name} is a movie: save one frame of it as EXR or PNG and choose that.")
    if suffix.startswith(".blend"):
        raise ExportError(f"The reference {path.name} is a Blender file: render a picture of it and choose that.")
    raise ExportError(f"The reference {path.name} is no picture we read: use EXR, HDR, PNG, JPEG or TIFF.")
