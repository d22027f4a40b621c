# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene of its own for one object of the depsgraph, evaluated and alone, which Cycles bakes from."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import bpy
from mathutils import Matrix

from ..export.render_state import geometry_of, is_edited, shown_by, without_modifiers
from ..versions import keeps_data_below_subdivision

NAME = "material_fit_bake"
PLACE = (  # an object's own, by which Attribute nodes may ask
    "rotation_mode", "location", "rotation_euler", "rotation_quaternion", "rotation_axis_angle", "scale",
    "delta_location", "delta_rotation_euler", "delta_rotation_quaternion", "delta_scale",
)  # fmt: skip


class Stage(NamedTuple):
    """The scene that is baked in, and the object in it, whose mesh has all modifiers applied."""

    scene: bpy.types.Scene
    item: bpy.types.Object


@contextmanager
def staged(
    scene: bpy.types.Scene, instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph
) -> Iterator[Stage]:
    """A scene with a copy of the instance's evaluated object, whose coordinates are those of the original."""
    matrix = instance.matrix_world.copy()
    mesh = mesh_of(instance, depsgraph)
    item, carrier = bpy.data.objects.new(NAME, mesh), bpy.data.objects.new(NAME, None)
    try:
        _put_there(item, carrier, instance.object, matrix)
        with alone(scene, instance, item) as stage:
            yield Stage(stage, item)
    finally:
        bpy.data.objects.remove(item)
        bpy.data.objects.remove(carrier)
        bpy.data.meshes.remove(mesh)


def mesh_of(instance: bpy.types.DepsgraphObjectInstance, depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    """A new mesh of the faces that an instance shows: those of its object, or others that geometry nodes have made.

    Modifiers are evaluated anew for all its layers: in the object's own place, which an armature asks for. Where
    particles are of what the layer does not render there are none.
    """
    source = geometry_of(instance, without_modifiers(depsgraph.view_layer))
    if source is instance.object.original:
        return source.data.copy()
    item = instance.object.original.evaluated_get(depsgraph)
    if instance.is_instance and instance.object.data != item.data:
        return instance.object.data.copy()
    layers = item.original.type == "MESH"
    return bpy.data.meshes.new_from_object(item, preserve_all_data_layers=layers, depsgraph=depsgraph)


@contextmanager
def alone(
    scene: bpy.types.Scene, instance: bpy.types.DepsgraphObjectInstance, item: bpy.types.Object
) -> Iterator[bpy.types.Scene]:
    """A scene with nothing but `item`, whose nodes find what those of a depsgraph's instance do, for Cycles to bake in.

    Its name is that of the original meanwhile.
    """
    shown, color = instance.object, color_of(instance)
    original = shown.original
    window, stage = bpy.context.window, bpy.data.scenes.new(NAME)
    before, view_layer, name = window.scene, window.view_layer, original.name
    try:
        _copy_what_nodes_ask_for(shown, item)
        item.color = color
        stage.collection.objects.link(item)
        stage.camera = scene.camera
        copy_properties((scene.world, scene, view_layer), stage)
        stage.frame_set(scene.frame_current, subframe=scene.frame_subframe)
        _set_up(stage, scene)
        window.scene = stage
        yield stage
    finally:
        window.scene, window.view_layer = before, view_layer
        item.name = NAME
        original.name = name
        bpy.data.scenes.remove(stage)


def color_of(instance: bpy.types.DepsgraphObjectInstance) -> tuple[float, ...]:
    """The colour that Object Info gives: an instance has that of its instancer.

    `instance.object` has it, too, but where Python knows the object that is shown already and answers with that.
    """
    return tuple(shown_by(instance).color)


def bake(stage: Stage, kind: str) -> None:
    """Have Cycles bake one pass of the object into what is active of its material's pictures or its attributes.

    Raises
    ------
    RuntimeError
        If Cycles cannot.
    """
    with bpy.context.temp_override(
        scene=stage.scene,
        view_layer=stage.scene.view_layers[0],
        active_object=stage.item,
        object=stage.item,
        selected_objects=[stage.item],
        selected_editable_objects=[stage.item],
    ):
        bpy.ops.object.bake(type=kind)


def copy_properties(owners: Iterable[bpy.types.ID | bpy.types.ViewLayer | None], into: bpy.types.ID) -> None:
    """Give an ID the custom properties of others, which Attribute nodes look for; those of the last one win."""
    for owner in filter(None, owners):
        for key in owner.keys():  # noqa: SIM118  # Blender's custom properties have no iterator
            # before Blender 5 settings of add-ons, as Cycles' own, lie among them
            if not hasattr(owner[key], "as_pointer") and key not in owner.bl_rna.properties:
                into[key] = owner[key]


def _put_there(item: bpy.types.Object, carrier: bpy.types.Object, shown: bpy.types.Object, matrix: Matrix) -> None:
    """Give `item` the object's own place, which Attribute nodes may ask for by its path, and `matrix` by a parent."""
    for name in PLACE:
        setattr(item, name, getattr(shown, name))
    item.parent = carrier
    try:
        item.matrix_parent_inverse = matrix @ item.matrix_basis.inverted()
    except ValueError:  # the object itself has no size, what shows it has
        item.parent = None
        item.matrix_world = matrix


def _copy_what_nodes_ask_for(shown: bpy.types.Object, item: bpy.types.Object) -> None:
    """Give `item` generated coordinates, if it is a mesh, Object Info and attributes of the object.

    Its name becomes that of the original, which is to get it back.
    """
    original, mesh = shown.original, item.data
    # of a metaball Cycles takes that of the faces, whatever its data say
    if item.type == "MESH" and hasattr(original.data, "texspace_location") and original.type != "META":
        mesh.use_auto_texspace = False
        mesh.texspace_location = original.data.texspace_location
        mesh.texspace_size = original.data.texspace_size
    item.pass_index = original.pass_index
    copy_properties((original,), item)
    _copy_properties_of_data(shown, item.data)
    name = original.name  # Object Info's Random is made of it
    original.name = "material_fit_original"
    item.name = name


def _copy_properties_of_data(shown: bpy.types.Object, into: bpy.types.ID) -> None:
    """Give an ID the custom properties of what a depsgraph's object shows; a modifier that makes a new mesh has none.

    Nor has a mesh that is edited. Attribute finds them after those of the object.
    """
    original = shown.original
    if not original.data.keys() or is_edited(original):
        return
    rendered = [modifier for modifier in original.modifiers if modifier.show_render]
    if not (rendered and rendered[-1].type == "SUBSURF" and keeps_data_below_subdivision()):
        copy_properties((shown.data if rendered else original.data,), into)
        return
    before = original.copy()
    apart = bpy.data.scenes.new(NAME)
    try:
        before.modifiers.remove(before.modifiers[rendered[-1].name])
        apart.collection.objects.link(before)
        layer = apart.view_layers[0]
        layer.update()
        copy_properties((before.evaluated_get(layer.depsgraph).data,), into)
    finally:
        bpy.data.scenes.remove(apart)
        bpy.data.objects.remove(before)


def _set_up(stage: bpy.types.Scene, scene: bpy.types.Scene) -> None:
    """Let Cycles bake in `stage` as it renders `scene`."""
    stage.render.engine = "CYCLES"
    stage.cycles.device, stage.cycles.shading_system = "CPU", scene.cycles.shading_system
    stage.cycles.use_adaptive_sampling = False
    stage.cycles.use_denoising = False
    stage.render.resolution_x, stage.render.resolution_y = scene.render.resolution_x, scene.render.resolution_y
    stage.render.bake.use_clear, stage.render.bake.use_selected_to_active = True, False
