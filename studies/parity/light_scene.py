# SPDX-License-Identifier: Apache-2.0
"""Scenes of `light_parity.py`, built by a Python with `bpy`: a matt floor, a shiny one, and lights over them."""

from __future__ import annotations

import math
from typing import Any

from . import lamp_nodes
from .lamp_nodes import Nodes

SIZE = 32  # pixels along each side
TILTED = {"location": (0.3, -0.2, 2.0), "rotation": (0.15, 0.1, 0.5)}
_WIDE = {"energy": 100, "shape": "RECTANGLE", "size": 1.0, "size_y": 0.6, **TILTED}
_ROUND = {"energy": 100, "shape": "ELLIPSE", "size": 0.5, "size_y": 1.2, **TILTED}
_DIM = {"energy": 5, "location": (0, 0, 2)}
_BRIGHT = ("POINT", {"energy": 100, "shadow_soft_size": 0.0, "location": (0, 0, 3)})
Lights = list[tuple[str, dict[str, Any]]]


def _spot(radius: float, blend: float, soft: bool) -> Lights:
    cone = {"spot_size": 1.0, "spot_blend": blend, "use_soft_falloff": soft}
    return [("SPOT", {"energy": 100, "shadow_soft_size": radius, **cone, **TILTED})]


def _point(height: float, soft: bool) -> Lights:
    place = {"location": (0.2, 0.1, height)}
    return [("POINT", {"energy": 100, "shadow_soft_size": 0.5, "use_soft_falloff": soft, **place})]


def _kind(soft: bool) -> str:
    return "soft falloff" if soft else "sphere"


MATT: dict[str, Lights] = {
    **{f"area, spread {s}°": [("AREA", {**_WIDE, "spread": math.radians(s)})] for s in (0, 1, 30, 90, 179, 180)},
    **{f"ellipse, spread {s}°": [("AREA", {**_ROUND, "spread": math.radians(s)})] for s in (0, 30, 90, 179)},
    **{f"spot, radius 0, blend {blend}": _spot(0.0, blend, True) for blend in (0.0, 0.15, 1.0)},
    **{
        f"spot, radius {radius}, blend {blend}, {_kind(soft)}": _spot(radius, blend, soft)
        for radius in (0.1, 0.5)
        for blend in (0.0, 0.15, 1.0)
        for soft in (True, False)
    },
    # at 0.3 m the floor is inside the sphere
    **{
        f"point, radius 0.5, {h} m away, {_kind(soft)}": _point(h, soft)
        for h in (0.3, 0.6, 1.5)
        for soft in (True, False)
    },
    "spot, deformed": [
        (
            "SPOT",
            {
                "energy": 100,
                "shadow_soft_size": 0.3,
                "spot_blend": 0.5,
                "scale": (0.5, 1.5, 1),
                "use_soft_falloff": False,
            },
        )
    ],
    "spot, 180°": [("SPOT", {"energy": 100, "shadow_soft_size": 0.0, "spot_size": math.pi, **TILTED})],
    "sun, 0.5°": [("SUN", {"energy": 3, "angle": math.radians(0.5), "rotation": (0.4, 0.3, 0.2)})],
    "sun, 180°": [("SUN", {"energy": 3, "angle": math.pi, "rotation": (0.4, 0.3, 0.2)})],
    "point before a point": [_BRIGHT, ("POINT", {"shadow_soft_size": 0.5, **_DIM})],
    "area before a point": [_BRIGHT, ("AREA", {"size": 1.0, **_DIM})],
    "spot before a point": [_BRIGHT, ("SPOT", {"shadow_soft_size": 0.5, **_DIM})],
}
# seen by a camera at (0, 0, 3), which shows one square metre of the floor
SHINY: dict[str, Lights] = {
    "point, soft falloff": [("POINT", {"energy": 100, "shadow_soft_size": 0.4, "location": (0.1, -0.2, 2.5)})],
    "point, sphere": [
        ("POINT", {"energy": 100, "shadow_soft_size": 0.4, "use_soft_falloff": False, "location": (0.1, -0.2, 2.5)})
    ],
    "spot": [("SPOT", {"energy": 300, "shadow_soft_size": 0.4, "spot_size": 0.3, "spot_blend": 0.5, **TILTED})],
    "area, spread 40°": [("AREA", {"energy": 60, "size": 0.8, "spread": 0.7, "location": (0.2, -0.2, 2.5)})],
    "sun, 17°": [("SUN", {"energy": 2, "angle": 0.3, "rotation": (0.05, 0.03, 0)})],
    "area, point and sun": [
        ("AREA", {"energy": 60, "size": 0.4, "spread": 2.0, "location": (0.3, -0.4, 2.5), "rotation": (0.1, 0.1, 0)}),
        ("POINT", {"energy": 60, "shadow_soft_size": 0.2, "location": (-0.5, 0.3, 2.0)}),
        ("SUN", {"energy": 0.5, "angle": 0.1, "rotation": (-0.1, 0.1, 0)}),
    ],
}
_POINT = {"energy": 100, "shadow_soft_size": 0.2, **TILTED}
_SUN = {"energy": 3, "angle": 0.1, "rotation": (0.4, 0.3, 0.2)}
_SPOT = {"energy": 300, "shadow_soft_size": 0.05, "spot_size": 0.9, "spot_blend": 0.2, **TILTED}
_SHARP_POINT = {**_POINT, "shadow_soft_size": 0.0}
_SHARP = {**_SPOT, "shadow_soft_size": 0.0}
NODES: dict[str, Lights] = {
    "blackbody, point": [("POINT", {**_POINT, "nodes": lamp_nodes.blackbody})],
    "blackbody, sun": [("SUN", {**_SUN, "nodes": lamp_nodes.blackbody})],
    "blackbody, area": [("AREA", {**_ROUND, "nodes": lamp_nodes.blackbody})],
    **{
        f"{output} falloff, {kind}": [(kind.upper(), {**values, "nodes": lamp_nodes.falloff(output, smooth)})]
        for output, smooth in (("Quadratic", 1.0), ("Linear", 0.0), ("Constant", 0.5))
        for kind, values in (("point", _POINT), ("area", {**_WIDE, "spread": 2.0}))
    },
    "Linear falloff, sharp spot": [("SPOT", {**_SHARP, "nodes": lamp_nodes.falloff("Linear", 0.0)})],
    "ray length, point": [("POINT", {**_POINT, "nodes": lamp_nodes.ray_length})],
    **{
        f"IES, {name}": [(name.split()[-1].upper(), {**values, "nodes": lamp_nodes.ies})]
        for name, values in (("point", _POINT), ("sharp point", _SHARP_POINT), ("spot", _SPOT), ("sharp spot", _SHARP))
    },
    "IES, area": [("AREA", {**_WIDE, "nodes": lamp_nodes.ies})],
    "IES, scaled point": [("POINT", {**_POINT, "scale": (0.5, 1.5, 1), "nodes": lamp_nodes.ies})],
    **{f"gobo by {c}, spot": [("SPOT", {**_SPOT, "nodes": lamp_nodes.gobo(c)})] for c in ("Normal", "UV")},
    "gobo by Normal, deformed spot": [
        ("SPOT", {**_SPOT, "use_soft_falloff": False, "scale": (0.5, 1.5, 1), "nodes": lamp_nodes.gobo("Normal")})
    ],
    "gobo by UV, point": [("POINT", {**_POINT, "nodes": lamp_nodes.gobo("UV")})],
    "blinds, point, sphere": [("POINT", {**_POINT, "use_soft_falloff": False, "nodes": lamp_nodes.blinds})],
    "softbox, area": [("AREA", {**_WIDE, "nodes": lamp_nodes.softbox})],
    "softbox, ellipse, spread 90°": [("AREA", {**_ROUND, "spread": 1.57, "nodes": lamp_nodes.softbox})],
    "gobo by UV, area, spread 0°": [("AREA", {**_WIDE, "spread": 0.0, "nodes": lamp_nodes.gobo("UV")})],
    "checks by Object, area": [("AREA", {**_WIDE, "nodes": lamp_nodes.by_place})],
}
SHINY |= {f"nodes: {name}": NODES[name] for name in ("IES, area", "softbox, area", "blinds, point, sphere")}
# a light of nodes that has no row in the table of `light_parity`
FALLING: Lights = [("AREA", {**_WIDE, "nodes": lamp_nodes.falling_checks})]
FLOORS = {"matt": MATT, "nodes": NODES, "shiny": SHINY}


def build(floor: str, lights: Lights) -> Any:
    """Make a scene without anything that biases Cycles; returns the object to fit."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.resolution_percentage = 100
    scene.render.use_compositing = scene.render.use_sequencer = False
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.light_sampling_threshold = 0.0  # else Cycles throws dice for dim light
    cycles.max_bounces = 0
    data = bpy.data.cameras.new("Camera")
    camera = bpy.data.objects.new("Camera", data)
    camera.location = (0, 0, 3 if floor == "shiny" else 5)
    if floor != "shiny":
        data.type, data.ortho_scale = "ORTHO", 2.0
    else:
        data.sensor_width, data.lens = 36, 108
    scene.collection.objects.link(camera)
    scene.camera = camera
    for kind, values in lights:
        add_light(kind, **values)
    if floor == "shiny":
        return _quad("Floor", 4.0, 0.0, Metallic=1.0, Roughness=0.1, Base_Color=(0.9, 0.6, 0.3, 1.0))
    _quad("Floor", 4.0, 0.0, Roughness=1.0, Specular_IOR_Level=0.0, Base_Color=(0.5, 0.5, 0.5, 1.0))
    # a little one to fit: a floor that is fitted whole would be as good
    return _quad("Target", 0.2, 0.001, Roughness=1.0, Specular_IOR_Level=0.0, Base_Color=(0.5, 0.5, 0.5, 1.0))


def add_light(
    kind: str,
    location: Any = (0, 0, 3),
    rotation: Any = (0, 0, 0),
    scale: Any = (1, 1, 1),
    nodes: Nodes | None = None,
    **settings: Any,
) -> Any:
    """Add a light; without rotation it shines down."""
    import bpy

    data = bpy.data.lights.new("Light", kind)
    for name, value in settings.items():
        setattr(data, name, value)
    if nodes is not None:
        data.use_nodes = True
        tree = data.node_tree
        nodes(tree, tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node)
    item = bpy.data.objects.new("Light", data)
    item.location, item.rotation_euler, item.scale = location, rotation, scale
    bpy.context.scene.collection.objects.link(item)
    return item


def _quad(name: str, size: float, height: float, **sockets: Any) -> Any:
    import bpy

    h = size / 2
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(-h, -h, height), (h, -h, height), (h, h, height), (-h, h, height)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # before Blender 5.0 a new material has no nodes
        material.use_nodes = True
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for socket, value in sockets.items():
        node.inputs[socket.replace("_", " ")].default_value = value
    mesh.materials.append(material)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item
