# SPDX-License-Identifier: Apache-2.0
"""What bakes cannot hold, or Cycles cannot bake: named, and the nearest there is."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.job import ExportError

from .test_baked_surfaces import Nodes, shape_of, stage

__all__ = ["stage"]  # the fixture
PICTURES = 40


def test_a_missing_image_is_magenta_and_named(stage: Any, export: Any) -> None:
    target, _, nodes = stage
    image = bpy.data.images.new("Lost", 8, 8)
    image.source, image.filepath = "FILE", "//nowhere.png"
    picture, mixed = nodes.new("TexImage"), nodes.new("MixRGB")
    picture.image = image
    mixed.inputs["Fac"].default_value = 0.5
    mixed.inputs["Color1"].default_value = (0.0, 0.0, 0.0, 1.0)
    nodes.tree.links.new(picture.outputs[0], mixed.inputs["Color2"])
    nodes.tree.links.new(mixed.outputs[0], nodes.principled.inputs["Base Color"])
    report = export(target)
    bsdf = shape_of(report)[0]
    color = report.request["materials"][bsdf]["sockets"]["Base Color"]
    np.testing.assert_allclose(color["value"], (0.5, 0.0, 0.5), atol=1e-4)
    assert "texture" not in color  # the same everywhere
    said = (
        "Material 'Ball': the image 'Lost' of the node 'Image Texture' is missing; it is magenta, as in Cycles. If the "
        "reference shows it, find it first: File > External Data > Find Missing Files."
    )
    assert said in report.notes


def _circle(nodes: Nodes) -> None:
    first, second = nodes.new("MixShader"), nodes.new("MixShader")
    nodes.tree.links.new(first.outputs[0], second.inputs[1])
    nodes.tree.links.new(second.outputs[0], first.inputs[1])
    nodes.tree.links.new(first.outputs[0], nodes.surface)


def _group_without_output(nodes: Nodes) -> None:
    node = nodes.new("Group")
    node.node_tree = bpy.data.node_groups.new("Empty", "ShaderNodeTree")
    node.node_tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    nodes.tree.links.new(node.outputs[0], nodes.surface)


@pytest.mark.parametrize("build", [_circle, _group_without_output])
def test_broken_trees_end_in_a_material(build: Callable[[Nodes], None], stage: Any, export: Any) -> None:
    target, ball, nodes = stage
    build(nodes)
    before = sorted(node.name for node in nodes.tree.nodes)
    report = export(target)
    assert any("'Ball' is baked" in note for note in report.notes)
    assert shape_of(report)[0] == "baked_0001"
    assert sorted(node.name for node in nodes.tree.nodes) == before
    assert ball.name == "Ball"


def test_without_a_second_blender_the_nearest_model_stays(
    stage: Any, export: Any, monkeypatch: Any, tmp_path: Path
) -> None:
    from blender_addon.bake import baker
    from blender_addon.probe import client

    target, _, nodes = stage
    nodes.tree.links.new(nodes.place(), nodes.principled.inputs["Base Color"])
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    ask = baker.Baker.ask

    def killed(self: Any, *words: Any, **more: Any) -> int:
        number = ask(self, *words, **more)
        client.signal_group(self._probe.pid, signal.SIGKILL)
        return number

    monkeypatch.setattr(baker.Baker, "ask", killed)
    report = export(target)
    assert any("'Ball' of 'Ball' could not be baked by Cycles: The second Blender" in note for note in report.notes)
    assert any(note.startswith("Base Color of material 'Ball' is linked to") for note in report.notes)
    assert [path.name for path in tmp_path.iterdir()] == ["job"]


@pytest.mark.parametrize("asked", [False, True])
def test_a_surface_with_two_sides_that_rays_tell_apart_is_said(asked: bool, stage: Any, export: Any) -> None:
    """Rays of each kind have a look of it, but for the back."""
    target, _, nodes = stage
    link, geometry = nodes.tree.links.new, nodes.new("NewGeometry")
    link(geometry.outputs["Backfacing" if asked else "Pointiness"], nodes.principled.inputs["Roughness"])
    link(nodes.new("LightPath").outputs["Is Glossy Ray"], nodes.principled.inputs["Metallic"])
    said = "Material 'Ball' asks for Backfacing: in the fit both sides are as its front is."
    assert (said in export(target).notes) is asked


def test_many_pictures_that_are_read_by_colour_and_alpha(stage: Any, export: Any) -> None:
    """A bake keeps their alphas by new links, and asked the old ones, which were no more: Blender ended."""
    target, _, nodes = stage
    link, image = nodes.tree.links.new, bpy.data.images.new("Shown", 8, 8, alpha=True)
    image.generated_color = (0.2, 0.5, 0.8, 0.5)
    color = alpha = None
    for _ in range(PICTURES):
        picture, colors, alphas = nodes.new("TexImage"), nodes.new("MixRGB"), nodes.new("Math")
        picture.image, alphas.operation = image, "MAXIMUM"
        for output, mixed, last in (
            (picture.outputs["Color"], colors, color),
            (picture.outputs["Alpha"], alphas, alpha),
        ):
            link(output, mixed.inputs[-1])
            link(output if last is None else last, mixed.inputs[-2])
        color, alpha = colors.outputs[0], alphas.outputs[0]
    link(color, nodes.principled.inputs["Base Color"])
    link(alpha, nodes.principled.inputs["Metallic"])
    report = export(target)
    assert not any("could not be baked" in note for note in report.notes)
    sockets = report.request["materials"][shape_of(report)[0]]["sockets"]
    assert sockets["Metallic"]["value"] == pytest.approx(0.5, abs=0.005)


def _wrapped(tree: bpy.types.NodeTree, *, is_world: bool) -> None:
    """Put an output with a shader into a group, and leave none outside."""
    tree.nodes.clear()
    group = bpy.data.node_groups.new("Wrapped", "ShaderNodeTree")
    output = group.nodes.new("ShaderNodeOutputWorld" if is_world else "ShaderNodeOutputMaterial")
    shader = group.nodes.new("ShaderNodeBackground" if is_world else "ShaderNodeBsdfPrincipled")
    group.links.new(shader.outputs[0], output.inputs["Surface"])
    tree.nodes.new("ShaderNodeGroup").node_tree = group


@pytest.mark.parametrize("owner", ["target", "neighbour", "world"])
def test_an_output_inside_a_group_is_named(owner: str, stage: Any, export: Any, render_cycles: Any) -> None:
    """Cycles looks for it there: the neighbour was black without a word, and the target without a shader."""
    target, _, nodes = stage
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 32
    trees = {"target": target.data.materials[0].node_tree, "neighbour": nodes.tree, "world": scene.world.node_tree}
    _wrapped(trees[owner], is_world=owner == "world")
    assert render_cycles().min() > 0.02
    if owner == "target":
        with pytest.raises(ExportError, match="has its output inside the group 'Group': move it out of the group"):
            export(target)
        return
    lamp = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
    scene.collection.objects.link(lamp)  # without it an export has no light
    name = {"neighbour": "Material 'Ball'", "world": "World 'World'"}[owner]
    said = (
        f"{name} has its output inside the group 'Group', where only Cycles looks for it: it is black in the fit. Move "
        "the output out of the group."
    )
    assert said in export(target).notes
