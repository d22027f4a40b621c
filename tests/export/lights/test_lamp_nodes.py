# SPDX-License-Identifier: Apache-2.0
"""Lamps with nodes over a floor: Cycles against the exported scene in Mitsuba; and what is refused."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.bake.lamp import _by_distance
from blender_addon.bake.lamp_layout import distances
from blender_addon.export.job import check_export
from blender_addon.probe.server import ProbeRequestError
from studies.parity import lamp_nodes
from studies.parity.light_scene import FALLING, NODES, add_light

from ..scene.test_light_levels import floor, tiles

# one of each kind of table and lamp; `light_parity` has all
KINDS = (
    *("blackbody, point", "blackbody, sun", "Linear falloff, point", "falling checks, rectangle"),
    *("Linear falloff, sharp spot", "IES, sharp point", "IES, spot", "IES, area", "gobo by UV, spot"),
    *(
        "gobo by Normal, deformed spot",
        "blinds, point, sphere",
        "softbox, ellipse, spread 90°",
        "checks by Object, area",
    ),
)


@pytest.mark.parametrize("kind", KINDS)
def test_nodes_shine_as_in_cycles(kind: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    target = floor()
    for lamp, settings in (NODES | {"falling checks, rectangle": FALLING})[kind]:
        add_light(lamp, **settings)
    scene.cycles.samples = 256
    report = export(target)
    assert report.notes == ()
    expected, found = tiles(render_cycles()), tiles(render_mitsuba(report, 256))
    # noise of 60 tiles of 16 pixels with 256 samples in both renderers
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.01)
    assert np.abs(found - expected).max() <= 0.03 * expected.max()


def shows(*outputs: str) -> lamp_nodes.Nodes:
    """Nodes that show these outputs, called "node.output", mixed."""

    def build(tree: Any, emission: Any) -> None:
        last = None
        for output in outputs:
            kind, name = output.split(".")
            node = tree.nodes.new(f"ShaderNode{kind}")
            mix = tree.nodes.new("ShaderNodeVectorMath")
            tree.links.new(node.outputs[name], mix.inputs[0])
            if last is not None:
                tree.links.new(last, mix.inputs[1])
            last = mix.outputs[0]
        tree.links.new(last, emission.inputs["Color"])

    return build


@pytest.mark.parametrize(
    ("kind", "settings", "outputs", "what"),
    [
        ("POINT", {}, ["CameraData.View Distance"], "the camera's view"),
        ("AREA", {}, ["TexCoord.Window"], "the camera's view"),
        ("SUN", {}, ["TexCoord.Normal"], "places or directions on a sun"),
        ("POINT", {"shadow_soft_size": 0.1}, ["NewGeometry.Position"], "places on a lamp with a radius"),
        ("SPOT", {"shadow_soft_size": 0.1}, ["TexNoise.Color"], "places on a lamp with a radius"),
        ("AREA", {}, ["TexCoord.UV", "NewGeometry.Incoming"], "directions and places on the lamp at once"),
        ("AREA", {}, ["TexImage.Color", "TexIES.Fac"], "directions and places on the lamp at once"),
        (
            *("POINT", {"shadow_soft_size": 0.1, "use_soft_falloff": False}),
            *(["TexCoord.Normal", "NewGeometry.Incoming"], "directions and places on the lamp at once"),
        ),
        ("POINT", {}, ["AmbientOcclusion.AO"], "the node 'Ambient Occlusion'"),
    ],
)
def test_what_no_table_holds_is_refused(
    kind: str, settings: dict[str, Any], outputs: list[str], what: str, scene: Any
) -> None:
    target = floor()
    names = [o.replace("TexIES.Fac", "TexIES.Factor") if bpy.app.version >= (5, 1) else o for o in outputs]
    add_light(kind, energy=100.0, nodes=shows(*names), **settings)
    errors, _ = check_export(bpy.context, target)
    assert errors[0] == f"Light 'Light' has nodes that ask for {what}, which no table holds: simplify them."


def test_directions_on_a_lamp_without_extent_or_that_faces_the_point_are_one(scene: Any) -> None:
    target = floor()
    both = shows("TexCoord.Normal", "NewGeometry.Incoming", "TexCoord.UV")
    add_light("POINT", energy=100.0, shadow_soft_size=0.2, nodes=both)
    add_light("SPOT", energy=100.0, shadow_soft_size=0.0, use_soft_falloff=False, nodes=both)
    assert check_export(bpy.context, target) == ([], [])


def refused(export: Any, target: Any) -> str:
    from blender_addon.export.findings import ExportError

    with pytest.raises(ExportError) as refusal:
        export(target)
    return str(refusal.value)


def test_light_that_is_no_product_of_direction_and_distance_is_refused(scene: Any, export: Any) -> None:
    def cone(tree: Any, emission: Any) -> None:
        """A shell whose radius changes with the direction."""
        shows("LightPath.Ray Length", "TexCoord.Normal")(tree, emission)
        color = emission.inputs["Color"].links[0].from_socket
        less = tree.nodes.new("ShaderNodeVectorMath")
        less.operation = "SINE"
        tree.links.new(color, less.inputs[0])
        tree.links.new(less.outputs[0], emission.inputs["Color"])

    target = floor()
    add_light("POINT", energy=100.0, nodes=cone)
    assert refused(export, target) == (
        "The nodes of light 'Light' could not be measured by Cycles: Their light changes with the distance in another "
        "way in each direction."
    )


def test_places_of_a_lamp_that_fall_otherwise_are_refused() -> None:
    """A texture times a falloff, of which a fifth lies at edges; then one that fades into another with the distance."""
    steps = distances()
    texture = np.linspace(0.2, 1.0, 16)[:, None, None] * np.ones(3)
    fall = (steps / (1.0 + steps))[None, :, None]
    at_edges = texture * np.where(np.arange(16)[:, None, None] < 3, np.where(steps > 1.0, 0.5, 1.0)[None, :, None], 1.0)
    found, distance = _by_distance(at_edges * fall, steps, of_places=True)
    assert distance == pytest.approx(1.0, rel=0.01)
    np.testing.assert_allclose(found[:, 0] / found[-1, 0], fall[0, :, 0] / fall[0, -1, 0], rtol=1e-6)
    mixed = texture * fall + texture[::-1] * (1.0 - fall)
    with pytest.raises(ProbeRequestError, match="at each place of the lamp"):
        _by_distance(mixed, steps, of_places=True)


def test_light_below_zero_is_refused(scene: Any, export: Any) -> None:
    def dark(tree: Any, emission: Any) -> None:
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = "SUBTRACT"
        node.inputs[0].default_value = 0.0
        node.inputs[1].default_value = 2.0
        sine = tree.nodes.new("ShaderNodeMath")
        sine.operation = "ABSOLUTE"
        tree.links.new(node.outputs[0], sine.inputs[0])
        again = tree.nodes.new("ShaderNodeMath")
        again.operation = "MULTIPLY"
        again.inputs[1].default_value = -1.0
        tree.links.new(sine.outputs[0], again.inputs[0])
        tree.links.new(again.outputs[0], emission.inputs["Strength"])

    target = floor()
    add_light("POINT", energy=100.0, nodes=dark)
    assert "Their light is below zero." in refused(export, target)


def test_the_depth_of_rays_is_named(scene: Any) -> None:
    target = floor()
    add_light("POINT", energy=100.0, nodes=shows("LightPath.Ray Depth"))
    errors, notes = check_export(bpy.context, target)
    assert errors == []
    assert notes == [
        "Light 'Light' asks Light Path for the depth of rays: in the fit it is on all surfaces as on the first."
    ]


def test_a_lamp_that_its_nodes_put_out_is_left_out(scene: Any, export: Any) -> None:
    def off(tree: Any, emission: Any) -> None:
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = "SINE"
        node.inputs[0].default_value = 0.0
        tree.links.new(node.outputs[0], emission.inputs["Strength"])

    target = floor()
    add_light("SUN", energy=1.0)
    add_light("POINT", energy=100.0, nodes=off)
    text = (export(target).folder / "scene.xml").read_text("utf-8")
    assert text.count("<emitter") == 1
