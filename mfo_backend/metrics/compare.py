# SPDX-License-Identifier: Apache-2.0
"""Every metric of two pictures at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..types.image import Encoding, Image
from .display.colour import linear_from_srgb
from .display.tone_mapping import DisplayView, View
from .flip.flip_error import flip_error, hdr_flip_error, shown
from .losses.loss import DISPLAY_NITS
from .pixels.pixel_check import check_mask, check_pair
from .responses.itp import de_itp_map
from .responses.pu21 import pu21
from .responses.response import logarithmic_for, nits_per_unit, relative_to

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Comparison:
    """How far a test picture is from a reference.

    Attributes
    ----------
    metrics
        Mean over the mask by name; None where a metric is not defined for the pair.
    maps
        The error of every pixel (height, width), for the metrics that are shown.
    notes
        What was assumed, in sentences.
    """

    metrics: dict[str, float | None]
    maps: dict[str, Array]
    notes: tuple[str, ...]


def compare_images(
    reference: Image, test: Image, *, mask: NDArray[np.bool_] | None = None, display: View | None = None
) -> Comparison:
    """All metrics of `test` against `reference`.

    Two scene-linear pictures are compared as radiance, and FLIP through `display` or a gamma curve exposed for the
    reference. If one of them holds display values, both are compared as what a display with a white of 100 cd/m^2
    shows. Maps are of the whole picture; `mask` (height, width) limits the means.

    Returns ``mse`` (radiance, or display values), ``log_mse`` and ``relative_mse`` (radiance only), ``pu21_mse``,
    ``flip``, ``hdr_flip`` (radiance only) and ``de_itp`` in just noticeable differences.

    Raises
    ------
    BadInputError
        For pictures of different size or with NaN or infinite pixels, or a mask of another size or without pixels.
    """
    check_pair(reference.pixels, test.pixels)
    if mask is not None:
        check_mask(mask, reference.pixels.shape[:2])
    linear = reference.encoding is Encoding.LINEAR and test.encoding is Encoding.LINEAR
    maps = {"flip": flip_error(reference, test, display=display).map}
    if linear:
        a, b = (np.maximum(image.pixels, 0) for image in (reference, test))
        nits = nits_per_unit(a)
        notes = [f"1 unit of radiance counts as {nits:.4g} cd/m^2: the median of the reference's lit pixels is at 100."]
        maps["mse"] = _square(reference.pixels, test.pixels)
        logarithmic, relative = logarithmic_for(a), relative_to(a)
        maps["log_mse"] = _square(logarithmic.apply(a), logarithmic.apply(b))
        maps["relative_mse"] = _square(relative.apply(a), relative.apply(b))
        maps["hdr_flip"] = hdr_flip_error(reference, test).map
    else:
        view = display or DisplayView()
        displayed = [np.clip(shown(image, view), 0, 1) for image in (reference, test)]
        a, b = (linear_from_srgb(image) for image in displayed)
        nits = DISPLAY_NITS
        notes = [
            "Display values were compared: HDR-FLIP and the errors of radiance need two linear pictures (EXR, HDR)."
        ]
        maps["mse"] = _square(*displayed)
    maps["pu21_mse"] = _square(*(pu21(image * np.float32(nits)) for image in (a, b)))
    maps["de_itp"] = de_itp_map(a, b, nits)
    for name, image in (("reference", reference), ("test image", test)):
        negative = int((image.pixels < 0).any(axis=-1).sum())
        if negative:
            notes.append(f"The {name} has {negative} pixels with negative values; all metrics but mse took them as 0.")
    names = ("mse", "log_mse", "relative_mse", "pu21_mse", "flip", "hdr_flip", "de_itp")
    metrics = {name: _mean(maps[name], mask) if name in maps else None for name in names}
    return Comparison(metrics, maps, tuple(notes))


def _square(reference: Array, test: Array) -> Array:
    return np.mean(np.square(np.subtract(test, reference, dtype=np.float64)), axis=-1)


def _mean(error: Array, mask: NDArray[np.bool_] | None) -> float:
    return float(np.mean(error if mask is None else error[mask], dtype=np.float64))
