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
class Place:
    """Where to mend: the context, and the object's name and the slot of a material, None for the active ones."""

    context: bpy.types.Context
    of: tuple[str, int] | None = None


@dataclass(frozen=True)
class Kind:
    """A remedy: its button (`{}` stands for the argument), the tooltip and the function that does it."""

    label: str
    tooltip: str
    mend: Callable[[Place, str], None]


def _target(at: Place) -> bpy.types.Object:
    if at.of is not None:
        return _object(at, at.of[0])
    target = at.context.view_layer.objects.active
    if target is None:
        raise MendingError("No object is active: select the one whose material is to be fitted.")
    return target


def _slot(at: Place) -> bpy.types.MaterialSlot | None:
    """The slot whose material is to be mended; None where the object has none."""
    slots, number = _target(at).material_slots, _number(at)
    return slots[number] if number < len(slots) else None


def _number(at: Place) -> int:
    return at.of[1] if at.of is not None else _target(at).active_material_index


def _material(at: Place) -> bpy.types.Material:
    slot = _slot(at)
    if slot is None or slot.material is None:
        raise MendingError(f"Object '{_target(at).name}' has no material in its slot {_number(at) + 1}.")
    return slot.material


def _object(at: Place, name: str) -> bpy.types.Object:
    found = at.context.scene.objects.get(name)
    if found is None:
        raise MendingError(f"Object '{name}' is not in the scene any more: check again.")
    return found


def _select(at: Place, name: str) -> None:
    target = _object(at, name)
    for item in at.context.view_layer.objects:
        item.select_set(item == target)
    at.context.view_layer.objects.active = target


def _camera(at: Place, name: str) -> None:
    at.context.scene.camera = _object(at, name)


def _new_camera(at: Place, _argument: str) -> None:
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    at.context.scene.collection.objects.link(camera)
    view = getattr(at.context.space_data, "region_3d", None)
    camera.matrix_world = view.view_matrix.inverted() if view else Matrix.Translation((0.0, 0.0, 10.0))
    at.context.scene.camera = camera


def _perspective(at: Place, _argument: str) -> None:
    at.context.scene.camera.data.type = "PERSP"


def _resolution(at: Place, size: str) -> None:
    render = at.context.scene.render
    render.resolution_x, render.resolution_y = (int(number) for number in size.split("x"))
    render.resolution_percentage = 100


def _whole_frame(at: Place, _argument: str) -> None:
    at.context.scene.render.use_border = False


def _one_eye(at: Place, _argument: str) -> None:
    at.context.scene.render.use_multiview = False


def _cycles(at: Place, _argument: str) -> None:
    at.context.scene.render.engine = "CYCLES"


def _no_override(at: Place, _argument: str) -> None:
    for name in ("material_override", "world_override"):
        if getattr(at.context.view_layer, name, None) is not None:
            setattr(at.context.view_layer, name, None)


def _show_in_render(at: Place, _argument: str) -> None:
    target = _target(at)
    target.hide_render = False
    for collection in target.users_collection:
        collection.hide_render = False


def _reference_view(at: Place, made: str) -> None:
    at.context.scene.mfo.reference_view = made


def _whole_picture(at: Place, _argument: str) -> None:
    count_all(at.context.scene.mfo.first_picture.part)


def _upright(at: Place, _argument: str) -> None:
    try:
        turn_upright(at.context)
    except PictureCopyError as error:
        raise MendingError(str(error)) from error


def _scale(at: Place, size: str) -> None:
    width, height = (int(number) for number in size.split("x"))
    try:
        scale_to_frame(at.context, (width, height))
    except PictureCopyError as error:
        raise MendingError(str(error)) from error


def _background(at: Place, name: str) -> None:
    settings, image = at.context.scene.mfo, bpy.data.images.get(name)
    if image is None:
        raise MendingError(f"The picture '{name}' is not in this file any more: choose another.")
    settings.reference_source, settings.reference_image = "IMAGE", image


def _colorspace(at: Place, name: str) -> None:
    at.context.scene.mfo.reference_image.colorspace_settings.name = name


def _new_material(at: Place, _argument: str) -> None:
    target = _target(at)
    material = bpy.data.materials.new(target.name)
    nodes_enabled(material)
    if not target.material_slots:
        target.data.materials.append(None)
    slot = _slot(at)
    assert slot is not None  # there is one by now
    slot.material = material
    if target_shader(material) is None:
        _principled(at, "")


def _principled(at: Place, _argument: str) -> None:
    """Put a Principled node on the output; what was there stays in the graph, without its link."""
    material = _material(at)
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


def _unlink(at: Place, name: str) -> None:
    material = _material(at)
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


def _make_local(at: Place, _argument: str) -> None:
    target, slot = _target(at), _slot(at)
    before = slot.material if slot is not None else None
    try:
        _keep_listed(at, before, make_local(target, _number(at)))
    except LocalCopyError as error:
        raise MendingError(str(error)) from error


def _single_user(at: Place, _argument: str) -> None:
    """Give the target a copy of the material, and of the mesh where others have it, so that only it changes."""
    target, material, slot = _target(at), _material(at), _slot(at)
    assert slot is not None  # it has the material
    if slot.link == "DATA" and target.data.users > 1:
        target.data = target.data.copy()
    copy = material.copy()
    _keep_listed(at, material, copy)
    slot.material = copy


def _keep_listed(at: Place, material: bpy.types.Material | None, copy: bpy.types.Material) -> None:
    """Let the list of materials that are fitted together name the copy, where it named the material of the object."""
    for entry in at.context.scene.mfo.targets:
        if entry.object == _target(at) and entry.material == material:
            entry.material = copy


def _remove_driver(at: Place, name: str) -> None:
    material = _material(at)
    target = target_shader(material)
    if target is None or name not in target.own_names:
        raise MendingError(f"There is no socket {name} any more: check again.")
    remove_driver(_own_socket(material, target.own_names[name]))


def _replace_animation(at: Place, _argument: str) -> None:
    at.context.scene.mfo.animated = REPLACE


def _all_parameters(at: Place, _argument: str) -> None:
    at.context.scene.mfo.parameter_set = "all"


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
