# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of a world whose light has numbers below zero."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..findings import Findings
from ..images.color_space import from_rec709
from .light_model import takes_light


def refuse_negative(name: str, radiance: NDArray[np.floating], findings: Findings) -> None:
    """An error where a world of this name takes light away; a note where its colours alone are beyond Rec.709."""
    if not takes_light(radiance):
        return
    if radiance.shape[-1] == 3 and not takes_light(from_rec709(radiance)):  # numbers of a wider working space
        findings.note(
            f"World '{name}' has colours beyond linear Rec.709, in which the fit counts: they are taken at its edge."
        )
        return
    findings.error(f"World '{name}' takes light away (negative strength or colour): make it positive.")
