# SPDX-License-Identifier: Apache-2.0
"""Pictures that are tinted by nodes which an apply puts beside them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from .test_graph_values import JOB, PATHS, values_of


def test_a_picture_is_tinted_by_a_node_that_apply_puts_there(graph: SimpleNamespace, tmp_path: Path) -> None:
    from blender_addon.graph_values.place import read
    from blender_addon.probe.value_pictures import answer
    from blender_addon.result.write_back import apply_values, revert_values, toggle_values

    bpy = graph.bpy
    scene, tree = bpy.context.scene, graph.material.node_tree
    image = bpy.data.images.new("Picture", 4, 4)
    image.generated_color = (0.5, 0.25, 0.125, 1.0)
    image.colorspace_settings.name = "Non-Color"
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    for name in ("Base Color", "Roughness"):
        tree.links.new(texture.outputs["Color"], graph.shader.inputs[name])
    values = values_of(graph.material)
    names = ("Base Color/Gain", "Base Color/Offset", "Roughness/Gain")
    assert [(values[n].place.size, values[n].range.lower, values[n].range.upper) for n in names] == [
        (3, 0.0, 4.0), (3, -0.5, 0.5), (1, 0.0, 4.0)
    ]  # fmt: skip
    assert [read(tree, values[n].place) for n in names] == [(1.0, 1.0, 1.0), (0.0, 0.0, 0.0), 1.0]
    before = len(tree.nodes)
    variants = [{"values": [(2.0, 1.0, 1.0), (0.0, 0.25, 0.0), 0.5], "sockets": ["Base Color", "Roughness"]}]
    found = answer({
        "scene": scene.name, "layer": bpy.context.view_layer.name, "object": "Väse", "slot": 0,
        "sockets": PATHS, "places": [values[n].place.request() for n in names], "variants": variants,
        "scale": 1, "samples": 1, "folder": str(tmp_path),
    })  # fmt: skip
    seen = np.isfinite(np.load(tmp_path / found["positions"])).all(axis=2)
    color, rough = (np.load(tmp_path / found["files"][0][name])[seen] for name in ("Base Color", "Roughness"))
    np.testing.assert_allclose(color, np.broadcast_to((1.0, 0.5, 0.125), color.shape), atol=5e-3)
    grey = 0.2126 * 0.5 + 0.7152 * 0.25 + 0.0722 * 0.125
    np.testing.assert_allclose(rough, 0.5 * grey, atol=2e-3)
    assert len(tree.nodes) == before  # a look has put nothing there
    assert apply_values(graph.material, {names[0]: (2.0, 1.0, 0.5), names[2]: 0.5}, JOB) == []
    assert len(tree.nodes) == before + 2
    tint = graph.shader.inputs["Base Color"].links[0].from_node
    assert (tint.label, tuple(tint.inputs[1].default_value)) == ("Tint Base Color", (2.0, 1.0, 0.5))
    assert tint.inputs[0].links[0].from_node == texture
    assert {name for name in values_of(graph.material) if name.startswith(("Base Color", "Tint"))} == {*names[:2]}
    toggle_values(graph.material)
    assert tuple(tint.inputs[1].default_value) == (1.0, 1.0, 1.0)
    toggle_values(graph.material)
    assert revert_values(graph.material) == []
    assert tuple(tint.inputs[1].default_value) == (1.0, 1.0, 1.0)
