# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference picture: a file that is copied, or an image of the .blend that is written out."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import bpy
import numpy as np
from numpy.typing import NDArray

from ..camera.render_region import Size, picture_size
from ..files.exr_file import REC709, write_exr
from ..files.png_file import write_png
from ..findings import ExportError, Fix
from ..images.image_pixels import SRGB_NAMES, UnreadableImageError, read_pixels
from .chosen_file import LINEAR_SUFFIXES, chosen_file
from .counted_part import WHOLE, CountedPart
from .reference_colour import file_notes, image_notes
from .reference_view import SCENE, needs_table, view_note
from .turned_picture import turn_notes, turned
from .view_lut import ViewLut, bake_view_lut

LINEAR_FORMATS = ("OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR")  # other float images are 16-bit display pictures

Picture: TypeAlias = Path | bpy.types.Image | CountedPart  # what may be given as a reference


@dataclass(frozen=True)
class Reference:
    """A reference to be written as `name`: the file `source`, or `pixels` (linear float32 or display uint8).

    `view` is the view of a display picture where no formula has it; `notes` say what was taken for granted. `space` and
    `primaries` are what the file of linear `pixels` says of their colours. `part` says what of it counts; beside
    `region`, a rectangle like a crop, it may be empty.
    """

    name: str
    encoding: str  # linear or srgb
    source: Path | None = None
    pixels: NDArray[np.float32] | NDArray[np.uint8] | None = None
    view: ViewLut | None = None
    notes: tuple[str, ...] = ()
    space: str = ""
    primaries: tuple[float, ...] = REC709
    part: CountedPart | None = None
    region: tuple[float, float, float, float] = WHOLE

    def write(self, folder: Path) -> dict[str, Any]:
        """Put the picture into `folder`; returns the object `reference` of request.json.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        if self.view is not None:
            self.view.write(folder)
        if self.source is not None:
            shutil.copyfile(self.source, folder / self.name)
        elif self.encoding == "linear":
            pixels = np.asarray(self.pixels, dtype=np.float32)
            write_exr(folder / self.name, pixels, space=self.space, primaries=self.primaries)
        else:
            write_png(folder / self.name, np.asarray(self.pixels, dtype=np.uint8))
        part = self.part.write(folder) if self.part is not None else {}
        if self.region != WHOLE:
            part["region"] = list(self.region)
        return {"path": self.name, "encoding": self.encoding, **part}


def read_reference(
    reference: Picture | None,
    scene: bpy.types.Scene,
    size: tuple[int, int],
    *,
    made: str = SCENE,
    upright: bool = False,
    alpha: bool = False,
) -> Reference | None:
    """Return the reference for a picture of `size` (width, height), averaged if the scene's pixels are not square.

    `made` is one of `REFERENCE_VIEWS`. A display picture that was rendered in this scene comes with a table of the
    scene's view where no formula undoes that. `upright` turns a picture as its EXIF data say; else it is as stored.
    `alpha` keeps the alpha channel of one that is written anew, as it is kept of display colours that are straight.

    Raises
    ------
    ExportError
        If it is missing, of another size, or a display picture for another display than sRGB.
    """
    if reference is None:
        return None
    if isinstance(reference, CountedPart):
        reference.check()
        found = read_reference(reference.picture, scene, size, made=made, upright=upright, alpha=reference.alpha)
        return replace(found, part=reference) if found is not None else None
    is_averaged = scene.render.pixel_aspect_x != scene.render.pixel_aspect_y
    rendered = picture_size(scene.render) if is_averaged else size
    of_region = rendered != picture_size(scene.render)
    if isinstance(reference, bpy.types.Image):
        found = _from_image(reference, scene, size, rendered, made, alpha=alpha)
        return replace(found, notes=(*found.notes, *image_notes(reference)))
    path, header = chosen_file(reference)
    suffix = path.suffix.lower()
    turn = header.orientation if upright else 1
    said = () if upright else turn_notes(path.name, header, rendered, f"reference{suffix}")
    is_linear = suffix in LINEAR_SUFFIXES
    if is_averaged or turn != 1:
        image = bpy.data.images.load(str(path), check_existing=False)
        try:
            if suffix == ".exr":
                image.colorspace_settings.name = "Non-Color"  # the numbers as they are, with what the file says of them
            found = _from_image(image, scene, size, rendered, made, turn, alpha=alpha)
        finally:
            bpy.data.images.remove(image)
        if suffix == ".exr":
            found = replace(found, space=header.space, primaries=header.primaries)
    else:
        if header.width and header.height:  # of other files the backend knows them
            refuse_size(path.name, (header.width, header.height), rendered, of_region=of_region)
        view = {} if is_linear else _view(scene, path.name, made)
        found = Reference(f"reference{suffix}", "linear" if is_linear else "srgb", source=path, **view)
    colours = file_notes(path, found.name, header, scene) if is_linear else ()
    return replace(found, notes=(*found.notes, *said, *colours))


def holds_display_colours(image: bpy.types.Image) -> bool:
    """Whether an image of the .blend went through a view; else it is taken as scene-linear."""
    if image.is_float and image.source == "GENERATED":
        return False  # floats that no file has encoded
    return image.colorspace_settings.name in SRGB_NAMES and image.file_format not in LINEAR_FORMATS


def refuse_size(name: str, found: Size, wanted: Size, *, of_region: bool = False) -> None:
    """Raise `ExportError` where a reference has another size (width, height) than the render, or its Render Region."""
    if found == wanted:
        return
    scale = Fix("scale", f"{wanted[0]}x{wanted[1]}")
    if of_region:
        raise ExportError(
            f"The reference '{name}' is {found[0]}x{found[1]}, but the Render Region is {wanted[0]}x{wanted[1]}: turn "
            "Render Region off, or set it as it was for the reference.",
            Fix("whole_frame"),
            scale,
        )
    raise ExportError(
        f"The reference '{name}' is {found[0]}x{found[1]}, but the scene renders {wanted[0]}x{wanted[1]}: set the "
        "output resolution to the reference's.",
        Fix("resolution", f"{found[0]}x{found[1]}"),
        scale,
    )


def _from_image(
    image: bpy.types.Image,
    scene: bpy.types.Scene,
    size: tuple[int, int],
    rendered: Size,
    made: str,
    turn: int = 1,
    *,
    alpha: bool,
) -> Reference:
    try:
        pixels = read_pixels(image)
    except UnreadableImageError as problem:
        raise ExportError(f"The reference '{image.name}' {problem}.") from None
    if holds_display_colours(image) and image.alpha_mode in ("STRAIGHT", "PREMUL"):  # Blender divides bytes
        alpha |= bool((pixels[:, :, 3] < 1.0).any())
    pixels = turned(np.ascontiguousarray(pixels[:, :, : 4 if alpha else 3]), turn)
    height, width = pixels.shape[:2]
    refuse_size(image.name, (width, height), rendered, of_region=rendered != picture_size(scene.render))
    if rendered != size:
        pixels = _averaged(pixels, size)
    if not holds_display_colours(image):
        return Reference("reference.exr", "linear", pixels=pixels)
    encoded = np.where(pixels <= 0.0031308, 12.92 * pixels, 1.055 * np.maximum(pixels, 1e-9) ** (1 / 2.4) - 0.055)
    encoded[:, :, 3:] = pixels[:, :, 3:]
    levels = np.rint(encoded.clip(0.0, 1.0) * 255.0).astype(np.uint8)
    return Reference("reference.png", "srgb", pixels=levels, **_view(scene, image.name, made))


def _view(scene: bpy.types.Scene, name: str, made: str) -> dict[str, Any]:
    """The fields `view` and `notes` of a display picture."""
    view = bake_view_lut(scene) if needs_table(scene, name, made) else None
    said = view_note(scene, name, made)
    return {"view": view, "notes": (said,) if said else ()}


def _averaged(pixels: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """The mean of what each of `size` (width, height) larger pixels covers."""
    for axis, count in ((1, size[0]), (0, size[1])):
        old = pixels.shape[axis]
        if old == count:
            continue
        covered = [np.clip(np.arange(1, old + 1) - edge, 0.0, 1.0) for edge in np.arange(count + 1) * old / count]
        weights = -np.diff(covered, axis=0) * count / old  # (count, old)
        pixels = np.moveaxis(np.tensordot(weights, pixels, (1, axis)), 0, axis)
    return np.ascontiguousarray(pixels, dtype=np.float32)
