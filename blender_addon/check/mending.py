# SPDX-License-Identifier: GPL-3.0-or-later
"""What the buttons beside the findings of a check do: one small change of the scene each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import bpy
from mathutils import Matrix  # pyright: ignore[reportMissingImports]

from ..export.nodes.shader_graph import surface_of
from ..export.nodes.target_shader import make_own, target_shader
from ..picture_part import count_all
from ..result.animated_sockets import REPLACE, remove_driver
from ..result.local_copy import LocalCopyError, make_local
from ..versions import PRINCIPLED, active_output, nodes_enabled
from .picture_copy import PictureCopyError, scale_to_frame, turn_upright

# sockets of other shaders that mean the same on a Principled BSDF
_CARRIED = {"Color": "Base Color", "Base Color": "Base Color", "Roughness": "Roughness", "IOR": "IOR"}


class MendingError(Exception):
    """The problem cannot be mended (any more); the message is one sentence for the user."""


@dataclass(frozen=True)
class Kind:
    """A remedy: its button (`{}` stands for the argument), the tooltip and the function that does it."""

    label: str
    tooltip: str
    mend: Callable[[bpy.types.Context, str], None]


def _target(context: bpy.types.Context) -> bpy.types.Object:
    target = context.view_layer.objects.active
    if target is None:
        raise MendingError("No object is active: select the one whose material is to be fitted.")
    return target


def _material(context: bpy.types.Context) -> bpy.types.Material:
    material = _target(context).active_material
    if material is None:
        raise MendingError(f"Object '{_target(context).name}' has no material in its active slot.")
    return material


def _object(context: bpy.types.Context, name: str) -> bpy.types.Object:
    found = context.scene.objects.get(name)
    if found is None:
        raise MendingError(f"Object '{name}' is not in the scene any more: check again.")
    return found


def _select(context: bpy.types.Context, name: str) -> None:
    target = _object(context, name)
    for item in context.view_layer.objects:
        item.select_set(item == target)
    context.view_layer.objects.active = target


def _camera(context: bpy.types.Context, name: str) -> None:
    context.scene.camera = _object(context, name)


def _new_camera(context: bpy.types.Context, _argument: str) -> None:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    context.scene.collection.objects.link(camera)
    view = getattr(context.space_data, "region_3d", None)
    camera.matrix_world = view.view_matrix.inverted() if view else Matrix.Translation((0.0, 0.0, 10.0))
    context.scene.camera = camera


def _perspective(context: bpy.types.Context, _argument: str) -> None:
    context.scene.camera.data.type = "PERSP"


def _resolution(context: bpy.types.Context, size: str) -> None:
    render = context.scene.render
    render.resolution_x, render.resolution_y = (int(number) for number in size.split("x"))
    render.resolution_percentage = 100


def _whole_frame(context: bpy.types.Context, _argument: str) -> None:
    context.scene.render.use_border = False


def _one_eye(context: bpy.types.Context, _argument: str) -> None:
    context.scene.render.use_multiview = False


def _cycles(context: bpy.types.Context, _argument: str) -> None:
    context.scene.render.engine = "CYCLES"


def _no_override(context: bpy.types.Context, _argument: str) -> None:
    for name in ("material_override", "world_override"):
        if getattr(context.view_layer, name, None) is not None:
            setattr(context.view_layer, name, None)


def _show_in_render(context: bpy.types.Context, _argument: str) -> None:
    target = _target(context)
    target.hide_render = False
    for collection in target.users_collection:
        collection.hide_render = False


def _reference_view(context: bpy.types.Context, made: str) -> None:
    context.scene.mfo.reference_view = made


def _whole_picture(context: bpy.types.Context, _argument: str) -> None:
    count_all(context.scene.mfo.first_picture.part)


def _upright(context: bpy.types.Context, _argument: str) -> None:
    try:
        turn_upright(context)
    except PictureCopyError as error:
        raise MendingError(str(error)) from error


def _scale(context: bpy.types.Context, size: str) -> None:
    width, height = (int(number) for number in size.split("x"))
    try:
        scale_to_frame(context, (width, height))
    except PictureCopyError as error:
        raise MendingError(str(error)) from error


def _background(context: bpy.types.Context, name: str) -> None:
    settings, image = context.scene.mfo, bpy.data.images.get(name)
    if image is None:
        raise MendingError(f"The picture '{name}' is not in this file any more: choose another.")
    settings.reference_source, settings.reference_image = "IMAGE", image


def _colorspace(context: bpy.types.Context, name: str) -> None:
    context.scene.mfo.reference_image.colorspace_settings.name = name


def _new_material(context: bpy.types.Context, _argument: str) -> None:
    target = _target(context)
    material = bpy.data.materials.new(target.name)
    nodes_enabled(material)
    if not target.material_slots:
        target.data.materials.append(None)
    target.active_material = material
    if target_shader(material) is None:
        _principled(context, "")


def _principled(context: bpy.types.Context, _argument: str) -> None:
    """Put a Principled node on the output; what was there stays in the graph, without its link."""
    material = _material(context)
    tree = nodes_enabled(material)
    output = active_output(tree) or tree.nodes.new("ShaderNodeOutputMaterial")
    before = surface_of(tree)
    node = tree.nodes.new(PRINCIPLED)
    node.location = (output.location[0] - 300.0, output.location[1])
    for socket in before.inputs if before is not None else ():
        twin = node.inputs.get(_CARRIED.get(socket.name, ""))
        if twin is not None and twin.type == socket.type:
            twin.default_value = socket.default_value
            if socket.is_linked:
                tree.links.new(socket.links[0].from_socket, twin)
    tree.links.new(node.outputs[0], output.inputs["Surface"])


def _unlink(context: bpy.types.Context, name: str) -> None:
    material = _material(context)
    target = target_shader(material)
    if target is None or name not in target.own_names:
        raise MendingError(f"Material '{material.name}' has no socket {name} any more: check again.")
    socket = _own_socket(material, target.own_names[name])
    for link in list(socket.links):
        socket.id_data.links.remove(link)


def _own_socket(material: bpy.types.Material, name: str) -> bpy.types.NodeSocket:
    """Where the value `name` is set, in groups that are the material's own from now on."""
    make_own(material, [name])
    target = target_shader(material)
    assert target is not None  # as before the copies
    return target.sockets[name]


def _make_local(context: bpy.types.Context, _argument: str) -> None:
    target = _target(context)
    try:
        make_local(target)
    except LocalCopyError as error:
        raise MendingError(str(error)) from error


def _single_user(context: bpy.types.Context, _argument: str) -> None:
    """Give the target a copy of the material, and of the mesh where others have it, so that only it changes."""
    target, material = _target(context), _material(context)
    slot = target.material_slots[target.active_material_index]
    if slot.link == "DATA" and target.data.users > 1:
        target.data = target.data.copy()
    target.active_material = material.copy()


def _remove_driver(context: bpy.types.Context, name: str) -> None:
    material = _material(context)
    target = target_shader(material)
    if target is None or name not in target.own_names:
        raise MendingError(f"There is no socket {name} any more: check again.")
    remove_driver(_own_socket(material, target.own_names[name]))


def _replace_animation(context: bpy.types.Context, _argument: str) -> None:
    context.scene.mfo.animated = REPLACE


def _all_parameters(context: bpy.types.Context, _argument: str) -> None:
    context.scene.mfo.parameter_set = "all"


KINDS = {
    "select": Kind("Select {}", "Make this the active object", _select),
    "camera": Kind("Use {}", "Make this the scene's camera", _camera),
    "new_camera": Kind("Add Camera", "Add a camera that looks as the viewport does and use it", _new_camera),
    "perspective": Kind("Make Perspective", "Make the scene's camera a perspective one", _perspective),
    "resolution": Kind("Set Output to {}", "Set the output resolution to the reference's, at 100 %", _resolution),
    "whole_frame": Kind("Whole Frame", "Turn Render Region off", _whole_frame),
    "whole_picture": Kind("Whole Picture", "Let all of the picture count", _whole_picture),
    "one_eye": Kind("Turn Off", "Turn stereoscopy off", _one_eye),
    "cycles": Kind("Use Cycles", "Set the render engine to Cycles", _cycles),
    "no_override": Kind("Remove Override", "Remove the material and world override of the view layer", _no_override),
    "show_in_render": Kind("Show in Render", "Turn Disable in Renders off for it and its collections", _show_in_render),
    "reference_view": Kind(
        "Photo or Standard", "Take the reference as a photograph or a render under Standard", _reference_view
    ),
    "upright": Kind(
        "Turn Upright", "Write a copy that is turned as the picture's EXIF data say, and use that", _upright
    ),
    "scale": Kind("Scale to {}", "Write a copy that covers the frame, cut evenly where its shape differs", _scale),
    "background": Kind("Use {}", "Match the picture that lies behind the camera's view", _background),
    "colorspace": Kind("{}", "Give the reference image this colour space", _colorspace),
    "new_material": Kind("Add Material", "Put a new material with a Principled BSDF into the slot", _new_material),
    "principled": Kind("Use Principled", "Link a Principled BSDF to the output; the other nodes stay", _principled),
    "unlink": Kind("Unlink {}", "Remove the link of this socket, so that its value can be fitted", _unlink),
    "make_local": Kind("Make Local", "Make object, mesh and material parts of this file", _make_local),
    "single_user": Kind("Make Single User", "Give this object a material of its own", _single_user),
    "remove_driver": Kind("Remove Driver of {}", "Remove the driver, so that an applied value stays", _remove_driver),
    "replace_animation": Kind("Key on Apply", "Put a key at the current frame on apply", _replace_animation),
    "all_parameters": Kind("Fit All", "Fit every value the picture can show", _all_parameters),
}
