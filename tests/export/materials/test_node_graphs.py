# SPDX-License-Identifier: Apache-2.0
"""Sockets that nodes give: what a second Blender tells, and the picture of recorded paths with it, against Cycles."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mfo_backend.job.folder.job_folder import JobFolder  # noqa: E402
from mfo_backend.job.folder.request import read_request  # noqa: E402
from mfo_backend.job.run.job_scene import request_materials  # noqa: E402

from ..scenes import add_camera, add_light, add_quad, new_material, world_color  # noqa: E402


def ball(material: Any) -> Any:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    item = bpy.context.object
    item.data.materials.append(material)
    bpy.ops.object.shade_smooth()
    return item


def principled(material: Any) -> Any:
    return material.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node


def lit_scene(scene: Any) -> None:
    scene.render.resolution_x = scene.render.resolution_y = 48
    add_camera("PERSP", location=(0.0, 0.0, 4.0))
    add_light("POINT", location=(1.5, 1.0, 3.0), energy=300.0, shadow_soft_size=0.0)


def coordinates(tree: Any) -> Any:
    """Generated coordinates of a ball of radius 1 are (position + 1) / 2."""
    return tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"]


def test_values_are_those_of_the_positions(scene: Any, export: Any) -> None:
    """Through a group two deep, a muted node and an output of the user's own, on a mesh that another object shares."""
    lit_scene(scene)
    material = new_material("Target")
    tree = material.node_tree
    inner = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    outer = bpy.data.node_groups.new("Outer", "ShaderNodeTree")
    for group in (inner, outer):
        group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketVector")
        group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketVector")
    passing = inner.nodes.new("ShaderNodeVectorMath")
    passing.mute = True
    for group, node in ((inner, passing), (outer, outer.nodes.new("ShaderNodeGroup"))):
        if group is outer:
            node.node_tree = inner
        group.links.new(group.nodes.new("NodeGroupInput").outputs[0], node.inputs[0])
        group.links.new(node.outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = outer
    tree.links.new(coordinates(tree), node.inputs[0])
    tree.links.new(node.outputs[0], principled(material).inputs["Base Color"])
    own = tree.nodes.new("ShaderNodeOutputAOV")
    own.aov_name = "mfo mask"
    target = ball(material)
    other = bpy.data.objects.new("Other", target.data)
    other.location = (0.0, 0.0, -3.0)
    scene.collection.objects.link(other)
    bpy.context.view_layer.objects.active = target
    before = {name: len(getattr(bpy.data, name)) for name in ("materials", "node_groups", "images", "worlds")}
    report = export(target)
    assert {name: len(getattr(bpy.data, name)) for name in before} == before
    assert report.notes == ()
    entry = report.request["materials"]["target_bsdf"]["sockets"]["Base Color"]
    both, given = (np.load(report.folder / file) for file in (report.request["graph"]["positions"], entry["graph"]))
    there = np.isfinite(both).all(axis=2)
    np.testing.assert_allclose(given[there], (both[there] + 1.0) / 2.0, atol=2e-5)
    # the near side, and what the camera would see were that away
    positions, far = np.split(both, 2)
    assert np.nanmin(positions[..., 2]) > 0.2
    assert -1.0 < np.nanmin(far[..., 2]) < -0.95
    assert np.nanmax(far[..., 2]) < 0.3
    seen, values = there[: len(positions)], given[: len(positions)]
    np.testing.assert_allclose(entry["value"], values[seen].mean(axis=0), rtol=1e-4)
    assert np.linalg.norm(positions[seen], axis=1).max() < 1.001  # nothing of the other object
    # the camera's matrix leads from each position back to its subpixel
    matrix = np.array(report.request["graph"]["camera"])
    column, row, w = (np.concatenate([positions[seen], np.ones((seen.sum(), 1))], axis=1) @ matrix.T).T
    rows, columns = np.nonzero(seen)
    assert np.abs(column / w - columns - 0.5).mean() < 0.15
    assert np.abs(row / w - rows - 0.5).mean() < 0.15


def noise_ramp(tree: Any, node: Any) -> None:
    noise, ramp = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeValToRGB")
    noise.inputs["Scale"].default_value = 3.0
    low, high = ramp.color_ramp.elements
    low.color, low.position, high.color, high.position = (0.8, 0.1, 0.05, 1.0), 0.4, (0.05, 0.2, 0.7, 1.0), 0.6
    tree.links.new(noise.outputs[0], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], node.inputs["Base Color"])


def bump(socket: str) -> Callable[[Any, Any], None]:
    def build(tree: Any, node: Any) -> None:
        noise, bumped = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeBump")
        noise.inputs["Scale"].default_value = 4.0
        bumped.inputs["Strength"].default_value, bumped.inputs["Distance"].default_value = 1.0, 0.2
        tree.links.new(noise.outputs[0], bumped.inputs["Height"])
        tree.links.new(bumped.outputs[0], node.inputs[socket])

    return build


def brushed(tree: Any, node: Any) -> None:
    tangent = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.axis = "RADIAL", "X"
    tree.links.new(tangent.outputs[0], node.inputs["Tangent"])


@pytest.mark.parametrize(
    ("build", "values", "most"),
    [
        (noise_ramp, {"Roughness": 0.4}, 0.01),
        (bump("Normal"), {"Base_Color": (0.4, 0.3, 0.2), "Roughness": 0.4, "Sheen_Weight": 0.5}, 0.015),
        (bump("Coat Normal"), {"Base_Color": (0.4, 0.3, 0.2), "Coat_Weight": 1.0, "Coat_Roughness": 0.3}, 0.01),
        (brushed, {"Metallic": 1.0, "Roughness": 0.5, "Anisotropic": 0.8}, 0.01),
    ],
    ids=["ramp", "bump", "coat", "tangent"],
)
def test_the_recorded_picture_is_cycles(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, build: Any, values: Any, most: float
) -> None:
    """Level and root mean square difference of pixels inside the ball, as a share of its mean."""
    lit_scene(scene)
    material = new_material("Target", **values)
    build(material.node_tree, principled(material))
    found, truth = recorded_and_cycles(export, render_cycles, ball(material))
    assert abs(found.mean() / truth.mean() - 1.0) < 0.003
    assert np.sqrt(np.mean((found - truth) ** 2)) / truth.mean() < most


def renderer_and_cycles(
    export: Any, render_cycles: Any, target: Any, parameters: Sequence[str] | None = None
) -> tuple[Any, Any]:
    """The renderer of the exported job, where these are fitted, and the picture by Cycles."""
    from mfo_backend.render.pictures.renderer import load_renderer

    wanted = render_cycles()
    report = export(target, reference=None, fit={} if parameters is None else {"parameters": parameters})
    request = json.loads((report.folder / "request.json").read_text())
    request["reference"] = {"path": "scene.xml", "encoding": "linear"}  # there is none, and nobody reads it
    (report.folder / "request.json").write_text(json.dumps(request))
    folder = JobFolder.open(report.folder)
    request = read_request(folder)
    names = request.fit.parameters if isinstance(request.fit.parameters, tuple) else ["ior"]
    renderer = load_renderer(
        folder.root / request.scene, request.target.shape_id, model="blender_principled", parameters=names,
        materials=request_materials(folder, request), light_paths=request.light_paths,
    )  # fmt: skip
    return renderer, wanted


def recorded_and_cycles(export: Any, render_cycles: Any, target: Any) -> tuple[Any, Any]:
    """Pixels inside the target, by the recorded paths of the exported job and by Cycles."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    renderer, wanted = renderer_and_cycles(export, render_cycles, target)
    recorded = RecordedScene(renderer, int(renderer.target_mask().sum()))
    paths = recorded.record(renderer.start, grid=4, seed=0, near=True)
    groups = paths.pixel_groups(paths.interior)
    found = np.asarray(recorded.pictures(paths, groups)(renderer.start))[:, :, 0]
    return found, wanted.reshape(-1, 3)[groups.pixels]


def test_a_mirror_aslant_shows_where_the_far_side_begins(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any
) -> None:
    """A ball that is white before and black from a sharp edge at its rim on, which a mirror shows from the side.

    What lies just behind the rim had what the camera sees just before it: 8.5 % too bright.
    """
    lit_scene(scene)
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.camera.data.lens, scene.cycles.max_bounces, scene.cycles.samples = 20.0, 2, 256
    scene.cycles.diffuse_bounces = scene.cycles.glossy_bounces = 2
    world_color(scene, 1.0)
    mirror = add_quad("Mirror", 3.4, 0.0, new_material("Mirror", Metallic=1.0, Roughness=0.0))
    mirror.location, mirror.rotation_euler = (2.3, 0.0, 0.0), (0.0, -np.pi / 4, 0.0)
    material = new_material("Target", Specular_IOR_Level=0.0)
    tree = material.node_tree
    split, edge = tree.nodes.new("ShaderNodeSeparateXYZ"), tree.nodes.new("ShaderNodeMath")
    edge.operation = "GREATER_THAN"
    tree.links.new(coordinates(tree), split.inputs[0])
    tree.links.new(split.outputs["Z"], edge.inputs[0])
    edge.inputs[1].default_value = 0.625
    tree.links.new(edge.outputs[0], principled(material).inputs["Base Color"])
    renderer, wanted = renderer_and_cycles(export, render_cycles, ball(material))
    found = np.mean([renderer.image(renderer.start, seed=seed, spp=256) for seed in range(4)], axis=0)
    image = slice(13, 19), slice(19, 27)  # of the ball in the mirror
    assert abs(found[image].mean() / wanted[image].mean() - 1.0) < 0.02


def test_open_shading_language_evaluates_nodes_as_the_other(scene: Any, export: Any) -> None:
    """It writes no outputs: no camera saw such a target."""
    lit_scene(scene)
    material = new_material("Target")
    noise_ramp(material.node_tree, principled(material))
    target, found = ball(material), []
    for number, by_language in enumerate((False, True)):
        scene.cycles.shading_system = by_language
        report = export(target, name=f"job_{number}")
        assert scene.cycles.shading_system == by_language
        entry = report.request["materials"]["target_bsdf"]["sockets"]["Base Color"]
        found.append(np.load(report.folder / entry["graph"]))
    np.testing.assert_allclose(*found, atol=1e-6)


def test_one_blender_evaluates_and_bakes(scene: Any, export: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The target's nodes, the world's and a neighbour's; what they give is what each alone gives."""
    from blender_addon.probe import client

    lit_scene(scene)
    sky = world_color(scene, 1.0)
    tree = scene.world.node_tree
    gradient = tree.nodes.new("ShaderNodeTexGradient")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], gradient.inputs[0])
    tree.links.new(gradient.outputs["Color"], sky.inputs["Color"])
    neighbour = new_material("Neighbour")
    noise_ramp(neighbour.node_tree, principled(neighbour))
    ball(neighbour).location = (0.0, 0.0, -3.0)
    material = new_material("Target")
    noise_ramp(material.node_tree, principled(material))
    target, started = ball(material), []
    begin = client.Probe.__init__
    monkeypatch.setattr(client.Probe, "__init__", lambda probe: (started.append(probe), begin(probe))[1])
    report = export(target)
    assert len(started) == 1
    values = np.load(report.folder / report.request["materials"]["target_bsdf"]["sockets"]["Base Color"]["graph"])
    tree.links.remove(sky.inputs["Color"].links[0])
    bpy.data.objects.remove(next(o for o in scene.objects if o.active_material == neighbour))
    alone = export(target, name="alone")
    entry = alone.request["materials"]["target_bsdf"]["sockets"]["Base Color"]
    found = np.load(alone.folder / entry["graph"])
    near = len(values) // 2
    np.testing.assert_array_equal(found[:near], values[:near])
    np.testing.assert_allclose(found[near:], values[near:], atol=1e-6)  # Cycles meets the far side in another tree


def test_nothing_is_left_in_the_temporary_folder() -> None:
    import os
    import tempfile

    assert not list(Path(tempfile.gettempdir()).glob(f"material_fit_probe_{os.getpid()}_*"))


@pytest.mark.parametrize("kind", ["colours", "normals"])
def test_another_object_of_the_material_shows_what_its_nodes_give_there(
    scene: Any, export: Any, render_cycles: Any, kind: str
) -> None:
    """A ball beside the target, of the same material: it had the mean colour of the target, and no bumps."""
    lit_scene(scene)
    scene.cycles.samples = 256
    material = new_material("Shared", Roughness=0.8)
    tree = material.node_tree
    if kind == "colours":
        separate, right = tree.nodes.new("ShaderNodeSeparateXYZ"), tree.nodes.new("ShaderNodeMath")
        right.operation = "GREATER_THAN"
        tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], separate.inputs[0])
        tree.links.new(separate.outputs["X"], right.inputs[0])
        tree.links.new(right.outputs[0], principled(material).inputs["Base Color"])
    else:
        tilted = tree.nodes.new("ShaderNodeNormalMap")
        tilted.inputs["Color"].default_value = (0.8, 0.6, 0.85, 1.0)
        tree.links.new(tilted.outputs[0], principled(material).inputs["Normal"])
    target, other = ball(material), ball(material)
    for item, x in ((target, -0.6), (other, 0.6)):
        item.scale, item.location = (0.5, 0.5, 0.5), (x, 0.0, 0.0)
    bpy.context.view_layer.update()
    renderer, wanted = renderer_and_cycles(export, render_cycles, target)
    found = np.mean([renderer.image(renderer.start, seed=seed, spp=64) for seed in range(4)], axis=0)
    beside = slice(12, 36), slice(26, 48)
    assert found[beside].mean() == pytest.approx(wanted[beside].mean(), rel=0.02)
    assert wanted[beside].mean() > 0.05


def test_pixels_at_the_edge_of_the_picture(scene: Any, export: Any, render_cycles: Any) -> None:
    """Their filter looks beside the picture, where a target that goes on had no bumps: they were 10 to 20 % off."""
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.cycles.pixel_filter_type, scene.cycles.filter_width, scene.cycles.samples = "BLACKMAN_HARRIS", 1.5, 1024
    add_camera("ORTHO", ortho_scale=2.0)
    add_light("SUN", rotation=(0.0, 0.8, 0.4), energy=3.0)
    material = new_material("Slope", Specular_IOR_Level=0.0)
    tree = material.node_tree
    tilted = tree.nodes.new("ShaderNodeNormalMap")
    tilted.inputs["Color"].default_value = (0.9, 0.5, 0.75, 1.0)
    tree.links.new(tilted.outputs[0], principled(material).inputs["Normal"])
    target = add_quad("Slope", 4.0, 0.0, material)
    target.data.uv_layers.new(name="UVMap")
    bpy.context.view_layer.update()
    renderer, wanted = renderer_and_cycles(export, render_cycles, target)
    found = np.mean([renderer.image(renderer.start, seed=seed, spp=256) for seed in range(4)], axis=0)
    for edge in (np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1]):
        assert found[edge].mean() == pytest.approx(wanted[edge].mean(), rel=0.01)
