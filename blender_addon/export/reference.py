# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference picture: a file that is copied, or an image of the .blend that is written out."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from .exr_file import write_exr
from .findings import ExportError
from .image_pixels import SRGB_NAMES, UnreadableImageError, read_pixels
from .png_file import write_png

LINEAR_SUFFIXES = (".exr", ".hdr")
DISPLAY_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")


@dataclass(frozen=True)
class Reference:
    """A reference to be written as `name`: the file `source`, or `pixels` (linear float32 or display uint8)."""

    name: str
    encoding: str  # linear or srgb
    source: Path | None = None
    pixels: NDArray[np.float32] | NDArray[np.uint8] | None = None

    def write(self, folder: Path) -> None:
        """Put the picture into `folder`.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        if self.source is not None:
            shutil.copyfile(self.source, folder / self.name)
        elif self.encoding == "linear":
            write_exr(folder / self.name, np.asarray(self.pixels, dtype=np.float32))
        else:
            write_png(folder / self.name, np.asarray(self.pixels, dtype=np.uint8))


def read_reference(
    reference: Path | bpy.types.Image | None, scene: bpy.types.Scene, size: tuple[int, int]
) -> Reference | None:
    """Return the reference for a picture of `size` (width, height), stretched if the scene's pixels are not square.

    Raises
    ------
    ExportError
        If it is missing, of another size, or a display picture of a view transform that cannot be undone.
    """
    if reference is None:
        return None
    stretched = scene.render.pixel_aspect_x != scene.render.pixel_aspect_y
    if isinstance(reference, bpy.types.Image):
        return _from_image(reference, scene, size, stretched)
    path = Path(bpy.path.abspath(str(reference)))
    if not path.is_file():
        raise ExportError(f"The reference {path} does not exist: choose another file.")
    suffix = path.suffix.lower()
    if suffix not in LINEAR_SUFFIXES + DISPLAY_SUFFIXES:
        raise ExportError(f"The reference {path.name} is no picture we read: use EXR, HDR, PNG, JPEG or TIFF.")
    if stretched:
        image = bpy.data.images.load(str(path), check_existing=False)
        try:
            return _from_image(image, scene, size, stretched)
        finally:
            bpy.data.images.remove(image)
    encoding = "linear" if suffix in LINEAR_SUFFIXES else "srgb"
    if encoding == "srgb":
        _refuse_view(scene, path.name)
    return Reference(f"reference{suffix}", encoding, source=path)


def _from_image(image: bpy.types.Image, scene: bpy.types.Scene, size: tuple[int, int], stretched: bool) -> Reference:
    try:
        pixels = np.ascontiguousarray(read_pixels(image)[:, :, :3])
    except UnreadableImageError as problem:
        raise ExportError(f"The reference '{image.name}' {problem}.") from None
    height, width = pixels.shape[:2]
    render = scene.render
    wanted = (render.resolution_x * render.resolution_percentage // 100,
              render.resolution_y * render.resolution_percentage // 100) if stretched else size  # fmt: skip
    if (width, height) != wanted:
        raise ExportError(
            f"The reference '{image.name}' is {width}x{height}, but the scene renders {wanted[0]}x{wanted[1]}: set the "
            "output resolution to the reference's."
        )
    if stretched:
        pixels = _stretch(pixels, size)
    if image.is_float or image.colorspace_settings.name not in SRGB_NAMES:
        return Reference("reference.exr", "linear", pixels=pixels)
    _refuse_view(scene, image.name)
    encoded = np.where(pixels <= 0.0031308, 12.92 * pixels, 1.055 * np.maximum(pixels, 1e-9) ** (1 / 2.4) - 0.055)
    return Reference("reference.png", "srgb", pixels=np.rint(encoded.clip(0.0, 1.0) * 255.0).astype(np.uint8))


def _refuse_view(scene: bpy.types.Scene, name: str) -> None:
    """Display values can be undone only if the view did nothing but exposure, gamma and the sRGB curve."""
    view = scene.view_settings
    reasons = []
    if view.view_transform != "Standard":
        reasons.append(f"the view transform {view.view_transform}")
    if view.look not in ("None", ""):
        reasons.append(f"the look {view.look}")
    if view.use_curve_mapping:
        reasons.append("view curves")
    if getattr(view, "use_white_balance", False):
        reasons.append("a white balance")
    if scene.display_settings.display_device != "sRGB":
        reasons.append(f"the display device {scene.display_settings.display_device}")
    if reasons:
        raise ExportError(
            f"The reference {name} holds display colours and the scene uses {' and '.join(reasons)}, which cannot be "
            "undone: render the reference as OpenEXR, or render it again with the view transform Standard and no look."
        )


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
