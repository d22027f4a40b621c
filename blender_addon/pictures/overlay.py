# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference over the camera's view: a background image of the camera, with an image of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import bpy
import numpy as np

from ..export.camera.render_region import picture_size, pictured_region
from ..export.images.image_pixels import UnreadableImageError
from . import view_paint
from .as_viewed import as_viewed
from .view_paint import Display, Paint

NAME = "Material Fit Overlay"  # of the image, by which the background is known again
LONGEST_SIDE = 2048  # pixels: no view shows more, and a line that is dragged paints all of them anew


@dataclass(frozen=True)
class _Shown:
    """The image that lies over a view, by its number in the session, its picture, and the paint made of that by `way`.

    Paint of a large picture takes half a second: a line that is dragged, and an undo, take it as it is.
    """

    image: int
    picture: Display
    way: Callable[[Display], Paint]
    paint: Paint


_shown: _Shown | None = None


def is_shown(camera: bpy.types.Object | None) -> bool:
    """Whether the reference lies over this camera's view."""
    return _background(camera) is not None


def show(scene: bpy.types.Scene) -> None:
    """Put the reference over the view of the scene's camera, in the way that the settings say.

    A file whose pixels Blender does not give, as an EXR of several layers, is seen through, but neither split nor
    subtracted.

    Raises
    ------
    RuntimeError
        If its file cannot be read, or not in that way.
    """
    global _shown
    settings = scene.mfo
    hide(scene.camera)
    image = _loaded(settings)
    try:
        picture = _in_frame(image, scene)
    except UnreadableImageError as problem:
        if settings.overlay.mode != "BLEND":
            bpy.data.images.remove(image)
            raise RuntimeError(f"it {problem}") from None
    else:
        bpy.data.images.remove(image)
        height, width = picture.shape[:2]
        image = bpy.data.images.new(NAME, width, height, alpha=True)
        _shown = _Shown(image.session_uid, picture, view_paint.whole, view_paint.whole(picture))
        image.pixels.foreach_set(_painted(_shown, settings.overlay).ravel())
        image.pack()  # a drawn image whose pixels no file holds is lost with the next undo step
    image.name = NAME
    camera = scene.camera.data
    background = camera.background_images.new()
    background.image, background.display_depth, background.frame_method = image, "FRONT", "CROP"
    background.alpha = _opacity(settings.overlay)
    camera.show_background_images = True


def change(scene: bpy.types.Scene) -> None:
    """Show it in the way that the settings say now; nothing where it is not shown.

    Raises
    ------
    RuntimeError
        As `show`.
    """
    background = _background(scene.camera)
    if background is None:
        return
    if not repaint(scene):
        show(scene)
    else:
        background.alpha = _opacity(scene.mfo.overlay)  # which also has the view drawn


def repaint(scene: bpy.types.Scene) -> bool:
    """Paint in the way that the settings say now, and return whether the picture was kept that this takes.

    An undo brings the settings back, and not always the pixels.
    """
    background = _background(scene.camera)
    if background is None or _shown is None or background.image.session_uid != _shown.image:
        return False
    background.image.pixels.foreach_set(_painted(_shown, scene.mfo.overlay).ravel())
    background.image.update()
    return True


def keep() -> None:
    """Let the file that is saved hold what was painted; the line is dragged without that, which takes too long."""
    for image in bpy.data.images:
        if image.name.startswith(NAME) and image.is_dirty:
            image.pack()


def forget() -> None:
    """Free the pixels kept for `change`."""
    global _shown
    _shown = None


def _loaded(settings: bpy.types.PropertyGroup) -> bpy.types.Image:
    """The reference as an image of its own."""
    if settings.reference_source == "IMAGE":
        return settings.reference_image.copy()
    return bpy.data.images.load(str(Path(bpy.path.abspath(settings.reference_path))), check_existing=False)


def _in_frame(image: bpy.types.Image, scene: bpy.types.Scene) -> Display:
    """The picture of the frame, with nothing beside the region that an image shows."""
    region = pictured_region(scene.render, (image.size[0], image.size[1]))
    if region is None:
        longer = max(image.size)
        if longer > LONGEST_SIDE:
            image.scale(*(max(round(side * LONGEST_SIDE / longer), 1) for side in image.size))
        return as_viewed(image, scene)
    width, height = picture_size(scene.render)
    pixels = np.zeros((height, width, 4), np.float32)
    inside = pixels[height - region.bottom : height - region.top, region.left : region.right]  # rows from below
    if inside.size:  # a region may have none
        if tuple(image.size) != region.size:
            image.scale(*region.size)
        inside[:] = as_viewed(image, scene)
    return pixels


def _painted(shown: _Shown, over: bpy.types.PropertyGroup) -> Paint:
    global _shown
    way = view_paint.difference if over.mode == "DIFFERENCE" else view_paint.whole
    if shown.way is not way:
        _shown = shown = replace(shown, way=way, paint=way(shown.picture))
    return view_paint.split(shown.paint, over.line) if over.mode == "SPLIT" else shown.paint


def _opacity(over: bpy.types.PropertyGroup) -> float:
    return over.opacity if over.mode == "BLEND" else 1.0


def hide(camera: bpy.types.Object | None) -> None:
    """Take it away, with its image and the pixels kept for it."""
    while camera is not None and (background := _background(camera)) is not None:
        image = background.image
        camera.data.background_images.remove(background)
        camera.data.update_tag()  # else the view goes on with a copy of the camera that shows the freed image
        if _shown is not None and _shown.image == image.session_uid:
            forget()
        bpy.data.images.remove(image)


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
