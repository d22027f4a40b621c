# SPDX-License-Identifier: Apache-2.0
"""Colour of an interference order: the Fourier transform of the observer's sensitivity at a path difference."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import dual as dr
from ..arrays.clamp import saturate
from ..arrays.grid_table import other_buffer

# Linear Rec.709 from CIE XYZ, white D65 (IEC 61966-2-1), and that white
XYZ_TO_RGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)
WHITE_XYZ = (0.95047, 1.0, 1.08883)

# Gaussian fits of the CIE 1931 curves over wavenumber (Belcour and Barla 2017, supplemental code): scale, centre and
# variance of X, Y, Z; X has a second peak. Blender 4.2 to 4.5.
_SCALE = (5.4856e-13, 4.4201e-13, 5.2481e-13)
_CENTRE = (1.6810e6, 1.7953e6, 2.2084e6)
_VARIANCE = (4.3278e9, 9.3046e9, 6.6121e9)
_SECOND_PEAK = (1.64408e-8, 2.2399e6, 4.5282e9)
_TOTAL = 1.0685e-7

LONGEST_PATH_NM = 60000 / (2 * np.pi)  # place of the last entry of the table


def fourier_table(sensitivity: NDArray[np.float64], wavelength_nm: NDArray[np.float64]) -> NDArray[np.float64]:
    """(512, 6): real and imaginary parts of the RGB response over path difference, from CIE XYZ curves (count, 3).

    The curves, as cubic splines over wavelength, are sampled at 1022 wavenumbers k pi / 60 per micrometre and
    transformed; d(wavelength) = d(wavenumber) / wavenumber^2. The response to no path difference is 1.
    """
    from scipy.interpolate import CubicSpline

    wavenumber = np.pi * np.arange(1022) / 60
    with np.errstate(divide="ignore"):
        place = 1000 / wavenumber
    inside = (place >= wavelength_nm[0]) & (place <= wavelength_nm[-1])
    curve = np.where(inside[:, None], CubicSpline(wavelength_nm, sensitivity)(np.where(inside, place, 500.0)), 0.0)
    weighted = curve / np.maximum(wavenumber, 1e-9)[:, None] ** 2
    spectrum = np.fft.rfft(weighted, axis=0) @ XYZ_TO_RGB.T
    spectrum /= spectrum[0].real
    return np.concatenate([spectrum.real, spectrum.imag], axis=1)


@cache
def _packed(float_type: type) -> Any:
    """The table as rows of eight numbers: RGB real, 0, RGB imaginary, 0."""
    with (resources.files("mfo_backend.material") / "tables" / "thin_film.npz").open("rb") as file:
        rows = np.load(file, allow_pickle=False)["response"]
    zeros = np.zeros((len(rows), 1))
    return other_buffer(np.concatenate([rows[:, :3], zeros, rows[:, 3:], zeros], axis=1).ravel(), float_type)


def fourier_response(path_nm: Any, colour: Callable[..., Any]) -> tuple[Any, Any]:
    """Real and imaginary part, RGB, at a path difference in nanometres (Blender 5.0 on)."""
    float_type = dr.array_type(path_nm)
    buffer = _packed(float_type)
    last = len(buffer) // 8 - 1
    place = saturate(path_nm / LONGEST_PATH_NM) * last
    index_type = dr.uint32_array_t(float_type)
    node = dr.minimum(index_type(dr.detach(place)), last - 1)
    t = place - float_type(node)
    parts = []
    for part in (0, 4):
        values = [
            (1 - t) * dr.gather(float_type, buffer, node * 8 + (part + k))
            + t * dr.gather(float_type, buffer, node * 8 + (8 + part + k))
            for k in range(3)
        ]
        parts.append(colour(*values))
    return parts[0], parts[1]


def gaussian_response(path_nm: Any, colour: Callable[..., Any]) -> tuple[Any, Any]:
    """Real part in XYZ, and zero, at a path difference in nanometres (Blender 4.2 to 4.5)."""
    phase = path_nm * (2 * np.pi * 1e-9)
    parts = [
        a * float(np.sqrt(2 * np.pi * v)) * dr.cos(c * phase) * dr.exp(-v * dr.square(phase))
        for a, c, v in zip(_SCALE, _CENTRE, _VARIANCE, strict=True)
    ]
    a, c, v = _SECOND_PEAK
    parts[0] += a * dr.cos(c * phase) * dr.exp(-v * dr.square(phase))
    return colour(*parts) * (1 / _TOTAL), colour(0)


def xyz_response_to_rgb(value: Any) -> Any:
    """RGB of an XYZ reflectance under equal energy, adapted by scaling with the white of D65 as Cycles does."""
    x, y, z = (value[k] * WHITE_XYZ[k] for k in range(3))
    return dr.kind_of(value)(*(float(row[0]) * x + float(row[1]) * y + float(row[2]) * z for row in XYZ_TO_RGB))
