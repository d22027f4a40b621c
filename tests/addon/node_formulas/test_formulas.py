# SPDX-License-Identifier: Apache-2.0
"""Every formula and setting of it beside Cycles, which renders what each node's output holds on a cube."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.nodes.closure_leaves import OUTPUT  # noqa: E402
from blender_addon.graph_values.place import Place  # noqa: E402
from blender_addon.node_formulas.colors import BLENDS  # noqa: E402
from blender_addon.node_formulas.formulas import _MATH, _OF_VECTORS, FORMULAS, OF_ONE_SETTING  # noqa: E402
from blender_addon.probe import held_pictures  # noqa: E402
from blender_addon.probe.held_pictures import take_values  # noqa: E402
from blender_addon.probe.target import SEEN, Target  # noqa: E402
from blender_addon.probe.variant_pictures import Variant, VariantPictures  # noqa: E402

OFF = 1e-4  # of 1 and a value; steps fall on the other side at a few places
FEW = 2e-3
DIAL = Place(("Dial",), "output", "Value")
FIRST, SECOND = 5.0, -0.3  # of the dial; with the first no logarithm has a base near 1


def settings() -> Iterator[tuple[str, dict[str, Any]]]:
    yield from (("ShaderNodeMath", {"operation": name}) for name in _MATH)
    yield "ShaderNodeMath", {"operation": "ADD", "use_clamp": True}
    further = ("FRACTION", "SCALE", "DOT_PRODUCT", "LENGTH", "DISTANCE", "NORMALIZE")
    yield from (("ShaderNodeVectorMath", {"operation": name}) for name in (*_OF_VECTORS, *further))
    for name in BLENDS:
        yield "ShaderNodeMix", {"data_type": "RGBA", "blend_type": name, "clamp_result": name == "ADD"}
        yield "ShaderNodeMixRGB", {"blend_type": name, "use_clamp": name == "SUBTRACT"}
    yield from (("ShaderNodeMix", {"data_type": "FLOAT", "clamp_factor": is_clamped}) for is_clamped in (True, False))
    yield from (("ShaderNodeMix", {"data_type": "VECTOR", "factor_mode": m}) for m in ("UNIFORM", "NON_UNIFORM"))
    for name in ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"):
        yield from (("ShaderNodeMapRange", {"interpolation_type": name, "clamp": clamp}) for clamp in (True, False))
    yield from (("ShaderNodeClamp", {"clamp_type": name}) for name in ("MINMAX", "RANGE"))
    yield from (("ShaderNodeSeparateColor", {"mode": name}) for name in ("RGB", "HSV"))
    yield from (("ShaderNodeValToRGB", {"interpolation": n}) for n in ("LINEAR", "CONSTANT", "EASE", "B_SPLINE"))
    yield from (("ShaderNodeValToRGB", {"color_mode": name}) for name in ("HSV", "HSL"))
    for name in ("ShaderNodeRGBCurve", "ShaderNodeFloatCurve"):
        yield from ((name, {"extend": extend}) for extend in ("HORIZONTAL", "EXTRAPOLATED"))
    named = {name for name, _ in _named()}
    yield from ((name, {}) for name in FORMULAS if name not in named)


def _named() -> list[tuple[str, str]]:
    """Nodes with settings, which `settings` lists one by one."""
    own = ("Math", "VectorMath", "Mix", "MixRGB", "MapRange", "Clamp", "SeparateColor", "ValToRGB", "RGBCurve")
    return [(f"ShaderNode{name}", "") for name in (*own, "FloatCurve", "Value", "RGB")]


def put(tree: Any, kind: str, chosen: dict[str, Any], sources: list[Any]) -> Any:
    """A node with these settings, whose inputs are fed by turns, the last by what hangs on the dial."""
    node = tree.nodes.new(kind)
    holder = node
    if kind == "ShaderNodeValToRGB":
        holder = node.color_ramp
        for position, color in ((0.3, (0.9, 0.2, 0.1, 0.4)), (0.55, (0.1, 0.8, 0.3, 1.0))):
            holder.elements.new(position).color = color
    if kind.endswith("Curve"):
        holder = node.mapping
        for curve in holder.curves:
            curve.points.new(0.4, 0.65)
        holder.update()
    for name, value in chosen.items():
        setattr(holder, name, value)
    inputs = [each for each in node.inputs if each.enabled]
    for number, socket in enumerate(inputs):
        is_last = number == len(inputs) - 1
        tree.links.new(sources[2] if is_last else sources[number % 2], socket)
    return node


def _spread(tree: Any, scale: float, width: float = 4.0) -> Any:
    """Noise around 0.6, another one in each component: between -0.4 and 1.5 of a width of 4."""
    noise, wider = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeVectorMath")
    noise.inputs["Scale"].default_value = scale
    wider.operation = "MULTIPLY_ADD"
    wider.inputs[1].default_value, wider.inputs[2].default_value = (width,) * 3, (0.6 - 0.5 * width,) * 3
    tree.links.new(next(each for each in noise.outputs if each.name == "Color"), wider.inputs[0])
    return wider.outputs[0]


@pytest.fixture
def tree() -> Any:
    """That of the cube of Blender's own scene, with a dial, as far as the picture of a test needs it."""
    bpy.ops.wm.read_factory_settings(use_empty=False)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 60, 40, 100
    tree = bpy.data.objects["Cube"].active_material.node_tree
    dial = tree.nodes.new("ShaderNodeValue")
    dial.name = "Dial"
    held_pictures._kept.clear()
    return tree


def renders_of(paths: dict[str, list[str]], places: list[Place]) -> VariantPictures:
    scene, view = bpy.context.scene, bpy.context.view_layer
    target = Target(scene, view, bpy.data.objects["Cube"], bpy.data.objects["Cube"].material_slots[0])
    return VariantPictures(target, paths, 1, places)


def both(
    renders: VariantPictures, first: list[Any], then: list[Any], monkeypatch: pytest.MonkeyPatch
) -> tuple[dict[str, Any], dict[str, Any], Any]:
    """What formulas and what Cycles give for other values, and where the cube is seen; formulas alone are asked."""
    names = list(renders.paths)
    ours, cycles = dict[str, Any](), dict[str, Any]()
    take_values(renders, [Variant(names, first)], 1, lambda *_: None, key="a")
    assert set(names) - held_pictures._kept["a"].names == set()
    surface = renders.take([Variant(names, then)], 1, lambda _, name, v: cycles.update({name: v}))
    with monkeypatch.context() as patch:
        patch.setattr(VariantPictures, "take", None)
        take_values(renders, [Variant(names, then)], 1, lambda _, name, v: ours.update({name: v}), key="a")
    return ours, cycles, surface.mask[..., 0] > SEEN


AT_ONCE = 20  # settings of one render; 60 are too many for Cycles


@pytest.mark.parametrize("part", range(-(-len([*settings()]) // AT_ONCE)))
def test_each_node_gives_what_cycles_renders(part: int, tree: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    sources = [_spread(tree, 3.0), _spread(tree, 5.0)]
    turned = tree.nodes.new("ShaderNodeVectorMath")
    tree.links.new(_spread(tree, 4.0, 8.0), turned.inputs[0])
    tree.links.new(tree.nodes["Dial"].outputs[0], turned.inputs[1])
    sources.append(turned.outputs[0])
    paths, of = {}, {}
    for kind, chosen in [*settings()][part * AT_ONCE : (part + 1) * AT_ONCE]:
        node = put(tree, kind, chosen, sources)
        for output in node.outputs:
            if output.enabled:
                paths[f"{node.name} {output.name}"] = [node.name, OUTPUT + output.identifier]
                of[f"{node.name} {output.name}"] = (kind, chosen, output.name)
    ours, cycles, seen = both(renders_of(paths, [DIAL]), [FIRST], [SECOND], monkeypatch)
    wrong = {}
    for name, (kind, chosen, output) in of.items():
        off = np.abs(ours[name] - cycles[name])[seen] > OFF * (1.0 + np.abs(cycles[name][seen]))
        if off.mean() > FEW or cycles[name][seen].std() < OFF:
            wrong[kind, str(chosen), output] = float(off.mean()), float(cycles[name][seen].std())
    assert wrong == {}


def test_outputs_of_one_setting(tree: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bump's strength and a layer's blend, from one value to others, below a group and behind a muted node."""
    bump, layer, muted = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("Bump", "LayerWeight", "Gamma"))
    muted.mute = True
    tree.links.new(_spread(tree, 3.0), muted.inputs[0])
    tree.links.new(muted.outputs[0], bump.inputs["Height"])
    places = [Place((bump.name,), "input", "Strength"), Place((layer.name,), "input", "Blend")]
    assert {(node.bl_idname, name) for node, name in ((bump, "Normal"), (layer, "Facing"))} == set(OF_ONE_SETTING)
    mix = tree.nodes.new("ShaderNodeMix")
    tree.links.new(layer.outputs["Facing"], mix.inputs[0])
    shader = tree.nodes["Principled BSDF"]
    mix.inputs[3].default_value = 1.0
    tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    tree.links.new(mix.outputs[0], shader.inputs["Roughness"])
    paths = {name: [shader.name, name] for name in ("Normal", "Roughness")}
    for strength, blend in ((0.0, 0.2), (0.6, 0.5), (1.0, 0.97)):
        held_pictures._kept.clear()
        ours, cycles, seen = both(renders_of(paths, places), [0.3, 0.7], [strength, blend], monkeypatch)
        for name, picture in cycles.items():
            assert picture[seen].std() > OFF
            np.testing.assert_allclose(ours[name][seen], picture[seen], atol=OFF)


def test_values_within_groups_and_what_hangs_on_nothing(tree: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """A colour becomes a number where it enters a group, whose own node has the value; two of them share a tree."""
    inner = bpy.data.node_groups.new("Grey", "ShaderNodeTree")
    inner.interface.new_socket("Amount", in_out="INPUT", socket_type="NodeSocketFloat")
    inner.interface.new_socket("Sum", in_out="OUTPUT", socket_type="NodeSocketFloat")
    begin, end, add = (inner.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeMath"))
    inner.links.new(begin.outputs[0], add.inputs[0])
    inner.links.new(add.outputs[0], end.inputs[0])
    shader = tree.nodes["Principled BSDF"]
    noise = next(each for each in tree.nodes.new("ShaderNodeTexNoise").outputs if each.name == "Color")
    groups = [tree.nodes.new("ShaderNodeGroup") for _ in "ab"]
    for group, socket in zip(groups, ("Roughness", "Metallic"), strict=True):
        group.node_tree = inner
        tree.links.new(noise, group.inputs[0])
        tree.links.new(group.outputs[0], shader.inputs[socket])
    places = [Place((groups[0].name, add.name), "input", add.inputs[1].identifier)]
    paths = {name: [shader.name, name] for name in ("Roughness", "Metallic")}
    ours, cycles, seen = both(renders_of(paths, places), [0.1], [0.3], monkeypatch)
    for name, picture in cycles.items():
        np.testing.assert_allclose(ours[name][seen], picture[seen], atol=1e-6)


def test_what_has_no_formula_is_rendered(tree: Any) -> None:
    """A texture whose scale is changed, and beside it a ramp, which has one."""
    noise, ramp = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeValToRGB")
    shader = tree.nodes["Principled BSDF"]
    fac = next(each for each in noise.outputs if each.name in ("Fac", "Factor"))
    tree.links.new(fac, shader.inputs["Metallic"])
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
    places = [Place((noise.name,), "input", "Scale"), Place((ramp.name,), "stop_position", "0")]
    paths = {name: [shader.name, name] for name in ("Metallic", "Base Color")}
    renders, names = renders_of(paths, places), list(paths)
    take_values(renders, [Variant(names, [3.0, 0.1])], 1, lambda *_: None, key="a")
    assert held_pictures._kept["a"].names == {"Base Color"}
    ours, cycles = dict[str, Any](), dict[str, Any]()
    surface = take_values(renders, [Variant(names, [6.0, 0.3])], 1, lambda _, name, v: ours.update({name: v}), key="a")
    renders.take([Variant(names, [6.0, 0.3])], 1, lambda _, name, v: cycles.update({name: v}))
    seen = surface.mask[..., 0] > SEEN
    for name in names:
        np.testing.assert_allclose(ours[name][seen], cycles[name][seen], atol=1e-5)
