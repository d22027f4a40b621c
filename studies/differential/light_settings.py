# SPDX-License-Identifier: Apache-2.0
"""Settings of a random scene's lights: lamps with nodes, several lamps, linking, skies and portals."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import bpy

from ..parity import lamp_nodes
from .rig import Draw, Rig, Setting, background

_ANYWHERE = {
    "blackbody": lamp_nodes.blackbody, "IES": lamp_nodes.ies, "ray length": lamp_nodes.ray_length,
    "linear falloff": lamp_nodes.falloff("Linear", 0.3), "smooth falloff": lamp_nodes.falloff("Quadratic", 1.0),
    "gobo": lamp_nodes.gobo("UV"),
}  # fmt: skip


def _shaped(data: Any, nodes: lamp_nodes.Nodes) -> None:
    data.use_nodes = True
    nodes(data.node_tree, data.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node)


def _nodes(nodes: lamp_nodes.Nodes) -> Callable[[Rig, Draw], None]:
    return lambda rig, _: _shaped(rig.light.data, nodes)


def _softbox(rig: Rig, draw: Draw) -> None:
    rig.light.data.type = "AREA"
    _shaped(rig.light.data, lamp_nodes.softbox if draw.random() < 0.5 else lamp_nodes.by_place)


def _lamp(rig: Rig, kind: str, place: Any, energy: float) -> Any:
    item = bpy.data.objects.new("Further", bpy.data.lights.new("Further", kind))
    item.data.energy, item.location = energy, place
    if kind == "AREA":
        item.data.size = 0.5
    rig.scene.collection.objects.link(item)
    return item


def _several(rig: Rig, draw: Draw) -> None:
    """One to three more lamps that look down, one in two of them with nodes."""
    for _ in range(int(draw.integers(1, 4))):
        kind = str(draw.choice(["POINT", "SPOT", "AREA"]))
        item = _lamp(rig, kind, (*draw.uniform(-2.0, 2.0, 2), draw.uniform(2.2, 4.0)), float(draw.uniform(30.0, 150.0)))
        if draw.random() < 0.5:
            _shaped(item.data, _ANYWHERE[str(draw.choice(list(_ANYWHERE)))])


def _sun(rig: Rig, draw: Draw) -> None:
    item = _lamp(rig, "SUN", (0.0, 0.0, 5.0), float(draw.uniform(0.5, 2.0)))
    item.data.angle, item.rotation_euler = float(draw.choice([0.0, 0.01, 0.5])), (0.5, 0.2, float(draw.uniform(0, 6)))


def _portal(rig: Rig, _: Draw) -> None:
    item = _lamp(rig, "AREA", (0.0, 0.0, 4.0), 10.0)
    item.data.cycles.is_portal = True


def _light_group(rig: Rig, _: Draw) -> None:
    bpy.context.view_layer.lightgroups.add(name="Key")
    rig.light.lightgroup = "Key"


def _linked(rig: Rig, owner: str, kind: str) -> None:
    made = bpy.data.collections.new("Linked")
    made.objects.link(rig.floor)
    setattr(getattr(rig, owner).light_linking, kind, made)


def _without_mis(rig: Rig, _: Draw) -> None:
    rig.light.data.cycles.use_multiple_importance_sampling = False


def _sky(rig: Rig, draw: Draw) -> None:
    tree = rig.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexSky")
    node.sun_elevation, node.sun_rotation = float(draw.uniform(0.2, 1.2)), float(draw.uniform(0.0, 6.0))
    node.sun_disc = bool(draw.random() < 0.7)
    background(rig.scene.world).inputs["Strength"].default_value = 0.05
    tree.links.new(node.outputs[0], background(rig.scene.world).inputs["Color"])


def _fog(rig: Rig, _: Draw) -> None:
    tree = rig.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeVolumeScatter")
    node.inputs["Density"].default_value = 0.05
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(node.outputs[0], output.inputs["Volume"])


def _wide_spot(rig: Rig, draw: Draw) -> None:
    rig.light.data.type = "SPOT"
    data: Any = rig.light.data
    data.spot_size, data.spot_blend = math.radians(float(draw.choice([30.0, 120.0, 180.0]))), float(draw.random())
    data.use_square = bool(draw.random() < 0.5)


def _all() -> Iterator[Setting]:
    for name, nodes in _ANYWHERE.items():
        yield Setting(f"lamp with {name}", _nodes(nodes))
    yield Setting("softbox", _softbox)
    yield Setting("several lamps", _several)
    yield Setting("sun", _sun)
    yield Setting("portal", _portal)
    yield Setting("light group", _light_group)
    yield Setting("spot", _wide_spot)
    yield Setting("sky", _sky)
    yield Setting("shadow linking", lambda r, d: _linked(r, "light", "blocker_collection"), ("Light linking",))
    yield Setting("lamp without MIS", _without_mis, ("Multiple Importance Sampling",))
    yield Setting("fog", _fog, ("olume",))


LIGHT_SETTINGS = tuple(_all())
