# SPDX-License-Identifier: Apache-2.0
"""Reading and writing picture files: EXR and HDR are scene-linear, all others hold sRGB display values."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..types.errors import BadInputError
from ..types.image import Encoding, Image, Pixels
from .colour_profile import other_profile
from .exr_file import read_exr, write_exr
from .hdr_file import read_hdr
from .picture_kind import SHOWN, refuse_another_kind
from .picture_size import Size, check_declared_size
from .png_file import deep_colour
from .scene_xml import is_file, is_folder

if TYPE_CHECKING:
    from PIL import Image as PillowImage

__all__ = ["check_reference", "read_image", "write_exr", "write_png"]

_DISPLAY_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp")
_SUFFIXES = (".exr", ".hdr", *_DISPLAY_SUFFIXES)
_ORIENTATION = 274  # tag of EXIF 2.3
_SIDEWAYS = (5, 6, 7, 8)
_TURN_BACK = {
    2: "FLIP_LEFT_RIGHT",
    3: "ROTATE_180",
    4: "FLIP_TOP_BOTTOM",
    5: "TRANSPOSE",
    6: "ROTATE_90",
    7: "TRANSVERSE",
    8: "ROTATE_270",
}
# Pillow goes by the content, whatever the file is called, and hands PostScript to a program of its own
_FORMATS = ("PNG", "JPEG", "TIFF", "BMP", "WEBP")


def read_image(path: Path | str, size: Size | None = None) -> Image:
    """The picture in a file.

    EXR (any compression, half or float; channels RGB, RGBA or Y, also layered as Blender writes them) and Radiance HDR
    are scene-linear and converted to Rec.709 where they name another space. PNG, JPEG, TIFF, BMP and WebP are taken as
    sRGB display values in [0, 1]; a grey picture becomes three equal channels. PNG and grey pictures keep 16 bits a
    channel; Pillow reads colour TIFF of 16 bits with 8. With `size` (width, height) a picture of another one is refused
    by its header alone.

    Raises
    ------
    BadInputError
        If it is missing, a folder, of another kind, damaged, too large or without colour channels.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if is_folder(path):
        raise BadInputError(f"Image {str(path)!r} is a folder: give one picture in it.")
    if suffix not in _SUFFIXES:
        raise BadInputError(f"Image {path.name!r} is of an unknown kind: use {', '.join(s[1:] for s in _SUFFIXES)}.")
    if not is_file(path):
        raise BadInputError(f"Image {str(path)!r} does not exist: check the path.")
    refuse_another_kind(path)
    if suffix == ".exr":
        return read_exr(path, size)
    return read_hdr(path, size) if suffix == ".hdr" else _read_display(path, size)


def write_png(path: Path | str, srgb: NDArray[np.floating]) -> None:
    """Write sRGB display values (height, width, 3) or (height, width), clipped to [0, 1], as an 8-bit PNG."""
    from PIL import Image as PillowImage

    levels = np.rint(np.clip(np.nan_to_num(srgb), 0, 1) * 255).astype(np.uint8)
    try:
        PillowImage.fromarray(levels).save(path, format="PNG")
    except OSError as error:
        raise BadInputError(f"Image {str(path)!r} cannot be written: {error.strerror or error}.") from error


def check_reference(image: Image, width: int, height: int) -> tuple[Image, tuple[str, ...]]:
    """The reference ready for a fit, and notes on what was changed: negative values become 0.

    Raises
    ------
    BadInputError
        If the size is not `width` x `height`, a pixel is NaN or infinite, or all are black.
    """
    check_declared_size("reference", (image.width, image.height), (width, height))
    nan = int(np.isnan(image.pixels).any(axis=-1).sum())
    infinite = int(np.isinf(image.pixels).any(axis=-1).sum())
    if nan or infinite:
        raise BadInputError(
            f"Reference has {nan} pixels with NaN and {infinite} with infinite values: "
            "render or export it without them."
        )
    if image.pixels.max() <= 0:
        raise BadInputError("Reference is all black: it must show the lit object, so check the lights and the file.")
    negative = int((image.pixels < 0).any(axis=-1).sum())
    if not negative:
        return image, image.notes
    note = f"Reference has {negative} pixels with negative values; they were set to 0."
    return replace(image, pixels=np.maximum(image.pixels, np.float32(0))), (*image.notes, note)


def _read_display(path: Path, size: Size | None) -> Image:
    from PIL import Image as PillowImage

    deep = deep_colour(path, size) if path.suffix.lower() == ".png" else None
    if deep is not None:
        values = deep.astype(np.float32) / np.float32(65535)
        alpha = _contiguous(values[..., -1]) if values.shape[-1] in (2, 4) else None
        colour = values[..., :3] if values.shape[-1] > 2 else np.repeat(values[..., :1], 3, axis=-1)
        return Image(_contiguous(colour), Encoding.SRGB, alpha)
    try:
        # Pillow warns about large images; ours is an error, and Pillow's hard limit is one like any other
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with PillowImage.open(path, formats=_FORMATS) as picture:
                is_tiff = picture.format == "TIFF"  # which Pillow turns, and leaves every other kind as it is stored
                orientation = picture.getexif().get(_ORIENTATION, 1) if is_tiff else 1
                stored = picture.size[::-1] if orientation in _SIDEWAYS else picture.size
                check_declared_size(path.name, stored, size)
                picture.load()
                if orientation in _TURN_BACK:
                    picture = picture.transpose(PillowImage.Transpose[_TURN_BACK[orientation]])
                orientation = orientation if is_tiff else picture.getexif().get(_ORIENTATION, 1)
    except BadInputError:
        raise
    except Exception as error:  # Pillow raises OSError, SyntaxError, ValueError and others on damaged files
        raise BadInputError(f"Image {path.name!r} cannot be read: the file is damaged or not an image.") from error
    if picture.mode.startswith("I") or picture.mode == "F":
        return _read_grey(path, np.asarray(picture))
    notes = _said(path.name, picture, orientation)
    rgba = np.asarray(picture.convert("RGBA"), np.float32) / np.float32(255)
    has_alpha = "A" in picture.getbands() or "transparency" in picture.info
    alpha = _contiguous(rgba[..., 3]) if has_alpha else None
    return Image(_contiguous(rgba[..., :3]), Encoding.SRGB, alpha, notes)


def _said(name: str, picture: PillowImage.Image, orientation: int) -> tuple[str, ...]:
    """What a user should know of a display picture that is taken as it is stored, its numbers as sRGB."""
    notes = []
    if orientation in SHOWN:
        shown = SHOWN[orientation]
        notes.append(f"{name}: its EXIF data want it shown {shown}; it was taken as it is stored, as in Blender.")
    profile = other_profile(picture.info.get("icc_profile") or b"")
    if profile:
        notes.append(f"{name}: its colour profile is {profile!r}; its numbers were taken as sRGB, as in Blender.")
    if picture.mode == "CMYK":
        notes.append(f"{name}: it holds ink (CMYK), which was turned into RGB without a profile: save it as sRGB.")
    return tuple(notes)


def _read_grey(path: Path, grey: NDArray) -> Image:
    if grey.dtype.kind not in "iu" or grey.max(initial=0) > 65535 or grey.min(initial=0) < 0:
        raise BadInputError(
            f"Image {path.name!r} holds {grey.dtype} values: PNG, JPEG and TIFF must hold 8 or 16 bits a channel."
        )
    values = grey.astype(np.float32) / np.float32(65535)
    return Image(np.repeat(values[..., None], 3, axis=-1), Encoding.SRGB)


def _contiguous(pixels: NDArray) -> Pixels:
    return np.ascontiguousarray(pixels, np.float32)
