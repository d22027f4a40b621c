# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a .blend a reference picture shows: frame, camera, scene, view layer, exposure, and its own size."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ...versions import cycles_settings
from ..camera.render_region import Size, pictured_size
from ..findings import ExportError
from ..images.picture_header import read_header
from .counted_part import picture_of
from .reference import Picture
from .turned_picture import SIDEWAYS

MOST_PICTURES = 32  # as the backend's `job.folder.request`
_MOST_EXPOSURE = 32.0  # stops, as Blender's own view exposure


@dataclass(frozen=True)
class PictureSetup:
    """One of the pictures of a fit; empty names and no frame stand for what the file shows as it is.

    Attributes
    ----------
    number
        Counted from 1 in the order that the user gave them in, those that are left out included.
    exposure
        Stops that the picture is brighter than a render of the scene.
    """

    reference: Picture
    number: int = 1
    frame: int | None = None
    camera: str = ""
    scene: str = ""
    view_layer: str = ""
    exposure: float = 0.0

    @property
    def name(self) -> str:
        """The file's or the image's name."""
        return self.reference.name

    @property
    def label(self) -> str:
        """Number and name for messages."""
        return f"{self.number} ({self.name})"

    def request(self, context: bpy.types.Context) -> dict[str, Any]:
        """What request.json says of it; `context` shows it."""
        scene = context.scene
        return {
            "number": self.number,
            "name": self.name,
            "frame": scene.frame_current,
            "camera": scene.camera.name if scene.camera is not None else "",
            "scene": scene.name,
            "view_layer": context.view_layer.name,
        }


@contextmanager
def shown(
    context: bpy.types.Context, setup: PictureSetup, obj: bpy.types.Object, *, own_size: bool
) -> Iterator[bpy.types.Context]:
    """Have the file show what a picture does, and put everything back on leaving.

    With `own_size` the output has the picture's size.

    Raises
    ------
    ExportError
        If the file has no such scene, view layer or camera, the frame is outside of the scene's, or the object is not
        in the view layer.
    """
    scene, layer = _scene_and_layer(context, setup)
    camera = _camera(scene, setup)
    if obj.name not in layer.objects:
        raise ExportError(f"Object '{obj.name}' is not in the view layer '{layer.name}' of scene '{scene.name}'.")
    if setup.frame is not None and not scene.frame_start <= setup.frame <= scene.frame_end:
        raise ExportError(
            f"Frame {setup.frame} is outside of the frames {scene.frame_start} to {scene.frame_end} of scene "
            f"'{scene.name}': give one of these, or change the range."
        )
    if not abs(setup.exposure) <= _MOST_EXPOSURE:
        raise ExportError(f"The exposure is {setup.exposure:g} stops: give -{_MOST_EXPOSURE:g} to {_MOST_EXPOSURE:g}.")
    changed: list[tuple[Any, str, Any]] = []

    def put(owner: Any, name: str, value: Any) -> None:
        before = getattr(owner, name)
        if before != value:
            changed.append((owner, name, before))
            setattr(owner, name, value)

    frame = (scene.frame_current, scene.frame_subframe)
    try:
        if setup.frame is not None and (setup.frame, 0.0) != frame:
            scene.frame_set(setup.frame)
        if camera is not None:
            put(scene, "camera", camera)
        cycles = cycles_settings(scene)
        if setup.exposure and cycles is not None:
            put(cycles, "film_exposure", cycles.film_exposure * 2.0**setup.exposure)
        size = size_of(setup.reference) if own_size else None
        if size is not None and size != pictured_size(scene.render, size):
            put(scene.render, "resolution_percentage", 100)
            put(scene.render, "resolution_x", size[0])
            put(scene.render, "resolution_y", size[1])
        with context.temp_override(scene=scene, view_layer=layer):
            yield bpy.context
    finally:
        for owner, name, before in reversed(changed):
            setattr(owner, name, before)
        if (scene.frame_current, scene.frame_subframe) != frame:
            scene.frame_set(frame[0], subframe=frame[1])


@contextmanager
def named(setup: PictureSetup, count: int) -> Iterator[None]:
    """Have the errors of one of several pictures begin with its number and name."""
    try:
        yield
    except ExportError as error:
        if count == 1:
            raise
        raise type(error)(f"Picture {setup.label}: {error}", *error.fixes) from error


def check_setups(setups: Sequence[PictureSetup]) -> None:
    """Raise `ExportError` for no picture or more than fit together."""
    if not setups:
        raise ExportError("All pictures are left out: leave one in at least.")
    if len(setups) > MOST_PICTURES:
        raise ExportError(f"There are {len(setups)} pictures: at most {MOST_PICTURES} are fitted together.")


def _scene_and_layer(context: bpy.types.Context, setup: PictureSetup) -> tuple[bpy.types.Scene, bpy.types.ViewLayer]:
    scene = context.scene
    if setup.scene:
        scene = bpy.data.scenes.get(setup.scene)
        if scene is None:
            names = ", ".join(each.name for each in bpy.data.scenes)
            raise ExportError(f"The file has no scene '{setup.scene}': its scenes are: {names}.")
    if setup.view_layer:
        layer = scene.view_layers.get(setup.view_layer)
        if layer is None:
            names = ", ".join(each.name for each in scene.view_layers)
            raise ExportError(f"Scene '{scene.name}' has no view layer '{setup.view_layer}': it has: {names}.")
        return scene, layer
    return scene, context.view_layer if scene == context.scene else scene.view_layers[0]


def _camera(scene: bpy.types.Scene, setup: PictureSetup) -> bpy.types.Object | None:
    """The picture's camera; None for the one that the scene shows at the frame."""
    if not setup.camera:
        return None
    camera = scene.objects.get(setup.camera)
    if camera is None or camera.type != "CAMERA":
        names = ", ".join(each.name for each in scene.objects if each.type == "CAMERA") or "none"
        raise ExportError(f"Scene '{scene.name}' has no camera '{setup.camera}': its cameras are: {names}.")
    return camera


def size_of(picture: Picture | None, *, upright: bool = False) -> Size | None:
    """Width and height of a picture, None where they are not known without reading it.

    `upright` says that it is turned as its EXIF data say.
    """
    if picture is None:
        return None
    reference = picture_of(picture)
    if isinstance(reference, bpy.types.Image):
        return (reference.size[0], reference.size[1]) if all(reference.size) else None
    path = Path(bpy.path.abspath(str(reference)))
    header = read_header(path) if path.is_file() else None
    if header is None or not (header.width and header.height):
        return None
    width, height = header.width, header.height
    return (height, width) if upright and header.orientation in SIDEWAYS else (width, height)
