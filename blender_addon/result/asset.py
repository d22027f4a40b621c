# SPDX-License-Identifier: GPL-3.0-or-later
"""A material with recovered values as an asset: description, tags, and the picture of its fit as the preview."""

from __future__ import annotations

import json
from datetime import datetime
from pathlib import Path

import bpy
import numpy as np
from numpy.typing import NDArray

from ..export.images.covering import covering
from ..export.images.image_pixels import UnreadableImageError, read_encoded
from .job_result import JobResult, JobResultError, read_job_result

PREVIEW_SIDE = 256  # pixels, as Blender's own previews
TAG = "Material Fit"
_TAGS = {"same": "looks the same", "close": "close", "different": "does not match"}
_MARGIN = 0.08  # of the target's extent, that the preview shows around it


class AssetError(Exception):
    """The material cannot be saved as an asset; the message is one sentence for the user."""


def save_as_asset(material: bpy.types.Material) -> str:
    """Mark a material that has recovered values, and describe it; returns what the preview shows.

    Raises
    ------
    AssetError
        If it has none, or its job folder is gone.
    """
    kept = material.mfo
    if not kept.job_folder or kept.shows_original:
        raise AssetError(f"Material '{material.name}' does not show recovered values: apply a result first.")
    try:
        result = read_job_result(Path(kept.job_folder))
    except JobResultError as error:
        raise AssetError(str(error)) from error
    material.asset_mark()
    data = material.asset_data
    data.description = description_of(result)
    for tag in (TAG, _TAGS.get(result.verdict, "")):
        if tag and tag not in data.tags:
            data.tags.new(tag)
    if show_target(material, result.folder):
        return "the object with the recovered material"
    if bpy.app.background:  # Blender 4.3 ends where it renders a preview without a screen
        return "nothing"
    material.asset_generate_preview()
    return "a sphere"


def description_of(result: JobResult) -> str:
    """The verdict, the reference's name and the day of the fit."""
    day = datetime.fromtimestamp((result.folder / "result.json").stat().st_mtime).strftime("%Y-%m-%d")
    reference = _reference_of(result.folder)
    return " ".join(filter(None, [result.sentence, f"Reference: {reference}." if reference else "", f"Fit: {day}."]))


def show_target(material: bpy.types.Material, folder: Path) -> bool:
    """Make the part of the result's picture that shows the target the preview; False where there is no picture."""
    try:
        picture, counted = (_read(folder / "pictures" / name) for name in ("result.png", "counted.png"))
    except (OSError, RuntimeError, UnreadableImageError):
        return False
    rows, columns = _square_around(counted[:, :, 0] > 0.5)
    square = covering(np.ascontiguousarray(picture[rows, columns]), (PREVIEW_SIDE, PREVIEW_SIDE))
    square[:, :, 3:] = 1.0
    preview = material.preview_ensure()
    preview.image_size = (PREVIEW_SIDE, PREVIEW_SIDE)
    preview.image_pixels_float.foreach_set(np.ascontiguousarray(square[::-1]).ravel())
    return True


def _square_around(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """The least square of the picture around the target, with a margin, moved inside of the picture."""
    spans = [np.flatnonzero(mask.any(axis=1 - axis)) for axis in (0, 1)]
    side = max(int(span[-1]) - int(span[0]) + 1 for span in spans)
    side = min(round(side * (1.0 + 2.0 * _MARGIN)), *mask.shape)
    found = []
    for span, count in zip(spans, mask.shape, strict=True):
        first = round((int(span[0]) + int(span[-1]) + 1 - side) / 2)
        first = min(max(first, 0), count - side)
        found.append(slice(first, first + side))
    return found[0], found[1]


def _read(path: Path) -> NDArray[np.float32]:
    """The display values of a PNG, (height, width, 4), first row at the top."""
    image = bpy.data.images.load(str(path), check_existing=False)
    try:
        return read_encoded(image)
    finally:
        bpy.data.images.remove(image)


def _reference_of(folder: Path) -> str:
    """What the picture of the fit was called, empty where the job does not say it."""
    try:
        generator = json.loads((folder / "request.json").read_text("utf-8")).get("generator", {})
        return str(generator.get("reference", ""))
    except (OSError, ValueError, AttributeError):
        return ""
