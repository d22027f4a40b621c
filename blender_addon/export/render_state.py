# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender evaluates for the viewport; here it evaluates for the render, for as long as an export reads the scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import bpy

from .findings import Findings

# (type of data or modifier, what the viewport uses, what the render uses)
RENDER_TWINS = {
    "SUBSURF": ("levels", "render_levels"),
    "MULTIRES": ("levels", "render_levels"),
    "SCREW": ("steps", "render_steps"),
    "OCEAN": ("viewport_resolution", "resolution"),
}


@contextmanager
def render_state(view_layer: bpy.types.ViewLayer, scene: bpy.types.Scene) -> Iterator[None]:
    """Give modifiers, curves and visibility their render settings, and put everything back on leaving."""
    changed: list[tuple[Any, str, Any]] = []
    hidden: list[bpy.types.Object] = []
    view_layer.update()  # a script may have removed objects, which are None until then
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
            for name in ("simplify_subdivision", "simplify_child_particles"):
                put(scene.render, name, getattr(scene.render, f"{name}_render"))
        in_layer = set(view_layer.objects)
        for item in bpy.data.objects:
            # what is hidden is left out of collections' instances; particles and nodes that name it still show it
            if item.mode == "OBJECT" or not item.hide_render:
                put(item, "hide_viewport", item.hide_render)
            # also of a source of particles or nodes that is put away; `show_self` of every instance asks for it
            put(item, "show_instancer_for_viewport", item.show_instancer_for_render)
            if not item.hide_render and item in in_layer and item.hide_get(view_layer=view_layer):
                hidden.append(item)
                item.hide_set(False, view_layer=view_layer)
            _use_render_settings(item, put)  # also of what is hidden: a Boolean or nodes may take its faces
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


def shown_object(name: str, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bpy.types.Object | None:
    """The object of that name in the scene, or in a collection that is shown by its instances alone.

    A collection that is appended as an instance, as the asset browser does it, is in no scene.
    """
    if (obj := scene.objects.get(name)) is not None:
        return obj
    instanced = instanced_objects(view_layer)
    return next((each for each in bpy.data.objects if each.name == name and each.name_full in instanced), None)


def without_modifiers(view_layer: bpy.types.ViewLayer) -> set[str]:
    """Return the names of the objects that Cycles takes without their modifiers where particles are of them.

    An object of the layer that the layer does not render is not evaluated for them, only for what else shows it
    (measured with Blender 4.3, 5.0 and 5.2).
    """
    in_layer = {item.name_full for item in view_layer.objects}
    return in_layer - rendered_objects(view_layer) - instanced_objects(view_layer)


def rendered_layer(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bpy.types.ViewLayer:
    """Return `view_layer`, or the first of `scene` that is rendered if that one is not."""
    return view_layer if view_layer.use else next((layer for layer in scene.view_layers if layer.use), view_layer)


def layer_collections(view_layer: bpy.types.ViewLayer) -> Iterator[bpy.types.LayerCollection]:
    """The collections of `view_layer` that are not excluded, parents first."""
    return (layer for layer in _layer_collections(view_layer.layer_collection) if not layer.exclude)


def _use_render_settings(item: bpy.types.Object, put: Any) -> None:
    edited = is_edited(item)
    for modifier in item.modifiers:
        if not edited:
            put(modifier, "show_viewport", modifier.show_render)
        if modifier.type in RENDER_TWINS and not (edited and _is_off_while_edited(modifier)):
            viewport, render = RENDER_TWINS[modifier.type]
            put(modifier, viewport, getattr(modifier, render))
    for system in item.particle_systems:
        # particles that move lose what was computed of them with any of these; `note_viewport` names them
        if system.settings.type == "HAIR":
            for name, value in _particles_of_render(system.settings).items():
                put(system.settings, name, value)
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


def note_viewport(depsgraph: bpy.types.Depsgraph, findings: Findings) -> None:
    """Name what the viewport alone shows and no `render_state` makes that of the render."""
    for item in depsgraph.objects:
        original = item.original
        if original.hide_render:
            continue
        for system in original.particle_systems:
            settings = system.settings
            other = any(getattr(settings, name) != value for name, value in _particles_of_render(settings).items())
            if settings.type == "EMITTER" and other:
                findings.note(
                    f"Particles '{system.name}' of '{original.name}' are as the viewport shows them; Cycles may show "
                    "more. Set Viewport Display to Rendered and its Amount to 100 %."
                )
        if original.mode == "SCULPT" and (len(original.modifiers) or original.use_dynamic_topology_sculpting):
            findings.note(
                f"Object '{original.name}' is in Sculpt Mode, where its modifiers are not as in a render: leave Sculpt "
                "Mode before the fit."
            )
        if is_edited(original) and _differs_while_edited(original):
            findings.note(
                f"The mesh of '{original.name}' is in Edit Mode, where Cycles renders modifiers and shape keys as Edit "
                "Mode shows them: leave it before the fit, unless the reference was made in it."
            )
        for modifier in original.modifiers:
            if modifier.type == "NODES" and modifier.show_render and _asks_viewport(modifier.node_group):
                findings.note(
                    f"Geometry nodes of '{original.name}' ask whether they are for the viewport (Is Viewport): the fit "
                    "has what they make there, Cycles what they make for a render."
                )


def is_edited(item: bpy.types.Object) -> bool:
    """Whether Blender evaluates an object for Edit Mode, in a render, too: its mesh is edited, by whichever object."""
    return item.type == "MESH" and item.data.is_editmode


def _differs_while_edited(item: bpy.types.Object) -> bool:
    if item.data.shape_keys is not None and not item.use_shape_key_edit_mode:
        return True
    return any(each.show_render == _is_off_while_edited(each) for each in item.modifiers)


def _is_off_while_edited(modifier: bpy.types.Modifier) -> bool:
    """Whether Edit Mode leaves a modifier out; a subdivision of no levels there counts, in a render, too."""
    shown = modifier.show_viewport and modifier.show_in_editmode
    return not shown or (modifier.type in ("SUBSURF", "MULTIRES") and modifier.levels == 0)


def _particles_of_render(settings: bpy.types.ParticleSettings) -> dict[str, Any]:
    """What a render takes for settings of the viewport, of particles that are objects."""
    if settings.render_type not in ("OBJECT", "COLLECTION"):
        return {}
    of_children = {} if settings.child_type == "NONE" else {"child_percent": settings.rendered_child_count}
    return {"display_method": "RENDER", "display_percentage": 100, **of_children}


def _asks_viewport(tree: bpy.types.NodeTree | None) -> bool:
    if tree is None:
        return False
    for node in tree.nodes:
        if node.bl_idname == "GeometryNodeIsViewport" and node.outputs[0].is_linked:
            return True
        if node.bl_idname == "GeometryNodeGroup" and _asks_viewport(node.node_tree):
            return True
    return False


def _layer_collections(root: bpy.types.LayerCollection) -> Iterator[bpy.types.LayerCollection]:
    yield root
    for child in root.children:
        yield from _layer_collections(child)


def shown_by(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    """What puts an instance into the scene, whose settings Cycles takes beside those of the object: itself, if it is
    no instance."""
    return instance.parent if instance.is_instance and instance.parent is not None else instance.object


def geometry_of(instance: bpy.types.DepsgraphObjectInstance, bare: set[str]) -> bpy.types.Object:
    """The object with the faces that Cycles shows of an instance, not evaluated where `without_modifiers` has it."""
    item, system = instance.object, instance.particle_system
    of_particle = system is not None and system.settings.render_type == "OBJECT"
    return item.original if of_particle and item.type == "MESH" and item.original.name_full in bare else item


def hides_original(item: bpy.types.Object) -> bool:
    """Whether Cycles shows an object by its instances alone: one whose parent has it on its vertices or faces."""
    return item.parent is not None and item.parent.instance_type in ("VERTS", "FACES")
