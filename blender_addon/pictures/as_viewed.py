# SPDX-License-Identifier: GPL-3.0-or-later
"""A reference as the view of its scene shows it."""

from __future__ import annotations

import bpy
import numpy as np

from ..export.images.color_space import linear_to_srgb
from ..export.images.image_pixels import read_pixels
from ..export.reference.reference import holds_display_colours
from ..export.reference.reference_view import STANDARD, mixed_by
from ..export.reference.view_lut import shown_by
from .view_paint import Display


def as_viewed(image: bpy.types.Image, scene: bpy.types.Scene) -> Display:
    """Display values of a reference beside which those of the scene's view can be laid.

    A render in this scene is shown as it is, scene-linear values go through the scene's view. So does a photograph,
    from the light that would have given it under Standard with the scene's exposure and gamma.

    Raises
    ------
    UnreadableImageError
        If the image is no single picture, or its colour space is not known.
    """
    pixels = read_pixels(image)
    if not holds_display_colours(image):
        pixels[..., :3] = shown_by(scene, pixels[..., :3])
    elif scene.mfo.reference_view == STANDARD and mixed_by(scene):
        view = scene.view_settings
        pixels[..., :3] = shown_by(scene, pixels[..., :3] ** view.gamma / 2.0**view.exposure)
    else:
        pixels[..., :3] = linear_to_srgb(pixels[..., :3])
    return np.clip(pixels[::-1], 0.0, 1.0)
