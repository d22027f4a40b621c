# SPDX-License-Identifier: GPL-3.0-or-later
"""Arbitrary output variables (AOVs) of one object's surface: a Cycles render without light, for values alone."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ..export.camera.camera_model import Region
from ..export.camera.render_region import region_settings, square_size
from ..export.nodes.clear_objects import bends_light, nodes_of, passes_light
from ..versions import save_as_multilayer
from .plain_exr import read_plain_exr

FILTER_MARGIN = 2.0  # pixels around the target: as far as a pixel filter looks
# bytes of one render's AOVs, 16 for each value and subpixel; larger ones are made at a smaller scale
MOST_AOV_BYTES = 2 * 10**9
BYTES_PER_VALUE = 16
LEAST_TRANSPARENT = 16  # surfaces that a ray may pass: those before the target, and its own

Bounds = tuple[int, int, int, int]  # left, top, right and bottom, in pixels of the picture


@dataclass(frozen=True)
class Frame:
    """A part of the picture of square pixels in subpixels: `scale` of them along each side of a pixel, columns `left`
    to `right`."""

    scale: int
    left: int
    top: int
    right: int
    bottom: int
    full: tuple[int, int]  # the whole picture, in subpixels

    @property
    def coarse(self) -> Frame:
        """The same part in pixels."""
        left, top, right, bottom, width, height = (
            side // self.scale for side in (self.left, self.top, self.right, self.bottom, *self.full)
        )
        return Frame(1, left, top, right, bottom, (width, height))


@dataclass(frozen=True)
class Outputs:
    """Values by AOV name, float32 (height, width, 1 or 3), and the frame they are of."""

    values: dict[str, NDArray[np.float32]]
    frame: Frame


def frame_of(
    scene: bpy.types.Scene,
    obj: bpy.types.Object,
    material: bpy.types.Material,
    scale: int,
    outputs: int,
    region: Region | None = None,
    seen: Bounds | None = None,
) -> Frame | None:
    """The frame around `obj`, and whatever else shows the material, with at most `scale` subpixels along a pixel.

    Less where the AOVs would be too large. The picture may show a `region` of it alone. What Cycles has `seen` of it
    may reach beyond its faces, which are those of the evaluated file. None where all of it is beside the picture or
    behind the camera.
    """
    size = square_size(scene.render)
    bounds = _bounds(scene, obj, material, size, region or Region(0, 0, *size))
    bounds = _around(bounds, seen) if bounds and seen else bounds or seen
    if bounds is None:
        return None
    left, top, right, bottom = bounds
    area = max((right - left) * (bottom - top), 1)
    while scale > 1 and area * scale**2 * outputs * BYTES_PER_VALUE > MOST_AOV_BYTES:
        scale //= 2
    sides = (left * scale, top * scale, right * scale, bottom * scale)
    return Frame(scale, *sides, (size[0] * scale, size[1] * scale))


def whole_frame(scene: bpy.types.Scene, region: Region | None) -> Frame:
    """All that the picture shows, a subpixel to a pixel."""
    size = square_size(scene.render)
    return Frame(1, *_whole(size, region or Region(0, 0, *size)), size)


def bounds_of(seen: NDArray[np.bool_], frame: Frame) -> Bounds | None:
    """The pixels of a frame that show something, and as far around them as a pixel filter looks; None where none do."""
    if not seen.any():
        return None
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    margin = int(FILTER_MARGIN)
    return (
        max(frame.left + int(columns[0]) - margin, frame.left),
        max(frame.top + int(rows[0]) - margin, frame.top),
        min(frame.left + int(columns[-1]) + 1 + margin, frame.right),
        min(frame.top + int(rows[-1]) + 1 + margin, frame.bottom),
    )


def _around(first: Bounds, second: Bounds) -> Bounds:
    """What holds both."""
    least, most = (tuple(map(pick, first, second)) for pick in (min, max))
    return least[0], least[1], most[2], most[3]


def world_to_frame(scene: bpy.types.Scene, frame: Frame) -> NDArray[np.float64]:
    """The (3, 4) camera matrix: world (x, y, z, 1) to w times column, row (from the frame's corner) and 1."""
    camera = scene.camera
    depsgraph = bpy.context.evaluated_depsgraph_get()
    evaluated = camera.evaluated_get(depsgraph)
    projection = evaluated.calc_matrix_camera(depsgraph, x=frame.full[0], y=frame.full[1], scale_x=1.0, scale_y=1.0)
    world = evaluated.matrix_world.normalized()  # Cycles ignores the scale of a camera
    clip = np.array(projection @ world.inverted(), dtype=np.float64)
    width, height = frame.full
    x, y, w = clip[0], clip[1], clip[3]
    return np.stack([(x + w) * width / 2 - frame.left * w, (w - y) * height / 2 - frame.top * w, w])


def render_outputs(
    scene: bpy.types.Scene,
    layer: bpy.types.ViewLayer,
    names: Iterable[tuple[str, bool]],
    frame: Frame,
    samples: int,
    *,
    by_pixels: bool = False,
) -> Outputs:
    """Render the AOVs of these names and kinds (True for a colour); the nodes that write them are there already.

    With `by_pixels` rays are as wide as the picture's pixels: each of a pixel's subpixels is a picture of its own, by a
    camera that is shifted.

    Raises
    ------
    RuntimeError
        If Blender cannot render.
    """
    wanted = list(names)
    if not by_pixels or frame.scale == 1:
        return Outputs(_rendered(scene, layer, wanted, frame, samples), frame)
    scale, found = frame.scale, dict[str, NDArray[np.float32]]()
    for row in range(scale):
        for column in range(scale):
            for name, values in _rendered(scene, layer, wanted, frame, samples, (column, row)).items():
                height, width, size = values.shape
                whole = found.setdefault(name, np.empty((height * scale, width * scale, size), np.float32))
                whole[row::scale, column::scale] = values
    return Outputs(found, frame)


def _rendered(
    scene: bpy.types.Scene,
    layer: bpy.types.ViewLayer,
    wanted: list[tuple[str, bool]],
    frame: Frame,
    samples: int,
    subpixel: tuple[int, int] | None = None,
) -> dict[str, NDArray[np.float32]]:
    """The AOVs of a frame, or one subpixel of each of its pixels."""
    pixels = frame if subpixel is None else frame.coarse
    with tempfile.TemporaryDirectory(prefix="aov_") as folder, _settings(scene, layer, pixels, samples) as put:
        if subpixel is not None:
            _look_at(scene, subpixel, frame, put)
        aovs = layer.aovs
        while len(aovs):  # the file is a copy; the scene's own outputs are not asked for
            aovs.remove(aovs[0])
        for name, is_color in wanted:
            aov = aovs.add()
            aov.name, aov.type = name, "COLOR" if is_color else "VALUE"
        path = Path(folder) / "aov.exr"
        put(scene.render, "filepath", str(path))
        bpy.ops.render.render(write_still=True, scene=scene.name, layer=layer.name)
        channels = read_plain_exr(path)
    found = {name: _joined(channels, name) for name, _ in wanted}
    rows, columns = slice(pixels.top, pixels.bottom), slice(pixels.left, pixels.right)
    height, width = pixels.bottom - pixels.top, pixels.right - pixels.left
    if next(iter(found.values())).shape[:2] != (height, width):  # the whole frame, black outside of the border
        found = {name: values[rows, columns] for name, values in found.items()}
    return found


def _look_at(scene: bpy.types.Scene, subpixel: tuple[int, int], frame: Frame, put: Any) -> None:
    """Shift the camera, so that a subpixel's column and row lie in the middle of each pixel, and look there alone."""
    camera, scale = scene.camera.data, frame.scale
    put(scene.cycles, "pixel_filter_type", "GAUSSIAN")  # a box has no width to set
    put(scene.cycles, "filter_width", 1.0 / scale)
    width, height = (size // scale for size in frame.full)
    side = {"AUTO": max(width, height), "HORIZONTAL": width, "VERTICAL": height}[camera.sensor_fit]
    right, down = ((index + 0.5) / scale - 0.5 for index in subpixel)
    put(camera, "shift_x", camera.shift_x + right / side)
    put(camera, "shift_y", camera.shift_y - down / side)


@contextmanager
def _settings(scene: bpy.types.Scene, layer: bpy.types.ViewLayer, frame: Frame, samples: int) -> Iterator[Any]:
    """Settings of a render for values: no light, no blur, only the frame; all is put back."""
    before: list[tuple[Any, str, Any]] = []

    def put(owner: Any, name: str, value: Any) -> None:
        if hasattr(owner, name) and getattr(owner, name) != value:
            before.append((owner, name, getattr(owner, name)))
            setattr(owner, name, value)

    render, cycles = scene.render, scene.cycles
    width, height = frame.full
    try:
        put(render, "engine", "CYCLES")
        put(cycles, "device", "CPU")
        put(cycles, "shading_system", False)  # Open Shading Language writes no outputs
        put(render, "resolution_percentage", 100)
        put(render, "resolution_x", width)
        put(render, "resolution_y", height)
        # Blender 5.0 cannot write multilayer EXR with others
        put(render, "pixel_aspect_x", 1.0)
        put(render, "pixel_aspect_y", 1.0)
        region = Region(frame.left, frame.top, frame.right, frame.bottom)
        for name, value in region_settings(region, frame.full).items():
            put(render, name, value)
        for name in ("use_compositing", "use_sequencer", "use_motion_blur", "use_multiview", "use_freestyle"):
            put(render, name, False)
        put(render, "use_file_extension", False)
        put(render, "use_overwrite", True)
        for name in ("use_adaptive_sampling", "use_denoising", "use_auto_tile", "use_light_tree"):
            put(cycles, name, False)
        for name, value in (("samples", samples), ("max_bounces", 0), ("seed", 0), ("time_limit", 0.0)):
            put(cycles, name, value)
        # what lets a ray pass is counted, and does not end the outputs
        put(cycles, "transparent_max_bounces", max(cycles.transparent_max_bounces, LEAST_TRANSPARENT))
        put(layer, "pass_alpha_threshold", 0.5)
        put(cycles, "pixel_filter_type", "BOX")
        put(scene, "world", None)
        put(scene.camera.data.dof, "use_dof", False)
        for item in scene.objects:
            if item.type == "LIGHT":
                put(item, "hide_render", True)
            elif _is_clear(item):  # behind it there would be no outputs; what it bends is found by its place
                put(item, "visible_camera", False)
        save_as_multilayer(render.image_settings)
        yield put
    finally:
        for owner, name, value in reversed(before):
            setattr(owner, name, value)


def _is_clear(item: bpy.types.Object) -> bool:
    """Whether light goes through an object, and nothing of it is looked at."""
    is_asked = any(node.bl_idname == "ShaderNodeOutputAOV" for node in nodes_of(item))
    return not is_asked and (bends_light(item) or passes_light(item))


def _joined(channels: dict[str, NDArray[np.float32]], name: str) -> NDArray[np.float32]:
    """The channels of one AOV; names are ``layer.aov.X`` or ``layer.aov.R`` and so on."""
    parts = {key.rsplit(".", 1)[1]: values for key, values in channels.items() if key.split(".")[-2:-1] == [name]}
    if not parts:
        raise RuntimeError(f"Cycles has not written the output {name!r}")
    order = ("R", "G", "B") if "R" in parts else ("X", "Y", "Z") if "Y" in parts else tuple(parts)[:1]
    return np.stack([parts[key] for key in order], axis=-1)


def shows(instance: bpy.types.DepsgraphObjectInstance, material: bpy.types.Material) -> bool:
    """Whether an instance has a material, perhaps of a mesh that geometry nodes make."""
    item = instance.object
    own = [slot.material for slot in item.material_slots]
    every = [*own, *getattr(item.data, "materials", ())]
    return any(each is not None and each.original == material for each in every)


def _whole(size: tuple[int, int], region: Region) -> Bounds:
    """The pixels of a region, and as far around them as a pixel filter looks."""
    margin = int(FILTER_MARGIN)
    return (
        max(region.left - margin, 0),
        max(region.top - margin, 0),
        min(region.right + margin, size[0]),
        min(region.bottom + margin, size[1]),
    )


def _bounds(
    scene: bpy.types.Scene,
    obj: bpy.types.Object,
    material: bpy.types.Material,
    size: tuple[int, int],
    region: Region,
) -> Bounds | None:
    """Left, top, right and bottom of the pixels of a region that can see `obj` or the material; all where one of them
    reaches behind the camera, None where there are none."""
    width, height = size
    whole = _whole(size, region)
    corners = []
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for instance in depsgraph.object_instances:
        owner = instance.parent if instance.is_instance else instance.object
        if owner is not None and (owner.original == obj or shows(instance, material)):
            matrix = instance.matrix_world.copy()
            corners += [matrix @ Vector(corner) for corner in instance.object.bound_box]
    if not corners:
        return whole
    seen = [world_to_camera_view(scene, scene.camera, corner) for corner in corners]
    if max(point.z for point in seen) <= 0.0:
        return None
    if min(point.z for point in seen) <= 0.0:
        return whole
    left, right = (pick(point.x for point in seen) * width for pick in (min, max))
    bottom, top = (pick(point.y for point in seen) * height for pick in (min, max))
    found = (
        max(math.floor(left - FILTER_MARGIN), whole[0]),
        max(math.floor(height - top - FILTER_MARGIN), whole[1]),
        min(math.ceil(right + FILTER_MARGIN), whole[2]),
        min(math.ceil(height - bottom + FILTER_MARGIN), whole[3]),
    )
    return found if found[0] < found[2] and found[1] < found[3] else None
