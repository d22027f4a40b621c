# SPDX-License-Identifier: GPL-3.0-or-later
"""What is known of the colour space of a scene-linear reference; the backend converts it, by what its file says."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...versions import working_space_to_rec709
from ..files.exr_file import REC709
from ..images.image_pixels import LINEAR_NAMES
from ..images.picture_header import PictureHeader, read_header

_REC709_IDS = ("lin_rec709_scene", "lin_rec709", "lin_srgb_scene", "lin_srgb")
_SAME = 2e-3  # of CIE xy: headers round to three or four digits


def file_notes(path: Path, name: str, header: PictureHeader, scene: bpy.types.Scene) -> tuple[str, ...]:
    """What a user should know of the colours of a scene-linear file that the job calls `name`."""
    if header.kind != "OpenEXR":
        return ()
    space = other_space(header)
    if space:  # in the backend's words, which does it and says it once
        return (f"{name}: colours were converted from {space} to linear Rec.709.",)
    written = _written_space(scene)
    if header.space or header.primaries or not written:
        return ()
    return (
        f"The reference {path.name} does not say its colour space and is taken as linear Rec.709, but this scene "
        f"writes {written}: if it was rendered so, render it again with the output's color space Linear Rec.709.",
    )


def image_notes(image: bpy.types.Image) -> tuple[str, ...]:
    """What a user should know where Blender overlooks the colour space that the file of `image` names."""
    if image.source != "FILE" or image.packed_file is not None or image.colorspace_settings.name not in LINEAR_NAMES:
        return ()
    try:
        header = read_header(Path(bpy.path.abspath(image.filepath, library=image.library)))
    except OSError:
        return ()
    space = other_space(header) if header is not None else ""
    if not space:
        return ()
    return (
        f"Blender takes the reference '{image.name}' as {image.colorspace_settings.name}, but its file says {space}: "
        "give the file itself as the reference, or set the image's color space.",
    )


def other_space(header: PictureHeader) -> str:
    """The linear space that a header names, in words, or nothing for Rec.709 and where it says nothing."""
    if header.space.startswith("lin_"):
        return "" if header.space in _REC709_IDS else header.space
    is_known = header.space in ("", "unknown")
    if not is_known or not header.primaries:
        return ""
    same = all(abs(a - b) <= _SAME for a, b in zip(header.primaries, REC709, strict=True))
    return "" if same else "the primaries in its header"


def _written_space(scene: bpy.types.Scene) -> str:
    """The linear space in which the scene's output writes EXR files, in words, or nothing for Rec.709."""
    output = scene.render.image_settings
    if output.color_management == "OVERRIDE" and output.file_format.startswith("OPEN_EXR"):
        name = output.linear_colorspace_settings.name
        return "" if name in LINEAR_NAMES else name
    return "" if working_space_to_rec709() is None else "its working space, which is another"
