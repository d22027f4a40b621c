# SPDX-License-Identifier: Apache-2.0
"""A .blend whose material mixes two shaders: the factor, a value of one and one inside the nodes before the other are
found and written to their nodes."""

from __future__ import annotations

from pathlib import Path

import pytest

from .conftest import run_bpy, run_mfo

BUILD = """
from studies.graphs.measure import build_scene
target, _ = build_scene("factor", "lamp", 48)
tree = target.active_material.node_tree
nodes, paint = tree.nodes, tree.nodes.new("ShaderNodeRGB")
paint.name = "Paint"
color = paint.outputs[0]
tree.links.new(color, nodes["Diffuse BSDF"].inputs["Color"])
values = nodes["Mix Shader"].inputs[0], color, nodes["Glossy BSDF"].inputs["Roughness"]
for socket, value in zip(values, (0.3, (0.6, 0.2, 0.1, 1.0), 0.35)):
    socket.default_value = value
scene = bpy.context.scene
scene.cycles.samples = 64
settings = scene.render.image_settings
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = argv[1]
bpy.ops.render.render(write_still=True)
for socket, value in zip(values, (0.6, (0.4, 0.4, 0.4, 1.0), 0.6)):
    socket.default_value = value
bpy.ops.wm.save_as_mainfile(filepath=argv[0])
"""
SHOW = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
nodes = bpy.data.objects["Suzanne"].active_material.node_tree.nodes
values = nodes["Mix Shader"].inputs[0], nodes["Paint"].outputs[0], nodes["Glossy BSDF"].inputs["Roughness"]
found = values[0].default_value, list(values[1].default_value)[:3], values[2].default_value
"""


def test_two_shaders_and_their_factor_are_found_and_applied(tmp_path: Path) -> None:
    start, picture, saved = tmp_path / "start.blend", tmp_path / "reference.exr", tmp_path / "saved.blend"
    run_bpy(BUILD, start, picture)
    names = "Mix Shader/Factor, Paint/Color, glossy bsdf/roughness"
    done = run_mfo(
        "blend", start, "--object", "Suzanne", "--reference", picture, "--parameters", names, "--preset", "fast",
        "--out", tmp_path / "job", "--apply", "--save-as", saved, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    assert set(done.answer["certainty"]) == set(done.answer["recovered"])
    assert {entry["level"] for entry in done.answer["certainty"].values()} == {"determined"}
    factor, color, roughness = run_bpy(SHOW, saved)
    assert factor == pytest.approx(0.3, abs=0.02)
    assert color == pytest.approx([0.6, 0.2, 0.1], abs=0.02)
    assert roughness == pytest.approx(0.35, abs=0.02)
