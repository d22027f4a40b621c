# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's view as a table of colours that Blender itself rendered: transform, look, exposure, gamma, curves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...process.temporary_folder import temporary_folder
from ..files.exr_file import write_exr
from ..images.color_space import from_rec709
from .reference_view import output_view

NAME = "view_lut.exr"
SIZE = 48
# Steps of 3/8 stop put a node exactly at white, where the view Standard clips; AgX spans -12.5 to 4.03 stops
LOG2_MIN, LOG2_MAX = -12.75, 4.5


@dataclass(frozen=True)
class ViewLut:
    """Display values by scene-linear Rec.709 colour.

    `table` is float32 (48, 48, 48, 3) by blue, green and red; the first node of an axis is black, the others lie at
    2^log2_min to 2^log2_max, evenly in the logarithm.
    """

    table: NDArray[np.float32]
    log2_min: float
    log2_max: float

    def write(self, folder: Path) -> None:
        """Put the table into `folder`: a picture with a row for each blue node, green nodes side by side, red fastest.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        write_exr(folder / NAME, self.table.reshape(SIZE, SIZE * SIZE, 3))

    def request(self) -> dict[str, Any]:
        """The object `lut` of request.json."""
        return {"path": NAME, "size": SIZE, "log2_min": self.log2_min, "log2_max": self.log2_max}


def bake_view_lut(scene: bpy.types.Scene) -> ViewLut:
    """Render a ramp of colours under the view of `scene`; nothing in the .blend changes."""
    # the view's exposure comes first, so the range moves against it and the table is as fine as without
    low, high = (limit - output_view(scene)[0].exposure for limit in (LOG2_MIN, LOG2_MAX))
    axis = np.concatenate([[0.0], np.exp2(np.linspace(low, high, SIZE - 1))])
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    shown = shown_by(scene, np.stack([red, green, blue], axis=-1).reshape(SIZE, SIZE * SIZE, 3))
    return ViewLut(shown.reshape(SIZE, SIZE, SIZE, 3), low, high)


def shown_by(scene: bpy.types.Scene, linear: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return the display values (height, width, 3) that Blender writes to a 16-bit PNG for linear Rec.709 colours."""
    height, width = linear.shape[:2]
    pixels = np.ones((height, width, 4), dtype=np.float32)
    pixels[:, :, :3] = from_rec709(linear)
    copied = scene.copy()  # has the user's view with its curves, and may be changed
    image = bpy.data.images.new("Material Fit view", width, height, alpha=False, float_buffer=True)
    written = None
    try:
        settings = copied.render.image_settings
        if output_view(scene)[0] == scene.view_settings:  # else the output has a view of its own, which stays
            settings.color_management = "FOLLOW_SCENE"
        if hasattr(settings, "media_type"):  # Blender 5.0
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "16"
        settings.compression = 0
        image.pixels.foreach_set(pixels.ravel())
        with temporary_folder("view") as folder:
            path = str(folder / "view.png")
            image.save_render(path, scene=copied)
            written = bpy.data.images.load(path, check_existing=False)
            written.colorspace_settings.name = "Non-Color"
            found = np.empty(height * width * written.channels, dtype=np.float32)
            written.pixels.foreach_get(found)
        return found.reshape(height, width, -1)[:, :, :3].copy()
    finally:
        for picture in (image, written):
            if picture is not None:
                bpy.data.images.remove(picture)
        bpy.data.scenes.remove(copied)
