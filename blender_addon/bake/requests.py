# SPDX-License-Identifier: GPL-3.0-or-later
"""What the second Blender renders and bakes when it is asked: worlds, surfaces, displaced meshes and lamps. Painted
images are put back before."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..export.render_state import render_state
from .bake_cache import cached
from .bake_key import lamp_key, surface_key, world_key
from .displaced import displaced_corners
from .lamp import lamp_table
from .panorama import world_panoramas
from .surface import baked_surface


def world(request: Mapping[str, Any]) -> Mapping[str, Any]:
    """Render the world of `scene` into `folder`, `width` pixels around; see `world_panoramas`."""
    scene, place, width = bpy.data.scenes[request["scene"]], Path(request["folder"]), request["width"]
    cache = _cache(request)
    key = world_key(scene, width) if cache is not None else None
    return cached(cache, key, place, lambda: world_panoramas(scene, place, width))


def surfaces(request: Mapping[str, Any]) -> Mapping[str, Any]:
    """Bake each of `surfaces` into a folder of its own number; one that fails says why and stops no other."""
    scene = bpy.data.scenes[request["scene"]]
    found = []
    with _shown(scene, request["view_layer"]):
        for number, asked in enumerate(request["surfaces"]):
            place = Path(request["folder"]) / str(number)
            place.mkdir()
            try:
                found.append({"status": "ok", **_surface(scene, asked, place, _cache(request))})
            except Exception as error:  # one surface is not worth the others
                words = " ".join(str(error).split())
                found.append({"status": "failed", "sentence": f"{type(error).__name__}: {words}"})
    return {"surfaces": found}


def displaced(request: Mapping[str, Any]) -> Mapping[str, Any]:
    """Write the displaced triangles of `instance` into `folder`; see `displaced_corners`."""
    scene = bpy.data.scenes[request["scene"]]
    with _shown(scene, request["view_layer"]):
        place = Path(request["folder"])
        return _of_instance(request["instance"], lambda one, graph: displaced_corners(scene, one, graph, place))


def lamp(request: Mapping[str, Any]) -> Mapping[str, Any]:
    """Measure what the nodes of the lamp of `instance` do, into `folder`; see `lamp_table`."""
    scene = bpy.data.scenes[request["scene"]]
    with _shown(scene, request["view_layer"]):
        place, asked, cache = Path(request["folder"]), request["asked"], _cache(request)

        def measured(instance: bpy.types.DepsgraphObjectInstance, _graph: object) -> dict[str, Any]:
            key = lamp_key(scene, instance, asked) if cache is not None else None
            return cached(cache, key, place, lambda: lamp_table(scene, instance, asked, place))

        return _of_instance(request["instance"], measured)


def paint(request: Mapping[str, Any]) -> Mapping[str, Any]:
    """Give `images` the pixels that the user's Blender has and the copy of the file has not."""
    for painted in request["images"]:
        old = bpy.data.images[painted["name"]]
        new = bpy.data.images.new(painted["name"], *painted["size"], alpha=True, float_buffer=old.is_float)
        new.colorspace_settings.name = old.colorspace_settings.name
        new.alpha_mode = old.alpha_mode
        new.pixels.foreach_set(np.load(painted["pixels"]).reshape(-1))
        old.user_remap(new)
    return {}


def _cache(request: Mapping[str, Any]) -> Path | None:
    return Path(request["cache"]) if request.get("cache") else None


def _surface(scene: bpy.types.Scene, asked: Mapping[str, Any], place: Path, cache: Path | None) -> dict[str, Any]:
    slot, size, rays = asked["slot"], asked["size"], asked["rays"]

    def baked(instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph) -> dict[str, Any]:
        key = surface_key(scene, instance, depsgraph, slot, size, rays) if cache is not None else None
        return cached(cache, key, place, lambda: baked_surface(scene, instance, depsgraph, slot, place, size, rays))

    return _of_instance(asked["instance"], baked)


@contextmanager
def _shown(scene: bpy.types.Scene, view_layer: str) -> Iterator[None]:
    """The scene in the window, as it is rendered."""
    window = bpy.context.window
    window.scene = scene
    window.view_layer = scene.view_layers[view_layer]
    with render_state(window.view_layer, scene):
        yield


def _of_instance(
    name: Mapping[str, Any],
    found: Callable[[bpy.types.DepsgraphObjectInstance, bpy.types.Depsgraph], dict[str, Any]],
) -> dict[str, Any]:
    """What is found of the instance of this name, which is there while the loop is at it and no longer."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for instance in depsgraph.object_instances:
        if name_of(instance) == name:
            return found(instance, depsgraph)
    raise LookupError(f"{name['object']!r} is not there")


def name_of(instance: bpy.types.DepsgraphObjectInstance) -> dict[str, Any]:
    """What tells an instance from all others, in the user's Blender and in the second."""
    parent = instance.parent.name_full if instance.is_instance and instance.parent is not None else ""
    return {"object": instance.object.name_full, "parent": parent, "path": list(instance.persistent_id)}
