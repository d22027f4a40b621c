# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender evaluates for the viewport; here it evaluates for the render, for as long as an export reads the scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

# (type of data or modifier, what the viewport uses, what the render uses)
RENDER_TWINS = {
    "SUBSURF": ("levels", "render_levels"),
    "MULTIRES": ("levels", "render_levels"),
}


@contextmanager
def render_state(view_layer: bpy.types.ViewLayer, scene: bpy.types.Scene) -> Iterator[None]:
    """Give modifiers, curves and visibility their render settings, and put everything back on leaving."""
    changed: list[tuple[Any, str, Any]] = []
    hidden: list[bpy.types.Object] = []
    selected = [item for item in view_layer.objects if item.select_get(view_layer=view_layer)]
    active = view_layer.objects.active
    flushed = False

    def put(owner: Any, name: str, value: Any) -> None:
        before = getattr(owner, name)
        if before != value:
            setattr(owner, name, value)
            changed.append((owner, name, before))

    try:
        for collection in _layer_collections(view_layer.layer_collection):
            if collection.exclude:
                continue
            put(collection, "hide_viewport", False)
        # instances and geometry nodes show objects and collections that no view layer has
        for inner in bpy.data.collections:
            put(inner, "hide_viewport", inner.hide_render)
        if scene.render.use_simplify:
            put(scene.render, "simplify_subdivision", scene.render.simplify_subdivision_render)
        in_layer = set(view_layer.objects)
        for item in bpy.data.objects:
            # what is hidden is left out of collections' instances; particles and nodes that name it still show it
            if item.mode == "OBJECT" or not item.hide_render:
                put(item, "hide_viewport", item.hide_render)
            if item.hide_render:
                continue
            if item in in_layer and item.hide_get(view_layer=view_layer):
                hidden.append(item)
                item.hide_set(False, view_layer=view_layer)
            _use_render_settings(item, put)
            flushed |= item.mode == "EDIT" and item.update_from_editmode()
        if changed or hidden or flushed:
            view_layer.update()
        yield
    finally:
        for owner, name, before in reversed(changed):
            setattr(owner, name, before)
        for item in hidden:
            item.hide_set(True, view_layer=view_layer)
        if changed or hidden:
            view_layer.update()
            for item in selected:
                if not item.select_get(view_layer=view_layer) and item.visible_get(view_layer=view_layer):
                    item.select_set(True, view_layer=view_layer)
            if view_layer.objects.active is not active:
                view_layer.objects.active = active


def rendered_objects(view_layer: bpy.types.ViewLayer) -> set[str]:
    """Return the names of the objects that some collection of `view_layer` shows in the render."""
    names: set[str] = set()

    def visit(layer: bpy.types.LayerCollection) -> None:
        if layer.exclude or layer.collection.hide_render:
            return
        names.update(item.name_full for item in layer.collection.objects if not item.hide_render)
        for child in layer.children:
            visit(child)

    visit(view_layer.layer_collection)
    return names


def background_objects(scene: bpy.types.Scene) -> set[str]:
    """Return the names of the objects that a scene shows of its background set, and that of its own."""
    names: set[str] = set()
    seen = {scene.name_full}
    while (scene := scene.background_set) is not None and scene.name_full not in seen:
        seen.add(scene.name_full)
        names |= rendered_objects(next((layer for layer in scene.view_layers if layer.use), scene.view_layers[0]))
    return names


def instanced_objects(view_layer: bpy.types.ViewLayer) -> set[str]:
    """Return the names of the objects in collections that rendered objects of `view_layer` put an instance of."""
    names: set[str] = set()
    rendered = rendered_objects(view_layer)
    todo = [item for item in view_layer.objects if item.name_full in rendered]
    seen: set[str] = set()
    while todo:
        item = todo.pop()
        inner = item.instance_collection if item.instance_type == "COLLECTION" else None
        if inner is None or inner.name_full in seen:
            continue
        seen.add(inner.name_full)
        shown = [each for each in inner.all_objects if not each.hide_render]
        names.update(each.name_full for each in shown)
        todo += shown
    return names


def rendered_layer(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bpy.types.ViewLayer:
    """Return `view_layer`, or the first of `scene` that is rendered if that one is not."""
    return view_layer if view_layer.use else next((layer for layer in scene.view_layers if layer.use), view_layer)


def layer_collections(view_layer: bpy.types.ViewLayer) -> Iterator[bpy.types.LayerCollection]:
    """The collections of `view_layer` that are not excluded, parents first."""
    return (layer for layer in _layer_collections(view_layer.layer_collection) if not layer.exclude)


def _use_render_settings(item: bpy.types.Object, put: Any) -> None:
    for modifier in item.modifiers:
        put(modifier, "show_viewport", modifier.show_render)
        if modifier.type in RENDER_TWINS:
            viewport, render = RENDER_TWINS[modifier.type]
            put(modifier, viewport, getattr(modifier, render))
    data = item.data
    if isinstance(data, bpy.types.MetaBall):
        put(data, "resolution", data.render_resolution)
    elif isinstance(data, bpy.types.Curve):
        # a curve's own resolution overwrites that of its splines, so only texts, which have none, get it
        owners = list(data.splines) or [data]
        for axis in ("u", "v"):
            value = getattr(data, f"render_resolution_{axis}", 0)
            for owner in owners if value else []:
                put(owner, f"resolution_{axis}", value)


def _layer_collections(root: bpy.types.LayerCollection) -> Iterator[bpy.types.LayerCollection]:
    yield root
    for child in root.children:
        yield from _layer_collections(child)
