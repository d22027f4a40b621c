# SPDX-License-Identifier: Apache-2.0
"""A Principled BSDF inside node groups, and a bare Diffuse BSDF: where their values are read and written."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

FLOAT32 = 1e-6
JOB = Path("job")


@pytest.fixture
def grouped(scene: SimpleNamespace) -> SimpleNamespace:
    """A Principled BSDF two groups deep behind a reroute; `Paint` leads to Base Color alone, `Shine` to two sockets.

    The inner group is on another material too.
    """
    bpy = scene.bpy
    material = bpy.data.materials["Glaze"]
    inner, outer = (bpy.data.node_groups.new(name, "ShaderNodeTree") for name in ("Inner", "Outer"))
    for group in (inner, outer):
        group.interface.new_socket("Paint", in_out="INPUT", socket_type="NodeSocketColor")
        group.interface.new_socket("Shine", in_out="INPUT", socket_type="NodeSocketFloat")
        group.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
    node, reroute = inner.nodes.new("ShaderNodeBsdfPrincipled"), inner.nodes.new("NodeReroute")
    entry = inner.nodes.new("NodeGroupInput")
    inner.links.new(entry.outputs["Paint"], node.inputs["Base Color"])
    inner.links.new(entry.outputs["Shine"], node.inputs["Coat Weight"])
    inner.links.new(entry.outputs["Shine"], node.inputs["Sheen Weight"])
    inner.links.new(node.outputs[0], reroute.inputs[0])
    inner.links.new(reroute.outputs[0], inner.nodes.new("NodeGroupOutput").inputs[0])
    middle, entry = outer.nodes.new("ShaderNodeGroup"), outer.nodes.new("NodeGroupInput")
    middle.node_tree = inner
    for name in ("Paint", "Shine"):
        outer.links.new(entry.outputs[name], middle.inputs[name])
    outer.links.new(middle.outputs[0], outer.nodes.new("NodeGroupOutput").inputs[0])
    top = material.node_tree.nodes.new("ShaderNodeGroup")
    top.node_tree = outer
    output = material.node_tree.get_output_node("CYCLES")
    material.node_tree.links.new(top.outputs[0], output.inputs["Surface"])
    other = bpy.data.materials.new("Other")
    if other.node_tree is None:
        other.use_nodes = True
    other.node_tree.nodes.new("ShaderNodeGroup").node_tree = inner
    return SimpleNamespace(bpy=bpy, material=material, node=node, top=top, inner=inner, outer=outer)


def test_values_are_where_they_can_be_set_for_the_shader_alone(grouped: SimpleNamespace) -> None:
    from blender_addon.export.nodes.target_shader import target_shader

    found = target_shader(grouped.material)
    assert found.node == grouped.node
    assert found.path == ["Group", "Group", "Principled BSDF"]
    assert found.sockets["Base Color"] == grouped.top.inputs["Paint"]
    assert found.sockets["Roughness"] == grouped.node.inputs["Roughness"]
    assert found.sockets["Coat Weight"] == grouped.node.inputs["Coat Weight"]  # Shine is of two sockets: held


def test_an_apply_changes_nothing_that_others_use(grouped: SimpleNamespace) -> None:
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.result.write_back import apply_values, revert_values, toggle_values

    material, paint = grouped.material, grouped.top.inputs["Paint"]
    grouped.node.inputs["Roughness"].default_value, paint.default_value = 0.5, (0.1, 0.2, 0.3, 1.0)
    assert apply_values(material, {"Base Color": (0.5, 0.25, 0.125)}, JOB) == []  # on the material's own node
    assert grouped.outer.nodes["Group"].node_tree == grouped.inner
    notes = apply_values(material, {"Base Color": (0.75, 0.25, 0.5), "Roughness": 0.25, "Coat Weight": 1.0}, JOB)
    assert notes == [
        "Coat Weight has a link and was left as it is.",
        "The group 'Inner' is used elsewhere too: material 'Glaze' got a copy of its own.",
    ]
    assert tuple(paint.default_value) == pytest.approx((0.75, 0.25, 0.5, 1.0), abs=FLOAT32)
    assert grouped.node.inputs["Roughness"].default_value == 0.5  # of the other material
    own = target_shader(material).sockets["Roughness"]
    assert (own.default_value, own.id_data.users, grouped.inner.users) == (0.25, 1, 1)
    copy = material.copy()  # shares the groups again
    assert toggle_values(material) == [
        "The group 'Outer' is used elsewhere too: material 'Glaze' got a copy of its own."
    ]
    assert target_shader(material).sockets["Roughness"].default_value == 0.5
    assert target_shader(copy).sockets["Roughness"].default_value == 0.25
    toggle_values(material)
    assert revert_values(material) == []
    assert target_shader(material).sockets["Roughness"].default_value == 0.5
    assert tuple(paint.default_value) == pytest.approx((0.1, 0.2, 0.3, 1.0), abs=FLOAT32)


def test_the_copy_is_said_before(grouped: SimpleNamespace) -> None:
    from blender_addon.check.checks import quick_check

    scene = grouped.bpy.context.scene
    scene.render.engine = "CYCLES"
    found = {f.sentence: f.level for f in quick_check(scene, grouped.bpy.context.view_layer)}
    said = "The group 'Inner' of material 'Glaze' is used elsewhere too: an apply gives the material a copy of its own."
    assert found[said] == "ignored"
    assert found["Fitted inside nodes: Group/Shine."] == "fine"


def test_animation_inside_a_group_is_found(grouped: SimpleNamespace) -> None:
    from blender_addon.result.write_back import apply_values

    grouped.node.inputs["Roughness"].keyframe_insert("default_value")
    (note,) = apply_values(grouped.material, {"Roughness": 0.25}, JOB)
    assert note.startswith("Roughness has keyframes")


@pytest.fixture
def diffuse(scene: SimpleNamespace):
    """The Diffuse BSDF on the output of the active material."""
    tree = scene.bpy.data.materials["Glaze"].node_tree
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    return node


def test_a_diffuse_node_takes_its_values(scene: SimpleNamespace, diffuse) -> None:
    from blender_addon.result.write_back import apply_values, revert_values
    from blender_addon.versions import has_diffuse_roughness

    material = scene.bpy.data.materials["Glaze"]
    before = (*diffuse.inputs["Color"].default_value, diffuse.inputs["Roughness"].default_value)
    said = apply_values(material, {"Base Color": (0.5, 0.25, 0.125), "Diffuse Roughness": 0.75}, JOB)
    assert (said == []) == has_diffuse_roughness()
    assert tuple(diffuse.inputs["Color"].default_value) == pytest.approx((0.5, 0.25, 0.125, 1.0), abs=FLOAT32)
    assert diffuse.inputs["Roughness"].default_value == (0.75 if has_diffuse_roughness() else before[-1])
    assert revert_values(material) == []
    assert (*diffuse.inputs["Color"].default_value, diffuse.inputs["Roughness"].default_value) == before


@pytest.mark.parametrize(
    ("parameters", "fitted"),
    [
        ("all", ["base_color", "diffuse_roughness"]),
        ("reduced", ["base_color", "diffuse_roughness"]),
        ("diffuse_roughness, roughness", ["diffuse_roughness"]),
    ],
)
def test_a_diffuse_node_is_fitted_in_what_it_has(
    scene: SimpleNamespace, diffuse, parameters: str, fitted: list[str]
) -> None:
    import json

    from blender_addon.versions import has_diffuse_roughness

    rough = {"Diffuse Roughness"} if has_diffuse_roughness() else set()
    wanted = [name for name in fitted if rough or name != "diffuse_roughness"]
    ops = scene.bpy.ops.mfo
    options = {"reference": scene.reference, "job_folder": scene.job, "parameters": parameters, "max_iterations": 3}
    if not wanted:  # 4.2, whose Diffuse BSDF has an older lobe
        with pytest.raises(RuntimeError, match="has Color"):
            ops.fit(**options)
        return
    ops.fit(**options)
    request = json.loads((Path(scene.job) / "request.json").read_text("utf-8"))
    assert request["fit"]["parameters"] == wanted
    sockets = request["materials"]["target_bsdf"]["sockets"]
    free = {name for name, socket in sockets.items() if not socket["linked"]}
    assert free == {"Base Color", "Normal", *rough}
    assert sockets["Specular IOR Level"]["value"] == sockets["Metallic"]["value"] == 0.0


@pytest.mark.parametrize(
    ("options", "said"),
    [({"parameters": "metallic"}, "has Color"), ({"model": "mitsuba_principled"}, "model blender_principled alone")],
)
def test_what_a_diffuse_node_has_not_is_refused(scene: SimpleNamespace, diffuse, options: dict, said: str) -> None:
    with pytest.raises(RuntimeError, match=said):
        scene.bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job, **options)
    assert not Path(scene.job).exists()
