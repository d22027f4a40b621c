# SPDX-License-Identifier: Apache-2.0
"""ColorVideoVDP: the quality of a picture as an observer would judge it, in just objectionable differences.

References
----------
Mantiuk et al., "ColorVideoVDP: A visual difference predictor for image, video and display distortions", SIGGRAPH 2024;
computed by the authors' package cvvdp.

It compares contrast, each picture's against its own surround. The same factor on all pixels of a picture (more light,
another exposure) therefore leaves it at 10: alone it cannot tell how bright a material is that fills the picture.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError
from ..pixels.pixel_check import check_pair
from .packages import CVVDP, require_pycvvdp, require_torch
from .viewing import Viewing

Array = NDArray[np.floating]

LEAST_SIZE = 2  # pixels; the package has no pyramid for less


class ColorVideoVdp:
    """ColorVideoVDP against one reference, on the CPU.

    Parameters
    ----------
    reference
        Light of the display, linear Rec.709 in cd/m^2, (height, width, 3).
    viewing
        Display and distance.

    Raises
    ------
    SetupError
        If the package is not installed.
    BadInputError
        For a picture too small for the metric.
    """

    def __init__(self, reference: Array, viewing: Viewing) -> None:
        self._torch: Any = require_torch("ColorVideoVDP", CVVDP)
        package = require_pycvvdp()
        height, width = reference.shape[:2]
        if min(height, width) < LEAST_SIZE:
            raise BadInputError(
                f"ColorVideoVDP needs pictures of at least {LEAST_SIZE}x{LEAST_SIZE} pixels, "
                f"but the reference is {width}x{height}: compare larger ones."
            )
        self._reference = self._tensor(reference)
        self._shape = reference.shape
        self._metric: Any = package.cvvdp(
            display_photometry=package.vvdp_display_photo_eotf(
                viewing.peak_nits,
                contrast=viewing.contrast,
                source_colorspace="BT.709-linear",
                EOTF="linear",
                E_ambient=viewing.ambient_lux,
            ),
            display_geometry=package.vvdp_display_geometry([width, height], ppd=viewing.pixels_per_degree),
            quiet=True,
            device=self._torch.device("cpu"),
        )
        self.version = str(self._metric.version)

    def jod(self, test: Array) -> float:
        """Quality of a picture in cd/m^2: 10 is no difference, and one less is seen by 75 % of observers."""
        with self._torch.no_grad(), _quiet():
            return self._metric.predict(self._tensor(test), self._reference, dim_order="BCFHW")[0].item()

    def value(self, test: Array) -> float:
        """10 - JOD."""
        return 10 - self.jod(test)

    def value_and_gradient(self, test: Array) -> tuple[float, Array]:
        """10 - JOD and its gradient with respect to the test picture, (height, width, 3)."""
        tensor = self._tensor(test).requires_grad_()
        with _quiet():
            value = self._metric.loss(tensor, self._reference, dim_order="BCFHW")
        value.backward()
        gradient = tensor.grad[0, :, 0].permute(1, 2, 0).numpy()
        return value.item(), np.ascontiguousarray(gradient, dtype=test.dtype)

    def _tensor(self, pixels: Array) -> Any:
        planes = np.ascontiguousarray(pixels.transpose(2, 0, 1), dtype=np.float32)
        return self._torch.from_numpy(planes)[None, :, None]


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the package's warning about dark pictures, which a fit would print at every step."""
    disabled = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        yield
    finally:
        logging.disable(disabled)


def color_video_vdp_jod(reference: Array, test: Array, viewing: Viewing) -> float:
    """JOD of `test` against `reference`, both linear Rec.709 in cd/m^2; see `ColorVideoVdp`."""
    check_pair(reference, test)
    return ColorVideoVdp(reference, viewing).jod(test)
