# SPDX-License-Identifier: Apache-2.0
"""The pictures that belong to rows, as files a report can show."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.tone_mapping import DisplayView
from ...report.picture import displayed_linear
from ...types.image import Pixels
from .row import Task


def picture_file(folder: Path, task: Task) -> Path:
    """Where the picture of a method's result lies; the methods ``reference`` and ``truth`` are the scene's own."""
    return folder / f"{task.scenario}-{task.scene:03d}" / f"{task.method}.jpg"


def shown_picture(pixels: Pixels, truth: Pixels, mask: NDArray[np.bool_]) -> bytes:
    """A JPEG of scene-linear pixels, exposed for the object in the true picture, so that a scene's pictures compare.

    A report holds hundreds of them; noise makes PNG six times as large.
    """
    from PIL import Image as Pillow  # slow to import

    display = displayed_linear(pixels, DisplayView.for_scene(truth, mask))
    file = io.BytesIO()
    Pillow.fromarray(np.rint(display * 255).astype(np.uint8), "RGB").save(file, "JPEG", quality=90, subsampling=0)
    return file.getvalue()
