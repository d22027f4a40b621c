# SPDX-License-Identifier: Apache-2.0
"""Settings of a random scene's pictures and of the numbers that nodes make of them: files, mappings, masks, bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import bpy
import numpy as np

from .rig import Draw, Rig, Setting, principled


def _picture(rig: Rig, draw: Draw, *, smooth: bool = False) -> Any:
    """A picture as files have them: of 8, 16 or 32 bits, grey or with alpha, packed, or made by Blender."""
    if draw.random() < 0.15:
        image = bpy.data.images.new("Generated", 32, 32)
        image.generated_type = str(draw.choice(["COLOR_GRID", "UV_GRID"]))
        return image
    size = 8
    values = np.ones((size, size, 4), np.float32)
    values[..., :3] = draw.uniform(0.0, 1.0, (size, size, 1 if draw.random() < 0.3 else 3))
    if draw.random() < 0.4:
        values[..., 3] = draw.uniform(0.0, 1.0, (size, size)) if smooth else draw.random((size, size)) < 0.7
    kind = str(draw.choice(["PNG", "PNG", "JPEG", "OPEN_EXR", "TARGA"]))
    image = bpy.data.images.new("Made", size, size, alpha=kind != "JPEG", float_buffer=kind == "OPEN_EXR")
    image.pixels.foreach_set(values.ravel())
    ends = {"PNG": "png", "JPEG": "jpg", "OPEN_EXR": "exr", "TARGA": "tga"}
    image.filepath_raw = str(rig.folder / f"made_{int(draw.integers(1 << 30))}.{ends[kind]}")
    image.file_format = kind
    image.save()
    image = bpy.data.images.load(image.filepath_raw)
    if kind != "OPEN_EXR" and draw.random() < 0.4:
        image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = str(draw.choice(["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"]))
    if draw.random() < 0.3:
        image.pack()
    return image


def _node(rig: Rig, draw: Draw, item: Any, *, smooth: bool = False) -> Any:
    """An Image Texture of an object's material, with a mapping of any kind before it."""
    tree = item.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = _picture(rig, draw, smooth=smooth)
    node.interpolation = str(draw.choice(["Linear", "Linear", "Closest", "Cubic", "Smart"]))
    node.extension = str(draw.choice(["REPEAT", "EXTEND", "CLIP", "MIRROR"]))
    node.projection = str(draw.choice(["FLAT", "FLAT", "FLAT", "BOX", "SPHERE", "TUBE"]))
    if draw.random() < 0.6:
        where, moved = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
        moved.vector_type = str(draw.choice(["POINT", "TEXTURE", "VECTOR"]))
        if moved.vector_type != "VECTOR":
            moved.inputs["Location"].default_value = (*draw.uniform(-1.0, 1.0, 2), 0.0)
        moved.inputs["Rotation"].default_value = (0.0, 0.0, float(draw.uniform(-3.0, 3.0)))
        moved.inputs["Scale"].default_value = (*draw.uniform(-2.0, 2.0, 2), 1.0)
        tree.links.new(where.outputs[str(draw.choice(["UV", "UV", "Generated", "Object"]))], moved.inputs["Vector"])
        tree.links.new(moved.outputs[0], node.inputs["Vector"])
    return node


def _picture_on(owner: str) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, draw: Draw) -> None:
        """A colour, and perhaps a number by the picture's alpha."""
        item = getattr(rig, owner)
        node, tree, shader = _node(rig, draw, item), item.data.materials[0].node_tree, principled(item)
        tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
        if draw.random() < 0.5:
            tree.links.new(node.outputs["Alpha"], shader.inputs[str(draw.choice(["Roughness", "Alpha", "Metallic"]))])

    return put


def _numbers(owner: str) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, draw: Draw) -> None:
        """Nodes that change numbers, in a chain from a picture to a socket."""
        item = getattr(rig, owner)
        node, tree, shader = _node(rig, draw, item), item.data.materials[0].node_tree, principled(item)
        last = node.outputs[str(draw.choice(["Color", "Color", "Alpha"]))]
        for _ in range(int(draw.integers(1, 4))):
            kind = str(draw.choice(["Gamma", "Invert", "RGBToBW", "SeparateColor", "Math", "Math"]))
            made = tree.nodes.new(f"ShaderNode{kind}")
            if kind == "Gamma":
                made.inputs["Gamma"].default_value = float(draw.uniform(0.3, 3.0))
            elif kind == "Invert":
                made.inputs[0].default_value = float(draw.uniform(0.0, 1.0))
            elif kind == "Math":
                made.operation, made.use_clamp = str(draw.choice(_OPERATIONS)), bool(draw.random() < 0.5)
                made.inputs[1].default_value = float(draw.uniform(0.2, 1.5))
            tree.links.new(last, made.inputs[1 if kind == "Invert" else 0])
            last = made.outputs[int(draw.integers(len(made.outputs)))]
        socket = str(draw.choice(["Base Color", "Roughness", "Metallic", "Alpha", "Coat Weight"]))
        tree.links.new(last, shader.inputs[socket])

    return put


_OPERATIONS = ("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "POWER", "MINIMUM", "MAXIMUM", "GREATER_THAN", "LESS_THAN",
               "ROUND", "SQRT", "ABSOLUTE")  # fmt: skip


def _mask(owner: str) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, draw: Draw) -> None:
        """A cut-out where a picture is above a threshold, as Blender 4.2 makes of Alpha Clip."""
        item = getattr(rig, owner)
        node, tree, shader = _node(rig, draw, item, smooth=True), item.data.materials[0].node_tree, principled(item)
        node.interpolation, node.projection, node.extension = "Linear", "FLAT", "REPEAT"
        above = tree.nodes.new("ShaderNodeMath")
        above.operation = "GREATER_THAN"
        above.inputs[1].default_value = float(draw.uniform(0.3, 0.7))
        tree.links.new(node.outputs[str(draw.choice(["Color", "Alpha"]))], above.inputs[0])
        tree.links.new(above.outputs[0], shader.inputs[str(draw.choice(["Alpha", "Metallic", "Base Color"]))])

    return put


def _beyond(owner: str) -> Callable[[Rig, Draw], None]:
    def put(rig: Rig, draw: Draw) -> None:
        """Numbers that a link can give and no slider."""
        item = getattr(rig, owner)
        for name in draw.choice(list(_BEYOND), 2, replace=False):
            _link_value(item, principled(item).inputs[str(name)], float(draw.choice(_BEYOND[str(name)])))

    return put


_BEYOND = {
    "Base Color": (1.5, -0.3), "Roughness": (1.6, -0.4), "Metallic": (1.5, -0.5), "Alpha": (1.4, -0.3),
    "IOR": (0.7, 0.0, 4.0), "Specular IOR Level": (1.6, -0.4), "Coat Weight": (1.7, -0.3), "Sheen Weight": (2.0, -0.5),
    "Coat Roughness": (1.4, -0.2), "Diffuse Roughness": (1.5, -0.5), "Coat IOR": (0.8, 5.0),
    "Transmission Weight": (-0.5,), "Emission Strength": (-1.0, 2.0), "Subsurface Weight": (-0.4,),
}  # fmt: skip


def _mix_beyond(rig: Rig, draw: Draw) -> None:
    """Half of a Transparent, or none, by a factor that no slider gives."""
    tree, shader = rig.box.data.materials[0].node_tree, principled(rig.box)
    clear, mix = tree.nodes.new("ShaderNodeBsdfTransparent"), tree.nodes.new("ShaderNodeMixShader")
    _link_value(rig.box, mix.inputs[0], float(draw.choice([1.4, -0.4])))
    shown = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL").inputs["Surface"]
    for source, socket in ((shader.outputs[0], mix.inputs[1]), (clear.outputs[0], mix.inputs[2])):
        tree.links.new(source, socket)
    tree.links.new(mix.outputs[0], shown)


def _link_value(item: Any, socket: Any, number: float) -> None:
    tree = item.data.materials[0].node_tree
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = number
    tree.links.new(value.outputs[0], socket)


def _from_instancer(rig: Rig, draw: Draw) -> None:
    """A picture by the map of what shows the box, without nodes that need a bake."""
    tree = rig.box.data.materials[0].node_tree
    node, where = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeUVMap")
    node.image, node.interpolation = bpy.data.images.new("Grid", 64, 64), "Closest"
    node.image.generated_type, where.from_instancer = "COLOR_GRID", True
    tree.links.new(where.outputs[0], node.inputs["Vector"])
    tree.links.new(node.outputs["Color"], principled(rig.box).inputs["Base Color"])
    system = rig.floor.modifiers.new("Some", "PARTICLE_SYSTEM").particle_system
    made = system.settings
    made.type, made.count, made.particle_size, made.use_advanced_hair = "HAIR", 8, 0.15, True
    made.render_type, made.instance_object = "OBJECT", rig.box


def _without_map(rig: Rig, draw: Draw) -> None:
    """A picture on a mesh that has no UV map."""
    while len(rig.box.data.uv_layers):
        rig.box.data.uv_layers.remove(rig.box.data.uv_layers[0])
    rig.box.data.update_tag()  # removing a map by a script does not
    node = _node(rig, draw, rig.box)
    rig.box.data.materials[0].node_tree.links.new(node.outputs["Color"], principled(rig.box).inputs["Base Color"])


def _all() -> Iterator[Setting]:
    for owner in ("floor", "box", "target"):
        # of a target with holes, which pictures by Box show mirrored on its backs
        sides = ("tell its sides",) if owner == "target" else ()
        yield Setting(f"picture on the {owner}", _picture_on(owner), sides)
        yield Setting(f"numbers on the {owner}", _numbers(owner), sides)
        yield Setting(f"mask on the {owner}", _mask(owner))
        yield Setting(f"beyond bounds on the {owner}", _beyond(owner))
    yield Setting("map of the instancer", _from_instancer, ("of each instance",))
    yield Setting("without a map", _without_map)
    yield Setting("alpha below zero", lambda rig, _: _link_value(rig.box, principled(rig.box).inputs["Alpha"], -0.4))
    yield Setting("mix beyond bounds", _mix_beyond)


PICTURE_SETTINGS = tuple(_all())
