# SPDX-License-Identifier: GPL-3.0-or-later
"""What the second Blender renders and bakes when it is asked: worlds, surfaces, and painted images put back before."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..export.render_state import render_state
from .bake_cache import cached
from .bake_key import surface_key, world_key
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
    window = bpy.context.window
    window.scene = scene
    window.view_layer = scene.view_layers[request["view_layer"]]
    found = []
    with render_state(window.view_layer, scene):
        for number, asked in enumerate(request["surfaces"]):
            place = Path(request["folder"]) / str(number)
            place.mkdir()
            try:
                found.append({"status": "ok", **_surface(scene, asked, place, _cache(request))})
            except Exception as error:  # one surface is not worth the others
                words = " ".join(str(error).split())
                found.append({"status": "failed", "sentence": f"{type(error).__name__}: {words}"})
    return {"surfaces": found}


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
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for instance in depsgraph.object_instances:
        if name_of(instance) == asked["instance"]:
            slot, size = asked["slot"], asked["size"]
            key = surface_key(scene, instance, depsgraph, slot, size) if cache is not None else None
            return cached(
                cache,
                key,
                place,
                lambda: baked_surface(scene, instance, depsgraph, slot, place, size),  # noqa: B023
            )
    raise LookupError(f"{asked['instance']['object']!r} is not there")


def name_of(instance: bpy.types.DepsgraphObjectInstance) -> dict[str, Any]:
    """What tells an instance from all others, in the user's Blender and in the second."""
    parent = instance.parent.name_full if instance.is_instance and instance.parent is not None else ""
    return {"object": instance.object.name_full, "parent": parent, "path": list(instance.persistent_id)}
