# SPDX-License-Identifier: GPL-3.0-or-later
"""The check of the chosen pictures: what is understood of each, or why it cannot be used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import bpy

from ..export.camera.render_region import Size, pictured_region, pictured_size
from ..export.findings import ExportError, Fix
from ..export.images.image_pixels import UnreadableImageError, is_data, read_pixels, without_pixels
from ..export.reference.chosen_file import DISPLAY_SUFFIXES, LINEAR_SUFFIXES, chosen_file
from ..export.reference.counted_part import CountedPart
from ..export.reference.picture_setup import size_of
from ..export.reference.reference import holds_display_colours, refuse_size
from ..export.reference.reference_colour import other_space
from ..export.reference.reference_view import SCENE, mixed_by, needs_table, output_view
from ..export.reference.turned_picture import turn_notes
from ..pictures.overlay import background_of
from .finding import FINE, IGNORED, STOPS, TO_CHOOSE, Finding

NONE_USED = "No picture is used: tick one at least."


def reference_size(scene: bpy.types.Scene) -> Size | None:
    """Width and height of the chosen reference, None where they are not known."""
    settings = scene.mfo
    if settings.reference_source == "IMAGE":
        return size_of(settings.reference_image)
    try:
        return size_of(Path(settings.reference_path)) if settings.reference_path else None
    except OSError:
        return None


def shows_several(scene: bpy.types.Scene) -> bool:
    """Whether several pictures are used, each of a size and from a camera of its own."""
    return len(used_pictures(scene)) > 1


def used_pictures(scene: bpy.types.Scene) -> list[bpy.types.PropertyGroup]:
    """The pictures of the next fit."""
    settings = scene.mfo
    if not settings.pictures:
        return [settings.first_picture]
    return [one for one in (settings.first_picture, *settings.pictures) if one.use]


def more_pictures(scene: bpy.types.Scene) -> list[Finding]:
    """The further pictures of the list: those without a file or at a frame that the scene does not have."""
    found, settings = [], scene.mfo
    for number, entry in enumerate(settings.pictures, 2):
        if not entry.use:
            continue
        path, shows = Path(bpy.path.abspath(entry.path)), entry.scene or scene
        if not entry.path:
            found.append(Finding(TO_CHOOSE, f"Choose the file of picture {number}, or do not use it."))
        elif problem := _file_problem(entry.path):
            found.append(Finding(STOPS, f"Picture {number}: {problem}"))
        elif not shows.frame_start <= entry.frame <= shows.frame_end:
            frames = f"{shows.frame_start} to {shows.frame_end}"
            found.append(Finding(STOPS, f"Picture {number}: frame {entry.frame} is outside of the frames {frames}."))
        elif problem := _part_problem(entry.part, path):
            found.append(Finding(STOPS, f"Picture {number}: {problem}"))
        else:
            found.append(Finding(FINE, f"Picture {number}: {path.name}, frame {entry.frame}."))
    return found


def reference(scene: bpy.types.Scene) -> list[Finding]:
    """The first picture: what was understood of it, or why it cannot be used."""
    settings = scene.mfo
    if not settings.first_picture.use and settings.pictures:
        return [] if any(one.use for one in settings.pictures) else [Finding(STOPS, NONE_USED)]
    is_image = settings.reference_source == "IMAGE"
    if not (settings.reference_image if is_image else settings.reference_path):
        kind = "an image of this file" if is_image else "a file"
        behind = background_of(scene.camera)
        fixes = (Fix("background", behind.name),) if behind is not None else ()
        # no fault: every scene begins like this
        return [Finding(TO_CHOOSE, f"Choose the picture to match: {kind}.", fixes)]
    try:
        found = _image_reference(settings.reference_image) if is_image else _file_reference(scene)
    except ExportError as problem:
        return [Finding(STOPS, str(problem), problem.fixes)]
    problems = []
    if all(found.size) and not shows_several(scene):
        wanted = pictured_size(scene.render, found.size)
        of_region = pictured_region(scene.render, found.size) is not None
        problems += _refused(partial(refuse_size, of_region=of_region), found.name, found.size, wanted)
    words = f"scene-linear {found.space}, converted to Rec.709" if found.space else "scene-linear Rec.709"
    if not found.is_linear:
        problems += _refused(needs_table, scene, found.name, settings.reference_view)
        words = "taken as a photograph or a render under Standard"
        if settings.reference_view == SCENE:
            words = f"display colours under the view {output_view(scene)[0].view_transform}"
            words = f"taken as rendered in this scene, {words}" if mixed_by(scene) else words
    said = [Finding(IGNORED, " ".join(found.turned), (Fix("upright"),))] if found.turned else []
    problems += _part(scene, found)
    return problems or [*said, *_part_words(scene), Finding(FINE, f"Reference: {found.words}, {words}.")]


def _part(scene: bpy.types.Scene, found: _Picture) -> list[Finding]:
    """What keeps the part of the picture that counts from being used."""
    problem = _part_problem(scene.mfo.first_picture.part, Path(found.name))
    return [Finding(STOPS, problem, (Fix("whole_picture"),))] if problem else []


def _part_problem(part: bpy.types.PropertyGroup, path: Path) -> str:
    if part.is_whole:
        return ""
    try:
        with without_pixels():
            CountedPart(path, part.crop, part.mask, part.use_alpha).check(thorough=False)
    except ExportError as problem:
        return str(problem)
    return ""


def _part_words(scene: bpy.types.Scene) -> list[Finding]:
    """That not all of the picture counts, and what is made of a mask of another size."""
    part = scene.mfo.first_picture.part
    if part.is_whole:
        return []
    size = pictured_size(scene.render, reference_size(scene))
    if part.mask is not None and all(part.mask.size) and tuple(part.mask.size) != size:
        mask, picture = (f"{width}x{height}" for width, height in (part.mask.size, size))
        said = f"The mask '{part.mask.name}' is {mask} and the picture {picture}: it is scaled to that."
        return [Finding(IGNORED, said, (Fix("whole_picture"),))]
    return [Finding(FINE, "Only a part of the picture counts.", (Fix("whole_picture"),))]


@dataclass(frozen=True)
class _Picture:
    name: str
    size: tuple[int, int]  # width and height, 0 where unknown
    words: str
    is_linear: bool
    space: str = ""  # of linear colours that are converted
    turned: tuple[str, ...] = ()  # what is to be said of a turn by EXIF data


def _file_problem(given: str) -> str:
    """Why there is no picture at a path."""
    try:
        chosen_file(given)
    except ExportError as problem:
        return str(problem)
    return ""


def _file_reference(scene: bpy.types.Scene) -> _Picture:
    path, header = chosen_file(scene.mfo.reference_path)
    kind = f"{header.depth} {header.kind}".strip()
    words = f"{header.width} x {header.height}, {kind}" if header.width else header.kind
    is_linear = path.suffix.lower() in LINEAR_SUFFIXES
    said = turn_notes(path.name, header, pictured_size(scene.render, (header.width, header.height)))
    space = other_space(header) if is_linear else ""
    return _Picture(path.name, (header.width, header.height), words, is_linear, space, said)


def _image_reference(image: bpy.types.Image) -> _Picture:
    try:
        with without_pixels():
            read_pixels(image)
    except UnreadableImageError as problem:
        fixes = (Fix("colorspace", "sRGB"), Fix("colorspace", "Linear Rec.709")) if "colour" in str(problem) else ()
        raise ExportError(f"The reference '{image.name}' {problem}.", *fixes) from None
    width, height = image.size
    space = "raw numbers taken as colours" if is_data(image) else image.colorspace_settings.name
    return _Picture(image.name, (width, height), f"{width} x {height}, {space}", not holds_display_colours(image))


def asks_view(scene: bpy.types.Scene) -> bool:
    """Whether it makes a difference how the chosen reference was made; reads no file, for the panel's drawing."""
    settings = scene.mfo
    if settings.reference_source == "IMAGE":
        image = settings.reference_image
        is_display = image is not None and holds_display_colours(image)
    else:
        is_display = Path(settings.reference_path).suffix.lower() in DISPLAY_SUFFIXES
    return is_display and bool(mixed_by(scene))


def _refused(check: Callable[..., object], *arguments: object) -> list[Finding]:
    """What a check of the export refuses, as lines."""
    try:
        check(*arguments)
    except ExportError as problem:
        return [Finding(STOPS, str(problem), problem.fixes)]
    return []
