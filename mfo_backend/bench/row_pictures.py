# SPDX-License-Identifier: Apache-2.0
"""The pictures that belong to rows, as files a report can show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..metrics.tone_mapping import DisplayView
from ..report.picture import displayed_linear, png_bytes
from ..types.image import Pixels
from .row import Task


def picture_file(folder: Path, task: Task) -> Path:
    """Where the picture of a method's result lies; the methods ``reference`` and ``truth`` are the scene's own."""
    return folder / f"{task.scenario}-{task.scene:03d}" / f"{task.method}.png"


def shown_picture(pixels: Pixels, truth: Pixels, mask: NDArray[np.bool_]) -> bytes:
    """A PNG of scene-linear pixels, exposed for the object in the true picture, so that a scene's pictures compare."""
    return png_bytes(displayed_linear(pixels, DisplayView.for_scene(truth, mask)))
