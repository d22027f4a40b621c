# SPDX-License-Identifier: Apache-2.0
"""OpenEXR files through the OpenEXR package. Mitsuba's own reader is not used: it deadlocks on a single thread."""

from __future__ import annotations

import contextlib
import io
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..types.errors import BadInputError
from ..types.image import Encoding, Image, Pixels
from .colour_space import convert, to_rec709
from .picture_size import Size, check_declared_size

MAX_SAMPLES = 2**30  # of all channels and parts, which the package reads together; ZIP makes a thousandth of zeros
_COLOUR = ("R", "G", "B")


def read_exr(path: Path, size: Size | None = None) -> Image:
    """The scene-linear picture in an EXR file.

    Of several layers or parts the plain channels R, G, B win, then those of a layer named Combined (Blender's main
    pass), then the first layer with colour, then a grey channel Y. Pixels outside the data window are black.

    Raises
    ------
    BadInputError
        If the file cannot be read, declares too large a size, holds no colour or one of an unknown space.
    """
    import OpenEXR

    headers = check_exr(path)
    names = [[channel.name for channel in part["channels"]] for part in headers]
    index, colour, alpha = _choose(path, names)
    check_declared_size(path.name, _size(headers[index], "displayWindow"), size)
    _check_channels(path, headers[index], [*colour, *([alpha] if alpha else [])])
    # what holds for all parts may stand in the first alone
    matrix, space = to_rec709(path.name, {**headers[0], **headers[index]})
    try:
        # the package prints what is wrong with a damaged file on stdout, which belongs to our caller
        with contextlib.redirect_stdout(io.StringIO()):
            channels = OpenEXR.File(str(path), separate_channels=True).channels(index)
        _refuse_integers(path, [channels[name] for name in colour])
        planes = [_in_display_window(channels[name].pixels, headers[index]) for name in colour]
        coverage = _in_display_window(channels[alpha].pixels, headers[index]) if alpha else None
    except BadInputError:
        raise
    except Exception as error:  # also when only some scan lines are there: the part is then missing
        raise _damaged(path) from error
    if len(planes) == 1:  # a grey, which is one in every colour space
        return Image(np.repeat(planes[0][..., None], 3, axis=-1), Encoding.LINEAR, coverage)
    pixels = np.stack(planes, axis=-1)
    if matrix is None:
        return Image(pixels, Encoding.LINEAR, coverage)
    converted, note = convert(pixels, matrix, path.name, space)
    return Image(converted, Encoding.LINEAR, coverage, (note,))


def check_exr(path: Path) -> list[dict[str, Any]]:
    """The headers of all parts of an EXR file, none of which declares too large a size.

    Raises
    ------
    BadInputError
        If one does, or the file cannot be read.
    """
    import OpenEXR

    try:
        parts = OpenEXR.File(str(path), separate_channels=True, header_only=True).parts
        headers = [part.header for part in parts]
        # a name that is no text raises here
        channels = [len([channel.name for channel in part["channels"]]) for part in headers]
    except Exception as error:  # the package raises RuntimeError, ValueError and its own type
        raise _damaged(path) from error
    if not headers:
        raise _damaged(path)
    for part in headers:
        _check_size(path, part)
    samples = sum(math.prod(_size(part, "dataWindow")) * n for part, n in zip(headers, channels, strict=True))
    if samples > MAX_SAMPLES:
        raise BadInputError(
            f"Image {path.name!r} declares {samples} samples in all its layers: at most {MAX_SAMPLES} are read, so "
            "export fewer layers."
        )
    return headers


def write_exr(path: Path | str, pixels: NDArray[np.floating]) -> None:
    """Write linear pixels (height, width, 3) or (height, width) as float32, ZIP compressed."""
    import OpenEXR

    name = "RGB" if pixels.ndim == 3 else "Y"
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    try:
        OpenEXR.File(header, {name: np.ascontiguousarray(pixels, np.float32)}).write(str(path))
    except Exception as error:
        raise BadInputError(f"Image {str(path)!r} cannot be written: check the folder and the free space.") from error


def _damaged(path: Path) -> BadInputError:
    return BadInputError(f"Image {path.name!r} cannot be read: the file is damaged or not an OpenEXR image.")


def _window(header: dict[str, Any], name: str) -> tuple[int, int, int, int]:
    (left, top), (right, bottom) = header[name]
    return int(left), int(top), int(right) + 1, int(bottom) + 1


def _size(header: dict[str, Any], name: str) -> Size:
    left, top, right, bottom = _window(header, name)
    return right - left, bottom - top


def _check_size(path: Path, header: dict[str, Any]) -> None:
    for name in ("dataWindow", "displayWindow"):
        check_declared_size(path.name, _size(header, name))


def _choose(path: Path, parts: list[list[str]]) -> tuple[int, list[str], str | None]:
    """Part index, colour channel names and alpha's name."""
    candidates = []
    for index, names in enumerate(parts):
        lookup = set(names)
        for name in sorted(names):
            prefix, _, last = name.rpartition(".")
            layer = f"{prefix}." if prefix else ""
            alpha = f"{layer}A" if f"{layer}A" in lookup else None
            if last == "R" and {f"{layer}G", f"{layer}B"} <= lookup:
                rank = 0 if not layer else 1 if prefix.split(".")[-1] == "Combined" else 2
                candidates.append((rank, index, [layer + c for c in _COLOUR], alpha))
            elif last == "Y" and not {f"{layer}RY", f"{layer}BY"} & lookup:
                candidates.append((3, index, [name], alpha))
    if not candidates:
        found = ", ".join(dict.fromkeys(n for names in parts for n in names)) or "none"
        raise BadInputError(
            f"Image {path.name!r} has no colour: needed are channels R, G, B or Y, found {found}; export it as RGB."
        )
    _, index, colour, alpha = min(candidates, key=lambda c: (c[0], c[1]))
    return index, colour, alpha


def _check_channels(path: Path, header: dict[str, Any], names: list[str]) -> None:
    import OpenEXR

    if header.get("type") in (OpenEXR.deepscanline, OpenEXR.deeptile):
        raise BadInputError(f"Image {path.name!r} is a deep image: export it as a flat one.")
    for channel in header["channels"]:
        if channel.name in names and (channel.xSampling, channel.ySampling) != (1, 1):
            raise BadInputError(f"Image {path.name!r} has subsampled channels: export it with full resolution RGB.")


def _refuse_integers(path: Path, channels: list[Any]) -> None:
    """Here and not by the header: the package does not tell a channel's type before its pixels are read."""
    if any(channel.pixels.dtype.kind != "f" for channel in channels):
        raise BadInputError(
            f"Image {path.name!r} holds 32-bit integers, which are no radiance: export it with half or float channels."
        )


def _in_display_window(plane: NDArray, header: dict[str, Any]) -> Pixels:
    """The plane of the data window cut or padded with black to the display window."""
    left, top, right, bottom = _window(header, "displayWindow")
    data_left, data_top, data_right, data_bottom = _window(header, "dataWindow")
    plane = plane.astype(np.float32)
    if (left, top, right, bottom) == (data_left, data_top, data_right, data_bottom):
        return plane
    out = np.zeros((bottom - top, right - left), np.float32)
    x0, x1 = max(left, data_left), min(right, data_right)
    y0, y1 = max(top, data_top), min(bottom, data_bottom)
    if x0 < x1 and y0 < y1:
        out[y0 - top : y1 - top, x0 - left : x1 - left] = plane[
            y0 - data_top : y1 - data_top, x0 - data_left : x1 - data_left
        ]
    return out
