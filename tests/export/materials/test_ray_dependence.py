# SPDX-License-Identifier: Apache-2.0
"""Nodes that ask for the ray: light that bounces within a hollow target finds other values than the camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.job import check_export  # noqa: E402
from mfo_backend.job.folder.job_folder import JobFolder  # noqa: E402
from mfo_backend.job.folder.request import read_request  # noqa: E402

from ..scenes import new_material  # noqa: E402
from .test_graph_values import evaluator  # noqa: E402
from .test_node_graphs import lit_scene, principled, recorded_and_cycles, renderer_and_cycles  # noqa: E402


def bowl(material: Any) -> Any:
    """A half ball that the camera looks into."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    item = bpy.context.object
    item.data.materials.append(material)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.bisect(plane_co=(0.0, 0.0, 0.0), plane_no=(0.0, 0.0, 1.0), clear_outer=True)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.object.shade_smooth()
    return item


def facing(tree: Any) -> Any:
    """White where looked at straight, black from the side."""
    weight, ramp = tree.nodes.new("ShaderNodeLayerWeight"), tree.nodes.new("ShaderNodeValToRGB")
    low, high = ramp.color_ramp.elements
    low.color, low.position, high.color, high.position = (0.9, 0.9, 0.9, 1.0), 0.35, (0.05, 0.05, 0.05, 1.0), 0.55
    tree.links.new(weight.outputs["Facing"], ramp.inputs[0])
    return ramp.outputs[0]


def incoming(tree: Any) -> Any:
    """The same by the product of ray and normal."""
    geometry, product = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeVectorMath")
    product.operation = "DOT_PRODUCT"
    tree.links.new(geometry.outputs["Incoming"], product.inputs[0])
    tree.links.new(geometry.outputs["Normal"], product.inputs[1])
    return product.outputs["Value"]


def camera_ray(tree: Any) -> Any:
    """White for the camera, in a group, and black for all others."""
    group = bpy.data.node_groups.new("Rays", "ShaderNodeTree")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketFloat")
    path, output = group.nodes.new("ShaderNodeLightPath"), group.nodes.new("NodeGroupOutput")
    group.links.new(path.outputs["Is Camera Ray"], output.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    return node.outputs[0]


@pytest.mark.parametrize("build", [facing, incoming, camera_ray])
def test_bounces_find_what_rays_from_elsewhere_find(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, tmp_path: Path, build: Any
) -> None:
    """The level is Cycles', and 10 to 80 % off were all rays the camera's; a fit's nodes give the export's."""
    lit_scene(scene)
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 3
    material = new_material("Target", Roughness=1.0)
    tree, shader = material.node_tree, principled(material)
    tree.links.new(build(tree), shader.inputs["Base Color"])
    target = bowl(material)
    found, truth = recorded_and_cycles(export, render_cycles, target)
    assert abs(found.mean() / truth.mean() - 1.0) < 0.005
    if build is not facing:
        return
    report = export(target, name="again", fit={"parameters": ["Color Ramp/Stop 0"]}, reference=tmp_path / "cycles.exr")
    request = read_request(JobFolder.open(report.folder))
    socket = request.materials["target_bsdf"].sockets["Base Color"]
    shown = evaluator(request, tmp_path)([([(0.9, 0.9, 0.9)], ["Base Color"])], scale=4, samples=4, elsewhere=True)
    (evaluated,) = shown.elsewhere.values()
    np.testing.assert_allclose(evaluated, np.load(report.folder / socket.elsewhere), atol=1e-5)


def floor_and_lid(material: Any) -> Any:
    """A floor with a smaller lid above it, in one mesh; the camera sees the lid's upper side."""
    bpy.ops.mesh.primitive_plane_add(size=3.0)
    item = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.primitive_plane_add(size=1.6, location=(0.0, 0.0, 1.0))
    bpy.ops.object.mode_set(mode="OBJECT")
    item.data.materials.append(material)
    return item


@pytest.mark.parametrize("in_group", [False, True])
def test_a_normal_map_is_turned_on_the_side_that_the_camera_does_not_see(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, in_group: bool
) -> None:
    """A lamp below the lid lights the floor by way of the lid's lower side; mirrored, as a bump, it is 1.1 % off."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    lit_scene(scene)
    light = next(item for item in scene.objects if item.type == "LIGHT")
    light.location, scene.cycles.samples = (0.1, 0.2, 0.4), 512
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 1
    material = new_material("Target", Base_Color=(0.9, 0.9, 0.9), Roughness=1.0)
    tree, shader = material.node_tree, principled(material)
    shader.inputs["Specular IOR Level"].default_value = 0.0
    inner = bpy.data.node_groups.new("Relief", "ShaderNodeTree") if in_group else tree
    relief = inner.nodes.new("ShaderNodeNormalMap")
    relief.inputs["Color"].default_value = (0.2, 0.5, 0.9, 1.0)
    made = relief.outputs[0]
    if in_group:
        inner.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketVector")
        inner.links.new(made, inner.nodes.new("NodeGroupOutput").inputs[0])
        outer = tree.nodes.new("ShaderNodeGroup")
        outer.node_tree = inner
        made = outer.outputs[0]
    tree.links.new(made, shader.inputs["Normal"])
    renderer, truth = renderer_and_cycles(export, render_cycles, floor_and_lid(material))
    recorded = RecordedScene(renderer, int(renderer.target_mask().sum()))
    levels = []
    for seed in range(6):
        paths = recorded.record(renderer.start, grid=4, seed=seed, near=True)
        groups = paths.pixel_groups(paths.interior)
        found = np.asarray(recorded.pictures(paths, groups)(renderer.start))[:, :, 0]
        levels.append(found.mean() / truth.reshape(-1, 3)[groups.pixels].mean())
    assert abs(np.mean(levels) - 1.0) < 0.003


def test_bounces_find_no_rounded_edges(scene: Any, export: Any) -> None:
    """Cycles rounds them for the camera and for mirrors alone; few rays of a Bevel node are named."""
    lit_scene(scene)
    scene.render.resolution_x = scene.render.resolution_y = 16
    material = new_material("Target")
    tree, shader = material.node_tree, principled(material)
    bevel = tree.nodes.new("ShaderNodeBevel")
    bevel.inputs["Radius"].default_value, bevel.samples = 0.3, 4
    tree.links.new(bevel.outputs[0], shader.inputs["Normal"])
    bpy.ops.mesh.primitive_cube_add()
    target = bpy.context.object
    target.data.materials.append(material)
    report = export(target)
    assert len(report.notes) == 1
    assert "draws another normal from the 4 rays of the node 'Bevel'" in report.notes[0]
    entry = report.request["materials"]["target_bsdf"]["sockets"]["Normal"]
    near, others = (np.load(report.folder / entry[name]) for name in ("graph", "elsewhere"))
    up = np.array([0.0, 0.0, 1.0])
    met = near[np.linalg.norm(near, axis=2) > 0.5]
    assert (met @ up).min() < 0.9
    others = others[np.linalg.norm(others, axis=2) > 0.5]
    np.testing.assert_allclose(others @ up, 1.0, atol=1e-3)
    bevel.samples = 16
    assert not any(check_export(bpy.context, target))
