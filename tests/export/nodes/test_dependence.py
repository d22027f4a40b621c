# SPDX-License-Identifier: Apache-2.0
"""Nodes of the target that answer other rays than the camera's in another way are named, where the picture shows it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.job import check_export  # noqa: E402

from ..materials.test_node_graphs import ball, principled  # noqa: E402
from ..scene.test_light_paths import picture_of, scene_reference  # noqa: E402
from ..scenes import add_camera, add_light, add_quad, new_material, world_color  # noqa: E402

CLEAR, PATH, SIDES = "tell its sides or rays apart", "asks Light Path for", "asks for Backfacing"


def lit_ball(scene: Any, node: str, output: str, socket: str) -> Any:
    """A ball on a floor, whose socket is linked to an output of a node."""
    world_color(scene, 0.3)
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.cycles.samples = 256
    add_camera("ORTHO", ortho_scale=3.2)
    add_light("POINT", location=(1.5, 1.0, 3.0), energy=200.0, shadow_soft_size=0.1)
    add_quad("Floor", 4.0, -1.1, new_material("Floor"))
    material = new_material("Ball", Base_Color=(0.6, 0.4, 0.3))
    asked = material.node_tree.nodes.new(f"ShaderNode{node}")
    material.node_tree.links.new(asked.outputs[output], principled(material).inputs[socket])
    return ball(material)


@pytest.mark.parametrize(
    ("node", "output", "socket", "said"),
    [
        ("Fresnel", 0, "Alpha", CLEAR),
        ("NewGeometry", "Normal", "Alpha", CLEAR),
        ("NewGeometry", "Backfacing", "Alpha", CLEAR),
        ("LightPath", "Is Shadow Ray", "Alpha", CLEAR),
        ("AmbientOcclusion", "AO", "Alpha", CLEAR),
        ("TexNoise", 0, "Alpha", ""),
        ("NewGeometry", "Position", "Alpha", ""),
        ("Fresnel", 0, "Roughness", ""),
        ("LightPath", "Ray Length", "Roughness", PATH),
        ("LightPath", "Is Camera Ray", "Roughness", ""),
        ("LightPath", "Is Shadow Ray", "Roughness", ""),
        ("NewGeometry", "Backfacing", "Roughness", SIDES),
    ],
)
def test_what_is_said(node: str, output: Any, socket: str, said: str, scene: Any) -> None:
    _, notes = check_export(bpy.context, lit_ball(scene, node, output, socket))
    found = [words for words in (CLEAR, PATH, SIDES) if any(words in note for note in notes)]
    assert found == ([said] if said else [])


@pytest.mark.parametrize(
    ("node", "output", "is_said"), [("LayerWeight", "Fresnel", True), ("TexNoise", 0, False)], ids=["side", "place"]
)
def test_a_cut_out_is_as_in_cycles_where_nothing_is_said(
    node: str, output: Any, is_said: bool, scene: Any, export: Any, render_cycles: Any
) -> None:
    target = lit_ball(scene, node, output, "Alpha")
    wanted = render_cycles()
    report = export(target, reference=scene_reference(wanted))
    middle = np.s_[8:24, 8:24]
    ratio = float(picture_of(report)[middle].mean() / wanted[middle].mean())
    assert any(CLEAR in note for note in report.notes) == is_said
    assert (abs(ratio - 1.0) > 0.05) == is_said
    if not is_said:
        assert ratio == pytest.approx(1.0, abs=0.01)
