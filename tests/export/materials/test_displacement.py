# SPDX-License-Identifier: Apache-2.0
"""What is linked to Displacement: bent normals of the target, faces that move, and both against Cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.nodes.displacement import bends_normals, moves_faces  # noqa: E402
from blender_addon.export.nodes.target_shader import target_shader  # noqa: E402
from blender_addon.graph_values.table import graph_values  # noqa: E402

from ..scenes import new_material  # noqa: E402
from .test_node_graphs import ball, lit_scene, principled, recorded_and_cycles  # noqa: E402

SLOPE = 0.5


def displace(material: Any, height: Any, scale: float, method: str) -> Any:
    """Put a Displacement node with `height` on the output; returns the node."""
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeDisplacement")
    node.inputs["Midlevel"].default_value, node.inputs["Scale"].default_value = 0.0, scale
    tree.links.new(height, node.inputs["Height"])
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    material.displacement_method = method
    return node


def along_x(material: Any) -> Any:
    """The x of the object's coordinates."""
    tree = material.node_tree
    apart = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], apart.inputs[0])
    return apart.outputs["X"]


def noise(material: Any, scale: float) -> Any:
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexNoise")
    node.inputs["Scale"].default_value = scale
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
    return node.outputs[0]


def grid(material: Any) -> Any:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=16, y_subdivisions=16)
    item = bpy.context.object
    item.data.materials.append(material)
    return item


def vertices(report: Any) -> tuple[np.ndarray, np.ndarray]:
    """Positions and normals of the target, the one mesh there is."""
    (path,) = (report.folder / "meshes").glob("*.ply")
    return ply_vertices(path)


def ply_vertices(path: Path) -> tuple[np.ndarray, np.ndarray]:
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    mesh = mi.traverse(mi.load_dict({"type": "ply", "filename": str(path)}))
    return np.array(mesh["vertex_positions"]).reshape(-1, 3), np.array(mesh["vertex_normals"]).reshape(-1, 3)


@pytest.mark.parametrize(
    ("method", "bends", "moves"), [("BUMP", True, False), ("DISPLACEMENT", False, True), ("BOTH", True, True)]
)
def test_the_method_says_what_a_displacement_does(scene: Any, method: str, bends: bool, moves: bool) -> None:
    material = new_material("Target")
    assert (bends_normals(material), moves_faces(material), bends_normals(None)) == (False, False, False)
    node = displace(material, along_x(material), SLOPE, method)
    assert (bends_normals(material), moves_faces(material)) == (bends, moves)
    node.outputs[0].links[0].is_muted = True
    assert (bends_normals(material), moves_faces(material)) == (False, False)


@pytest.mark.parametrize("method", ["BUMP", "DISPLACEMENT", "BOTH"])
def test_a_slope_bends_normals_or_moves_faces(scene: Any, export: Any, method: str) -> None:
    """z = x / 2 has the normal (-1, 0, 2) / sqrt(5); both bend the normals of the mesh as it was."""
    lit_scene(scene)
    material = new_material("Target")
    displace(material, along_x(material), SLOPE, method)
    report = export(grid(material))
    assert report.notes == ()
    positions, normals = vertices(report)
    height = 0.0 if method == "BUMP" else SLOPE * positions[:, 0]
    np.testing.assert_allclose(positions[:, 2], height, atol=1e-4)
    is_of_before = method == "BUMP" or (method == "BOTH" and bpy.app.version >= (5, 0))  # its faces are flat
    own = np.array([0.0, 0.0, 1.0]) if is_of_before else np.array([-SLOPE, 0.0, 1.0]) / np.hypot(1.0, SLOPE)
    np.testing.assert_allclose(normals, np.broadcast_to(own, normals.shape), atol=1e-3)
    socket = report.request["materials"]["target_bsdf"]["sockets"].get("Shading Normal")
    assert (socket is None) == (method == "DISPLACEMENT")
    if socket is not None and (method == "BUMP" or bpy.app.version >= (5, 0)):  # 4.x bends moved faces once more
        given = np.load(report.folder / socket["graph"])
        given = given[np.linalg.norm(given, axis=2) > 0.5]
        expected = np.array([-SLOPE, 0.0, 1.0]) / np.hypot(1.0, SLOPE)
        np.testing.assert_allclose(np.median(given, axis=0), expected, atol=2e-3)


@pytest.mark.parametrize("method", ["BUMP", "DISPLACEMENT", "BOTH"])
@pytest.mark.parametrize("shape", ["smooth", "flat", "mirrored"])
def test_the_recorded_picture_is_cycles(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, method: str, shape: str
) -> None:
    """Level and root mean square difference inside the ball; the displacement left out they are 1 to 9 % and 20 %."""
    lit_scene(scene)
    scene.cycles.samples = 256
    material = new_material("Target", Base_Color=(0.4, 0.3, 0.2), Roughness=0.4)
    displace(material, noise(material, 2.0), 0.4, method)
    item = ball(material)
    if shape == "flat":
        bpy.ops.object.shade_flat()
    if shape == "mirrored":
        item.scale, item.rotation_euler = (-0.9, 0.7, 0.8), (0.3, 0.5, 0.7)
    found, truth = recorded_and_cycles(export, render_cycles, item)
    assert abs(found.mean() / truth.mean() - 1.0) < 0.004
    assert np.sqrt(np.mean((found - truth) ** 2)) / truth.mean() < 0.025


def test_a_softened_terminator_asks_the_normal_that_a_bump_has_bent(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any
) -> None:
    """By the mesh's normal a scene was 1 % too bright, and this ball is 0.63 %."""
    lit_scene(scene)
    scene.cycles.samples = 256
    material = new_material("Target", Base_Color=(0.4, 0.3, 0.2), Roughness=0.4)
    displace(material, noise(material, 2.0), 0.4, "BUMP")
    item = ball(material)
    on_object = hasattr(item, "shadow_terminator_shading_offset")  # Blender 5.0
    owner, name = (item, "shadow_terminator_shading_offset") if on_object else (item.cycles, "shadow_terminator_offset")
    setattr(owner, name, 0.6)
    found, truth = recorded_and_cycles(export, render_cycles, item)
    assert abs(found.mean() / truth.mean() - 1.0) < 0.004
    assert np.sqrt(np.mean((found - truth) ** 2)) / truth.mean() < 0.04


def test_a_displacement_far_from_zero_is_as_fine_as_near(scene: Any, export: Any) -> None:
    """3 km away places in the world are a quarter of a millimetre apart: faces of 4 cm would lean by half a degree."""
    lit_scene(scene)
    for item in scene.objects:
        item.location.x += 3000.0
    material = new_material("Target")
    displace(material, along_x(material), SLOPE, "DISPLACEMENT")
    item = grid(material)
    item.location.x = 3000.0
    bpy.context.view_layer.update()
    positions, normals = vertices(export(item))
    expected = np.array([-SLOPE, 0.0, 1.0]) / np.hypot(1.0, SLOPE)
    assert np.abs(normals - expected).max() < 1e-3
    np.testing.assert_allclose(np.ptp(positions[:, 2]), SLOPE * np.ptp(positions[:, 0]), rtol=1e-3)


def test_what_else_an_object_has_does_not_matter(scene: Any, export: Any) -> None:
    """A slot without a material, whose faces stay with their neighbours, and an attribute by the name of the bake's."""
    lit_scene(scene)
    material = new_material("Target")
    displace(material, along_x(material), SLOPE, "DISPLACEMENT")
    item = grid(material)
    item.data.materials.append(None)
    for polygon in item.data.polygons:
        polygon.material_index = int(polygon.center.x > 0.01)
    item.data.color_attributes.new("material_fit", "BYTE_COLOR", "POINT")
    report = export(item)
    assert [note for note in report.notes if "displacement" in note] == []
    positions = np.concatenate([ply_vertices(path)[0] for path in sorted((report.folder / "meshes").glob("*.ply"))])
    assert positions[:, 0].max() == pytest.approx(1.0)
    moved = positions[:, 0] < 0.01  # vertices of both are moved, as in Cycles
    np.testing.assert_allclose(positions[moved, 2], SLOPE * positions[moved, 0], atol=1e-4)
    np.testing.assert_allclose(positions[positions[:, 0] > 0.2, 2], 0.0, atol=1e-6)


def test_a_normal_map_above_a_displacement_is_that_of_cycles(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any
) -> None:
    """As sets of textures have them: a picture on Normal and one on Displacement by bump."""
    lit_scene(scene)
    # a coat as sharp as the default has its highlight in one pixel, of 16 rays
    coat = {"Coat_Weight": 0.5, "Coat_Roughness": 0.3}
    material = new_material("Target", Base_Color=(0.4, 0.3, 0.2), Roughness=0.4, **coat)
    tree, shader = material.node_tree, principled(material)
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Distance"].default_value = 0.1
    tree.links.new(noise(material, 5.0), bump.inputs["Height"])
    tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    displace(material, noise(material, 2.0), 0.3, "BUMP")
    found, truth = recorded_and_cycles(export, render_cycles, ball(material))
    assert abs(found.mean() / truth.mean() - 1.0) < 0.003
    assert np.sqrt(np.mean((found - truth) ** 2)) / truth.mean() < 0.02


def test_values_that_displace_are_held(scene: Any) -> None:
    """A noise scale that feeds the colour alone is free, one that moves the surface is not."""
    material = new_material("Target")
    tree, shader = material.node_tree, principled(material)
    tree.links.new(noise(material, 3.0), shader.inputs["Roughness"])
    target = target_shader(material)
    assert target is not None
    assert "Noise Texture/Scale" in [value.name for value in graph_values(target)]
    displace(material, shader.inputs["Roughness"].links[0].from_socket, 0.1, "BUMP")
    assert "Noise Texture/Scale" not in [value.name for value in graph_values(target)]


def test_a_displacement_that_cannot_be_evaluated_is_refused(scene: Any, export: Any, tmp_path: Path) -> None:
    from blender_addon.export.findings import ExportError

    lit_scene(scene)
    material = new_material("Target")
    script = material.node_tree.nodes.new("ShaderNodeGroup")
    node = displace(material, along_x(material), SLOPE, "BUMP")
    script.node_tree = bpy.data.node_groups.new("Empty", "ShaderNodeTree")
    script.node_tree.interface.new_socket("Height", in_out="OUTPUT", socket_type="NodeSocketFloat")
    material.node_tree.links.new(script.outputs[0], node.inputs["Height"])
    with pytest.raises(ExportError, match="Displacement of material 'Target' is linked to the group 'Empty' without"):
        export(grid(material))


def test_a_displacement_that_cycles_cannot_bake_is_named(
    scene: Any, export: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from blender_addon.bake.baker import BakeError, Baker

    def ask(self: Baker, command: str, **request: Any) -> int:
        raise BakeError("No Blender answers.")

    monkeypatch.setattr(Baker, "ask", ask)
    lit_scene(scene)
    material = new_material("Target")
    displace(material, along_x(material), SLOPE, "DISPLACEMENT")
    report = export(grid(material))
    assert report.notes == ("The displacement of 'Grid' is left out: No Blender answers.",)
    assert np.abs(vertices(report)[0][:, 2]).max() == 0.0


@pytest.mark.parametrize("method", ["bump", "displacement"])
def test_bumps_finer_than_a_subpixel_darken_as_in_cycles(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, method: str
) -> None:
    """In a mean of their normals they are flat: 4.7 and 2.5 % too bright."""
    lit_scene(scene)
    material, scale = new_material("Target", Roughness=0.6), 60.0
    if method == "bump":
        bump = material.node_tree.nodes.new("ShaderNodeBump")
        bump.inputs["Distance"].default_value = 1.2 / scale
        material.node_tree.links.new(noise(material, scale), bump.inputs["Height"])
        material.node_tree.links.new(bump.outputs[0], principled(material).inputs["Normal"])
    else:
        displace(material, noise(material, scale), 1.2 / scale, "BUMP")
    found, truth = recorded_and_cycles(export, render_cycles, ball(material))
    assert abs(found.mean() / truth.mean() - 1.0) < 0.003


@pytest.mark.parametrize("asked", ["Fresnel", "Facing", "Normal"])
def test_colours_by_bumps_finer_than_a_subpixel_are_of_their_own_directions(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, asked: str
) -> None:
    """A mean of four belongs to none of them: 18, 13 and -17 % off."""
    lit_scene(scene)
    scene.render.resolution_x = scene.render.resolution_y = 64
    material, scale = new_material("Target", Roughness=0.6), 60.0
    displace(material, noise(material, scale), 4.0 / scale, "BUMP")
    kind = {"Fresnel": "Fresnel", "Facing": "LayerWeight", "Normal": "NewGeometry"}[asked]
    node = material.node_tree.nodes.new(f"ShaderNode{kind}")
    output = node.outputs[0 if asked == "Fresnel" else asked]
    material.node_tree.links.new(output, principled(material).inputs["Base Color"])
    found, truth = recorded_and_cycles(export, render_cycles, ball(material))
    assert abs(found.mean() / truth.mean() - 1.0) < 0.01


@pytest.mark.skipif(bpy.app.version < (4, 4, 0), reason="its bumps have no Filter Width")
def test_a_linked_filter_width_is_that_of_a_pixel(scene: Any, export: Any, render_cycles: Any, mitsuba: Any) -> None:
    lit_scene(scene)
    material = new_material("Target", Roughness=0.6)
    tree = material.node_tree
    bump, width = tree.nodes.new("ShaderNodeBump"), tree.nodes.new("ShaderNodeValue")
    bump.inputs["Distance"].default_value, width.outputs[0].default_value = 0.05, 3.0
    tree.links.new(noise(material, 15.0), bump.inputs["Height"])
    tree.links.new(width.outputs[0], bump.inputs["Filter Width"])
    tree.links.new(bump.outputs[0], principled(material).inputs["Normal"])
    found, truth = recorded_and_cycles(export, render_cycles, ball(material))
    assert abs(found.mean() / truth.mean() - 1.0) < 0.003


def beyond_bounds(material: Any, scale: float, name: str) -> Any:
    """The material with a noise on a socket of its Principled BSDF, most of which is below 0 and the rest above 1."""
    spread = material.node_tree.nodes.new("ShaderNodeMath")
    spread.operation = "MULTIPLY_ADD"
    spread.inputs[1].default_value, spread.inputs[2].default_value = 8.0, -4.4
    material.node_tree.links.new(noise(material, scale), spread.inputs[0])
    material.node_tree.links.new(spread.outputs[0], principled(material).inputs[name])
    return material


@pytest.mark.parametrize("name", ["Base Color", "Metallic"])
def test_numbers_beyond_bounds_finer_than_a_subpixel_are_bounded_one_by_one(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, name: str
) -> None:
    """A mean of numbers of which most are below zero is below zero, and was none of them: -53 and 4 % off."""
    lit_scene(scene)
    material = beyond_bounds(new_material("Target", Roughness=0.4), 90.0, name)
    found, truth = recorded_and_cycles(export, render_cycles, ball(material))
    assert abs(found.mean() / truth.mean() - 1.0) < 0.01


@pytest.mark.parametrize("name", ["Base Color", "Transmission Weight", "Alpha"])
def test_numbers_beyond_bounds_of_a_neighbour_are_bounded_one_by_one(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, name: str
) -> None:
    from ..scenes import add_quad
    from .test_mixed_targets import lit_by_the_sky
    from .test_node_graphs import renderer_and_cycles

    lit_by_the_sky(scene)
    ball(beyond_bounds(new_material("Neighbour", Roughness=0.4), 60.0, name))
    found, truth = renderer_and_cycles(export, render_cycles, add_quad("Floor", 6.0, -1.2, new_material("Target")))
    shown, middle = found.image(found.start, seed=0, spp=512), np.s_[8:16, 8:16]
    assert abs(shown[middle].mean() / truth[middle].mean() - 1.0) < 0.03
