# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference picture: a file that is copied, or an image of the .blend that is written out."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .exr_file import write_exr
from .findings import ExportError, Fix
from .image_pixels import SRGB_NAMES, UnreadableImageError, read_pixels
from .png_file import write_png
from .reference_view import SCENE, needs_table, view_note
from .view_lut import ViewLut, bake_view_lut

LINEAR_SUFFIXES = (".exr", ".hdr")
LINEAR_FORMATS = ("OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR")  # other float images are 16-bit display pictures
DISPLAY_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")


@dataclass(frozen=True)
class Reference:
    """A reference to be written as `name`: the file `source`, or `pixels` (linear float32 or display uint8).

    `view` is the view of a display picture where no formula has it; `notes` say what was taken for granted.
    """

    name: str
    encoding: str  # linear or srgb
    source: Path | None = None
    pixels: NDArray[np.float32] | NDArray[np.uint8] | None = None
    view: ViewLut | None = None
    notes: tuple[str, ...] = ()

    def write(self, folder: Path) -> None:
        """Put the picture into `folder`.

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
            write_exr(folder / self.name, np.asarray(self.pixels, dtype=np.float32))
        else:
            write_png(folder / self.name, np.asarray(self.pixels, dtype=np.uint8))


def read_reference(
    reference: Path | bpy.types.Image | None,
    scene: bpy.types.Scene,
    size: tuple[int, int],
    *,
    made: str = SCENE,
) -> Reference | None:
    """Return the reference for a picture of `size` (width, height), stretched if the scene's pixels are not square.

    `made` is one of `REFERENCE_VIEWS`. A display picture that was rendered in this scene comes with a table of the
    scene's view where no formula undoes that.

    Raises
    ------
    ExportError
        If it is missing, of another size, or a display picture for another display than sRGB.
    """
    if reference is None:
        return None
    stretched = scene.render.pixel_aspect_x != scene.render.pixel_aspect_y
    if isinstance(reference, bpy.types.Image):
        return _from_image(reference, scene, size, stretched, made)
    path = Path(bpy.path.abspath(str(reference)))
    if not path.is_file():
        raise ExportError(f"The reference {path} does not exist: choose another file.")
    suffix = path.suffix.lower()
    refuse_suffix(path)
    if stretched:
        image = bpy.data.images.load(str(path), check_existing=False)
        try:
            return _from_image(image, scene, size, stretched, made)
        finally:
            bpy.data.images.remove(image)
    if suffix in LINEAR_SUFFIXES:
        return Reference(f"reference{suffix}", "linear", source=path)
    return Reference(f"reference{suffix}", "srgb", source=path, **_view(scene, path.name, made))


def refuse_suffix(path: Path) -> None:
    """Raise `ExportError` for the name of something that is no picture the backend reads."""
    if path.suffix.lower() not in LINEAR_SUFFIXES + DISPLAY_SUFFIXES:
        raise ExportError(f"The reference {path.name} is no picture we read: use EXR, HDR, PNG, JPEG or TIFF.")


def holds_display_colours(image: bpy.types.Image) -> bool:
    """Whether an image of the .blend went through a view; else it is taken as scene-linear."""
    return image.colorspace_settings.name in SRGB_NAMES and image.file_format not in LINEAR_FORMATS


def refuse_size(name: str, found: tuple[int, int], wanted: tuple[int, int]) -> None:
    """Raise `ExportError` where a reference has another size (width, height) than the render."""
    if found != wanted:
        raise ExportError(
            f"The reference '{name}' is {found[0]}x{found[1]}, but the scene renders {wanted[0]}x{wanted[1]}: set the "
            "output resolution to the reference's.",
            Fix("resolution", f"{found[0]}x{found[1]}"),
        )


def _from_image(
    image: bpy.types.Image, scene: bpy.types.Scene, size: tuple[int, int], stretched: bool, made: str
) -> Reference:
    try:
        pixels = np.ascontiguousarray(read_pixels(image)[:, :, :3])
    except UnreadableImageError as problem:
        raise ExportError(f"The reference '{image.name}' {problem}.") from None
    height, width = pixels.shape[:2]
    render = scene.render
    wanted = (render.resolution_x * render.resolution_percentage // 100,
              render.resolution_y * render.resolution_percentage // 100) if stretched else size  # fmt: skip
    refuse_size(image.name, (width, height), wanted)
    if stretched:
        pixels = _stretch(pixels, size)
    if not holds_display_colours(image):
        return Reference("reference.exr", "linear", pixels=pixels)
    encoded = np.where(pixels <= 0.0031308, 12.92 * pixels, 1.055 * np.maximum(pixels, 1e-9) ** (1 / 2.4) - 0.055)
    levels = np.rint(encoded.clip(0.0, 1.0) * 255.0).astype(np.uint8)
    return Reference("reference.png", "srgb", pixels=levels, **_view(scene, image.name, made))


def _view(scene: bpy.types.Scene, name: str, made: str) -> dict[str, Any]:
    """The fields `view` and `notes` of a display picture."""
    view = bake_view_lut(scene) if needs_table(scene, name, made) else None
    said = view_note(scene, name, made)
    return {"view": view, "notes": (said,) if said else ()}


def _stretch(pixels: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Resample to `size` (width, height) with linear interpolation between pixel centres."""
    for axis, count in ((1, size[0]), (0, size[1])):
        old = pixels.shape[axis]
        if old == count:
            continue
        place = np.clip((np.arange(count) + 0.5) * old / count - 0.5, 0, old - 1)
        low = np.minimum(place.astype(int), max(old - 2, 0))
        weight = (place - low).astype(np.float32)
        shape = [1, 1, 1]
        shape[axis] = count
        weight = weight.reshape(shape)
        high = np.minimum(low + 1, old - 1)
        pixels = np.take(pixels, low, axis) * (1 - weight) + np.take(pixels, high, axis) * weight
    return np.ascontiguousarray(pixels, dtype=np.float32)
