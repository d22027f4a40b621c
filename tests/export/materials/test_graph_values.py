# SPDX-License-Identifier: Apache-2.0
"""Recorded pictures at other values inside the nodes, against Cycles, and their derivatives, against differences."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mfo_backend.job.folder.job_folder import JobFolder  # noqa: E402
from mfo_backend.job.folder.request import read_request  # noqa: E402
from mfo_backend.job.run.job_scene import request_materials  # noqa: E402

from ..scenes import add_quad, new_material, world_color  # noqa: E402
from .test_node_graphs import ball, bump, coordinates, lit_scene, noise_ramp, principled  # noqa: E402


def evaluator(request: Any, folder: Path) -> Any:
    """What a second Blender answers, from this one."""
    from blender_addon.probe.value_pictures import answer
    from mfo_backend.render.models.graph_pictures import Evaluated

    where = request.graph.evaluate

    def evaluate(variants: Sequence[Any], *, scale: int, samples: int, elsewhere: bool = False) -> Any:
        asked = [{"values": list(values), "sockets": list(names)} for values, names in variants]
        found = answer({
            **where, "places": [value.place for value in request.graph.values], "variants": asked,
            "scale": scale, "samples": samples, "elsewhere": elsewhere, "folder": str(folder),
            "far_side": elsewhere and request.graph.depths > 1,
        })  # fmt: skip
        pictures = [{name: np.load(folder / file) for name, file in files.items()} for files in found["files"]]
        others = {name: np.load(folder / file) for name, file in found["elsewhere"].items()}
        return Evaluated(pictures, np.load(folder / found["positions"]), np.array(found["camera"]), others)

    return evaluate


def bent_twice(tree: Any, node: Any) -> None:
    """A Bump at Normal, and beside it what no value reaches: a displacement by bump and a Coat Normal."""
    bump("Normal")(tree, node)
    waves, displaced, bumped = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexWave", "Displacement", "NormalMap")
    )
    waves.inputs["Scale"].default_value = 1.0
    displaced.inputs["Scale"].default_value = 0.2
    tree.links.new(waves.outputs[1], displaced.inputs["Height"])
    tree.links.new(displaced.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    tree.links.new(bumped.outputs[0], node.inputs["Coat Normal"])


def masked(tree: Any, node: Any) -> None:
    """A Diffuse BSDF over it by noise, with a ramp of the same noise as colour, and a Glossy BSDF by a number."""
    noise_ramp(tree, node)
    (color,) = (link.from_socket for link in node.inputs["Base Color"].links)
    tree.links.remove(node.inputs["Base Color"].links[0])
    mask = tree.nodes.new("ShaderNodeValToRGB")
    tree.links.new(next(n for n in tree.nodes if n.type == "TEX_NOISE").outputs[0], mask.inputs[0])
    mask.color_ramp.elements[0].position, mask.color_ramp.elements[1].position = 0.3, 0.4
    diffuse, glossy = (tree.nodes.new(f"ShaderNodeBsdf{kind}") for kind in ("Diffuse", "Anisotropic"))
    glossy.inputs["Roughness"].default_value = 0.4
    tree.links.new(color, diffuse.inputs["Color"])
    inner, outer = (tree.nodes.new("ShaderNodeMixShader") for _ in range(2))
    inner.inputs[0].default_value = 0.3
    surface = tree.get_output_node("CYCLES").inputs["Surface"]
    for mix, sides in ((inner, (node, glossy)), (outer, (inner, diffuse))):
        for number, side in enumerate(sides, 1):
            tree.links.new(side.outputs[0], mix.inputs[number])
    tree.links.new(mask.outputs[0], outer.inputs[0])
    tree.links.new(outer.outputs[0], surface)


def renderer_of_values(export: Any, render_cycles: Any, target: Any, folder: Path, parameters: list[str]) -> Any:
    """The renderer of an exported job whose nodes are evaluated for any values inside them: all `parameters` but the
    first."""
    from mfo_backend.render.models.graph_pictures import GraphPictures
    from mfo_backend.render.pictures.renderer import load_renderer
    from mfo_backend.scene.image_file import write_exr

    write_exr(folder / "reference.exr", render_cycles())
    report = export(target, reference=folder / "reference.exr", fit={"parameters": parameters})
    job = JobFolder.open(report.folder)
    request = read_request(job)
    assert request.graph is not None
    assert {value.name for value in request.graph.values} == set(parameters[1:])
    assert (report.folder / "graph" / "scene.blend").is_file()
    linked = request.materials["target_bsdf"].graph_names
    return load_renderer(
        job.root / request.scene, request.target.shape_id, model="blender_principled",
        parameters=request.fit.parameters, materials=request_materials(job, request),
        light_paths=request.light_paths,
        graph=GraphPictures(request.graph.values, evaluator(request, folder), linked),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("build", "values", "change"),
    [
        (noise_ramp, {"Roughness": 0.4}, {"Color Ramp/Stop 0": (0.1, 0.6, 0.3), "Color Ramp/Position 1": 0.7}),
        (bump("Normal"), {"Base_Color": (0.4, 0.3, 0.2), "Roughness": 0.4}, {"Bump/Strength": 0.4}),
        (bump("Coat Normal"), {"Coat_Weight": 1.0, "Coat_Roughness": 0.3}, {"Bump/Strength": 0.5}),
        (bent_twice, {"Roughness": 0.4, "Coat_Weight": 0.5, "Coat_Roughness": 0.3}, {"Bump/Strength": 0.4}),
        (
            masked,
            {"Base_Color": (0.1, 0.3, 0.7), "Roughness": 0.4},
            {"Color Ramp.001/Stop 0": 0.3, "Color Ramp/Stop 0": (0.1, 0.6, 0.3), "Color Ramp/Position 1": 0.7},
        ),
    ],
    ids=["ramp", "bump", "coat", "several directions", "mix"],
)
def test_the_recorded_picture_at_other_values_is_cycles(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, tmp_path: Path, build: Any, values: Any, change: Any
) -> None:
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.graph_values.place import write
    from blender_addon.graph_values.table import graph_values
    from blender_addon.versions import has_diffuse_roughness
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    if build is masked and not has_diffuse_roughness():
        pytest.skip("a Diffuse BSDF of Blender 4.2 has no roughness to fit beside")
    lit_scene(scene)
    material = new_material("Target", **values)
    build(material.node_tree, principled(material))
    target = ball(material)
    renderer = renderer_of_values(export, render_cycles, target, tmp_path, ["roughness", *change])
    recorded = RecordedScene(renderer, int(renderer.target_mask().sum()))
    there = renderer.table.pack({**renderer.table.unpack(renderer.start), **change})
    paths = recorded.record(there, grid=4, seed=0, near=True)
    groups = paths.pixel_groups(paths.interior)
    found = recorded.evaluator(paths, groups)(there)
    tree = material.node_tree
    shader = target_shader(material)
    assert shader is not None
    for value in graph_values(shader):
        if value.name in change:
            write(tree, value.place, change[value.name])
    truth = render_cycles().reshape(-1, 3)[groups.pixels]
    assert abs(found[:, :, 0].mean() / truth.mean() - 1.0) < 0.004
    assert np.sqrt(np.mean((found[:, :, 0] - truth) ** 2)) / truth.mean() < 0.025
    # what is path traced shows the same
    traced = renderer.image(there, seed=0, spp=64).reshape(-1, 3)[groups.pixels]
    assert abs(traced.mean() / truth.mean() - 1.0) < 0.01
    coarser = recorded.evaluator(paths, groups, coarser=True)
    plain = {name: halved(flat) for name, flat in renderer.graph.state(there[1:]).pictures.items()}
    images_of = recorded.images_of(paths, groups, there)
    halved_image = images_of(plain)
    # whatever their order: kernels read them one behind the other
    assert np.array_equal(halved_image, images_of(dict(reversed(plain.items()))))
    np.testing.assert_allclose(coarser(there)[:, :, 0], halved_image, rtol=1e-4, atol=1e-5)
    change_of = coarser(there)[:, :, 0] - found[:, :, 0]
    assert 1e-4 < np.sqrt(np.mean(change_of**2)) / truth.mean() < 0.1
    step = 0.02
    for k in range(1, len(there)):
        moved = there + step * (np.arange(len(there)) == k)
        renderer.graph.settle(moved[1:])
        change_of = (recorded.evaluator(paths, groups)(moved)[:, :, 0] - found[:, :, 0]) / step
        slope = found[:, :, 1 + k]
        # the difference is taken over a few per cent of the range, where normals turn
        assert np.corrcoef(change_of.ravel(), slope.ravel())[0, 1] > 0.98, renderer.table.names
        assert abs((change_of * slope).sum() / (slope**2).sum() - 1.0) < 0.06


def test_a_mirror_shows_the_far_side_at_other_values(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, tmp_path: Path
) -> None:
    """A ball that is light above and dark below: with the average of what the camera sees 20 % too bright."""
    lit_scene(scene)
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.camera.data.lens, scene.cycles.max_bounces = 20.0, 2
    scene.cycles.diffuse_bounces = scene.cycles.glossy_bounces = 2
    world_color(scene, 1.0)
    mirror = add_quad("Mirror", 2.6, 0.0, new_material("Mirror", Metallic=1.0, Roughness=0.1))
    mirror.location, mirror.rotation_euler = (2.2, 0.0, 0.0), (0.0, -np.pi / 4, 0.0)
    material = new_material("Target")
    tree = material.node_tree
    split, ramp = tree.nodes.new("ShaderNodeSeparateXYZ"), tree.nodes.new("ShaderNodeValToRGB")
    tree.links.new(coordinates(tree), split.inputs[0])
    tree.links.new(split.outputs["Z"], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], principled(material).inputs["Base Color"])
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.3, 0.4
    target, change = ball(material), {"Color Ramp/Stop 0": (0.9, 0.2, 0.1)}
    renderer = renderer_of_values(export, render_cycles, target, tmp_path, ["roughness", *change])
    there = renderer.table.pack({**renderer.table.unpack(renderer.start), **change})
    image = slice(12, 20), slice(20, 27)  # of the ball in the mirror
    for vector, color in ((renderer.start, (0.0, 0.0, 0.0)), (there, change["Color Ramp/Stop 0"])):
        ramp.color_ramp.elements[0].color = (*color, 1.0)
        found, truth = renderer.image(vector, seed=0, spp=64)[image], render_cycles()[image]
        assert np.abs(found.mean(axis=(0, 1)) / truth.mean(axis=(0, 1)) - 1.0).max() < 0.05


def halved(flat: np.ndarray) -> np.ndarray:
    """Means of two by two subpixels of a picture of 4 x 4 subpixels a pixel, square but for its last row."""
    side = int(np.sqrt(len(flat) - 1))
    blocks = flat[:-1].reshape(side // 2, 2, side // 2, 2, -1)
    means = blocks.mean(axis=(1, 3)).repeat(2, axis=0).repeat(2, axis=1)
    return np.concatenate([means.reshape(flat[:-1].shape), flat[-1:]])


def test_a_value_reaches_only_sockets_that_the_fit_knows() -> None:
    """A number linked to every input of a Principled BSDF: one that also fed what no model has ended a fit."""
    from blender_addon.export.nodes.target_shader import DIRECTIONS, target_shader
    from blender_addon.graph_values.table import LETS_THROUGH, graph_values
    from mfo_backend.render.models.graph_pictures import name_of

    material = new_material("Every")
    tree, node = material.node_tree, principled(material)
    number = tree.nodes.new("ShaderNodeMath")
    for socket in node.inputs:
        if socket.type != "SHADER" and socket.name not in LETS_THROUGH:
            tree.links.new(number.outputs[0], socket)
    target = target_shader(material)
    assert target is not None
    reached = {name for value in graph_values(target) for name in value.sockets}
    assert {"Base Color", "Roughness", "Coat Weight", "Subsurface Scale", "Emission Color"} <= reached
    assert "Thin Wall" not in reached
    names = {name_of(name) for name in reached - set(DIRECTIONS)}
    assert len(names) == len(reached - set(DIRECTIONS))


@pytest.mark.parametrize(
    ("also", "strength", "offered"),
    [
        ("Alpha", 0.0, False),
        ("Transmission Weight", 0.0, False),
        ("Emission Color", 1.0, True),
        ("Emission Color", 0.0, True),
        ("Emission Strength", 0.0, True),
    ],
)
def test_a_value_that_changes_holes_as_well_is_not_offered(also: str, strength: float, offered: bool) -> None:
    """The fit holds these: it would find a value for the colour alone, and writing it would change them."""
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.graph_values.table import graph_values

    material = new_material("Both")
    tree, node = material.node_tree, principled(material)
    number = tree.nodes.new("ShaderNodeMath")
    node.inputs["Emission Strength"].default_value = strength
    for name in ("Roughness", also):
        tree.links.new(number.outputs[0], node.inputs[name])
    target = target_shader(material)
    assert target is not None
    assert bool(graph_values(target)) is offered


def test_a_factor_of_a_glow_is_one_of_all_and_may_be_five_times_as_large() -> None:
    """Of a mask times a number, as glows are often made; of Roughness that is a picture with a factor, and stays."""
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.graph_values.mix_values import default_values

    found = {}
    for name in ("Emission Strength", "Roughness"):
        material = new_material(name)
        tree, node = material.node_tree, principled(material)
        mask, times = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeMath")
        times.operation, times.inputs[1].default_value = "MULTIPLY", 0.8
        tree.links.new(mask.outputs[0], times.inputs[0])
        tree.links.new(times.outputs[0], node.inputs[name])
        target = target_shader(material)
        assert target is not None
        values = default_values(target, all_leaves=False)
        found[name] = {value.name: (value.range.lower, value.range.upper) for value in values}
    assert found == {"Emission Strength": {"Math/Value 2": (0.0, pytest.approx(4.0))}, "Roughness": {}}


def test_a_value_that_reaches_nothing_a_model_has_is_not_offered() -> None:
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.graph_values.table import graph_values

    material = new_material("Cut out")
    tree, node = material.node_tree, principled(material)
    tree.links.new(tree.nodes.new("ShaderNodeMath").outputs[0], node.inputs["Alpha"])
    target = target_shader(material)
    assert target is not None
    assert graph_values(target) == []


def test_the_copy_that_is_evaluated_finds_its_pictures(scene: Any, export: Any, tmp_path: Path) -> None:
    """Blender writes paths as seen from the file: one that was moved afterwards showed magenta for every picture."""
    lit_scene(scene)
    material = new_material("Target")
    tree, shader = material.node_tree, principled(material)
    image = bpy.data.images.new("Leather", 4, 4)
    image.filepath_raw, image.file_format = str(tmp_path / "textures" / "leather.png"), "PNG"
    image.save()
    texture, hue = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeHueSaturation")
    texture.image = image
    tree.links.new(texture.outputs[0], hue.inputs["Color"])
    tree.links.new(hue.outputs[0], shader.inputs["Base Color"])
    target = ball(material)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    image.filepath = "//textures/leather.png"
    report = export(target, fit={"parameters": ["roughness", "Hue Saturation Value/Value"]})
    copy = report.folder / "graph" / "scene.blend"
    bpy.ops.wm.open_mainfile(filepath=str(copy))
    path = bpy.data.images["Leather"].filepath
    assert path.startswith("//")
    assert Path(bpy.path.abspath(path)).resolve() == (tmp_path / "textures" / "leather.png").resolve()
