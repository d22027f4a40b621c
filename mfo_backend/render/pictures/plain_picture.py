# SPDX-License-Identifier: Apache-2.0
"""A picture of a scene as it is, whatever its material: references that the fitted model cannot reach."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...types.image import Pixels
from ..machine.variant import load_variant
from .mitsuba_renderer import two_threads


class PlainScene:
    """A loaded scene file.

    Raises
    ------
    SetupError
        If Mitsuba or LLVM is missing.
    """

    def __init__(self, file: Path) -> None:
        load_variant()
        import mitsuba as mi

        from ...material.plugins.measured_network import register

        register()
        with two_threads():
            # plugins in Python want this thread
            self._scene = mi.load_file(str(file), optimize=False, parallel=False)

    def image(self, *, seed: int, spp: int) -> Pixels:
        """Scene-linear pixels; one that Mitsuba leaves non-finite is black."""
        import mitsuba as mi

        pixels = np.array(mi.render(self._scene, seed=mi.UInt32(seed), spp=spp), dtype=np.float32)[..., :3]
        pixels[~np.isfinite(pixels).all(axis=2)] = 0.0
        return pixels
