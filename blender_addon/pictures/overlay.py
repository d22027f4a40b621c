# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference over the camera's view: a background image of the camera, with an image of its own."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ..export.camera.camera_model import Region
from ..export.camera.render_region import Size, picture_size, pictured_region

NAME = "Material Fit Overlay"  # of the image, by which the background is known again


def is_shown(camera: bpy.types.Object | None) -> bool:
    """Whether the reference lies over this camera's view."""
    return _background(camera) is not None


def show(scene: bpy.types.Scene) -> None:
    """Put the reference over the view of the scene's camera.

    Raises
    ------
    RuntimeError
        If its file cannot be read.
    """
    settings = scene.mfo
    hide(scene.camera)
    if settings.reference_source == "IMAGE":
        image = settings.reference_image.copy()
    else:
        image = bpy.data.images.load(str(Path(bpy.path.abspath(settings.reference_path))), check_existing=False)
    region = pictured_region(scene.render, (image.size[0], image.size[1]))
    if region is not None:
        image = _in_frame(image, region, picture_size(scene.render))
    image.name = NAME
    camera = scene.camera.data
    background = camera.background_images.new()
    background.image, background.display_depth = image, "FRONT"
    background.frame_method, background.alpha = "CROP", settings.overlay_opacity
    camera.show_background_images = True


def _in_frame(image: bpy.types.Image, region: Region, size: Size) -> bpy.types.Image:
    """An image of a frame that shows `image`, which goes away, in a region and nothing beside."""
    width, height = size
    framed = bpy.data.images.new(NAME, width, height, alpha=True, float_buffer=image.is_float)
    framed.colorspace_settings.name = image.colorspace_settings.name
    shown = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(shown)
    shown = shown.reshape(image.size[1], image.size[0], image.channels)
    pixels = np.zeros((height, width, 4), np.float32)
    inside = pixels[height - region.bottom : height - region.top, region.left : region.right]  # rows from below
    inside[..., 3] = 1.0
    inside[..., : image.channels] = shown if image.channels > 2 else shown[..., :1]
    framed.pixels.foreach_set(pixels.ravel())
    framed.pack()  # a drawn image whose pixels no file holds is lost with the next undo step
    bpy.data.images.remove(image)
    return framed


def hide(camera: bpy.types.Object | None) -> None:
    """Take it away, with its image."""
    while camera is not None and (background := _background(camera)) is not None:
        image = background.image
        camera.data.background_images.remove(background)
        bpy.data.images.remove(image)


def set_opacity(camera: bpy.types.Object | None, opacity: float) -> None:
    """How much of the reference is seen, 0 to 1."""
    background = _background(camera)
    if background is not None:
        background.alpha = opacity


def background_of(camera: bpy.types.Object | None) -> bpy.types.Image | None:
    """The picture that the user, fSpy or a motion tracker has put behind the view, None where there is none."""
    for background in camera.data.background_images if camera is not None and camera.type == "CAMERA" else ():
        image = background.image
        if background.source == "IMAGE" and image is not None and not image.name.startswith(NAME):
            return image
    return None


def _background(camera: bpy.types.Object | None) -> bpy.types.CameraBackgroundImage | None:
    for background in camera.data.background_images if camera is not None and camera.type == "CAMERA" else ():
        if background.image is not None and background.image.name.startswith(NAME):
            return background
    return None
