# SPDX-License-Identifier: Apache-2.0
"""The colour space that an EXR or HDR file says its numbers have, and the matrix from there to linear Rec.709.

References
----------
"Technical Introduction to OpenEXR", section "RGB Color" (`chromaticities`, Rec.709 where there are none); SMPTE
ST 2065-4 (`acesImageContainerFlag`, whose colours are those of AP0); Color Interop Forum, "Color Space Encodings for
Texture Assets and CG Rendering" (`colorInteropID`). Primaries: ITU-R BT.709, BT.2020, SMPTE ST 2065-1 (AP0), ACES
S-2014-004 (AP1), SMPTE EG 432-1 (P3). Adaptation to the white D65 is Bradford's (ICC.1:2022, Annex E).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..types.errors import BadInputError
from ..types.image import Pixels

Matrix = NDArray[np.float64]

_D65 = (0.3127, 0.3290)
_ACES_WHITE = (0.32168, 0.33767)
_REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, *_D65)
# CIE xy of red, green, blue and white by the id without its ending "_scene"
_PRIMARIES = {
    "lin_rec709": _REC709,
    "lin_srgb": _REC709,
    "lin_rec2020": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *_D65),
    "lin_p3d65": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *_D65),
    "lin_adobergb": (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, *_D65),
    "lin_ap0": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, *_ACES_WHITE),
    "lin_ap1": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, *_ACES_WHITE),
}
_XYZ = "lin_ciexyzd65"  # its numbers are X, Y and Z, with D65 as white, so there are no primaries
_BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
# Entries of a matrix. Headers round primaries to three or four digits; AP1's smallest entry is ten times as large.
_SAME = 2e-3
_SMALLEST_TRIANGLE = 1e-4  # determinant of the primaries; AP1's is 0.4, and below this noise becomes colour


def convert(pixels: Pixels, matrix: Matrix, name: str, space: str) -> tuple[Pixels, str]:
    """Linear Rec.709 (height, width, 3) of the picture `name` in `space`, and the sentence that says so."""
    converted = (pixels @ matrix.T.astype(np.float32)).astype(np.float32)
    return converted, f"{name}: colours were converted from {space} to linear Rec.709."


def to_rec709(name: str, header: Mapping[str, Any]) -> tuple[Matrix | None, str]:
    """The matrix (3, 3) from an EXR header's colours to linear Rec.709, None where they are that, and the space's name.

    Raises
    ------
    BadInputError
        If the space is unknown or not linear, its primaries span no colours, or two attributes contradict each other.
    """
    tag = str(header.get("colorInteropID", "")).strip()
    tagged = None if tag in ("", "unknown") else _of_id(name, tag)
    chromaticities = header.get("chromaticities")
    if chromaticities is None and header.get("acesImageContainerFlag") == 1:
        chromaticities = _PRIMARIES["lin_ap0"]
    written = None if chromaticities is None else _of_primaries(name, chromaticities)
    if tagged is not None and written is not None and not np.allclose(tagged, written, atol=10 * _SAME):
        raise BadInputError(
            f"Image {name!r} says two colour spaces, {tag} and other chromaticities: export it as linear Rec.709."
        )
    matrix = tagged if tagged is not None else written
    if matrix is None or np.allclose(matrix, np.eye(3), atol=_SAME):
        return None, ""
    return matrix, tag if tagged is not None else "the primaries in its header"


def _of_id(name: str, tag: str) -> Matrix:
    known = tag.removesuffix("_scene")
    if known == _XYZ:
        return np.linalg.inv(_to_xyz(_REC709))
    if known not in _PRIMARIES:
        raise BadInputError(
            f"Image {name!r} says that its colour space is {tag[:40]!r}, which is none that is read here "
            f"({', '.join(_PRIMARIES)}, {_XYZ}): export it as linear Rec.709."
        )
    return _matrix(np.array(_PRIMARIES[known]))


def _of_primaries(name: str, chromaticities: Any) -> Matrix:
    try:
        numbers = np.array(chromaticities, np.float64).reshape(8)
        with np.errstate(all="raise"):
            matrix = _matrix(numbers)
    except (TypeError, ValueError, FloatingPointError, np.linalg.LinAlgError) as error:
        shown = str(chromaticities)[:120]
        raise BadInputError(
            f"Image {name!r} has chromaticities that span no colours ({shown}): export it as linear Rec.709."
        ) from error
    return matrix


def _matrix(primaries: NDArray[np.float64]) -> Matrix:
    """From the RGB of `primaries`, CIE xy of red, green, blue and white, to linear Rec.709."""
    ours, theirs = _BRADFORD @ _white(np.array(_D65)), _BRADFORD @ _white(primaries[6:])
    adapted = np.linalg.inv(_BRADFORD) @ np.diag(ours / theirs) @ _BRADFORD
    return np.linalg.inv(_to_xyz(_REC709)) @ adapted @ _to_xyz(primaries)


def _to_xyz(primaries: Any) -> Matrix:
    numbers = np.array(primaries, np.float64)
    if not np.isfinite(numbers).all():
        raise ValueError("not finite")
    x, y = numbers[0:6:2], numbers[1:6:2]
    columns = np.array([x, y, 1 - x - y])
    if abs(np.linalg.det(columns)) < _SMALLEST_TRIANGLE:
        raise ValueError("the primaries lie on a line")
    shares = np.linalg.solve(columns, _white(numbers[6:]))
    if shares.min() <= 0:
        raise ValueError("the white lies outside of the primaries")
    return columns * shares


def _white(xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """XYZ of a white of luminance 1."""
    x, y = xy
    if not 0 < y <= 1:
        raise ValueError("the white has no luminance")
    return np.array([x / y, 1.0, (1 - x - y) / y])
