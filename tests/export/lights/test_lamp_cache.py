# SPDX-License-Identifier: Apache-2.0
"""What Cycles measures of lamps with nodes is kept by what it hangs on, and measured anew where that has changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.bake.bake_key import lamp_key

from ..scene.test_bake_cache import image


@pytest.fixture
def lamp(scene: Any, tmp_path: Path) -> Any:
    """A spot with IES data in a text and a picture by UV."""
    item = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "SPOT"))
    scene.collection.objects.link(item)
    if item.data.node_tree is None:
        item.data.use_nodes = True
    tree = item.data.node_tree
    ies, texture = tree.nodes.new("ShaderNodeTexIES"), tree.nodes.new("ShaderNodeTexImage")
    ies.ies, texture.image = bpy.data.texts.new("Lamp.ies"), image(tmp_path)
    ies.ies.write("IESNA:LM-63-1995")
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    tree.links.new(ies.outputs[0], emission.inputs["Strength"])
    tree.links.new(texture.outputs[0], emission.inputs["Color"])
    return item


LAMP_ASKED = {"by": "direction", "falls": False, "placed": False, "fine": True, "deep": False, "rim": 20.0, "halves": 1}


def key_of_lamp(item: Any, **asked: Any) -> str | None:
    bpy.context.view_layer.update()
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.object.original == item:
            return lamp_key(bpy.context.scene, instance, LAMP_ASKED | asked)
    raise AssertionError


def lamp_node(item: Any, kind: str) -> Any:
    return next(node for node in item.data.node_tree.nodes if node.type == kind)


def data_in_a_file(item: Any) -> None:
    node, path = lamp_node(item, "TEX_IES"), Path(lamp_node(item, "TEX_IMAGE").image.filepath_raw).with_suffix(".ies")
    path.write_text("IESNA:LM-63-2002")
    node.mode, node.filepath = "EXTERNAL", str(path)
    before = key_of_lamp(item)
    path.write_text("IESNA:LM-63-1995")
    assert key_of_lamp(item) not in (before, None)


LAMP_CHANGES: dict[str, Callable[[Any], Any]] = {
    "its data": lambda i: lamp_node(i, "TEX_IES").ies.write("[TEST]"),
    "its data in a file": data_in_a_file,
    "a picture": lambda i: lamp_node(i, "TEX_IMAGE").image.pixels.__setitem__(1, 0.25),
    "a number": lambda i: setattr(lamp_node(i, "TEX_IES").inputs["Strength"], "default_value", 2.0),
    "its cone": lambda i: setattr(i.data, "spot_size", 0.3),
    "its radius": lambda i: setattr(i.data, "shadow_soft_size", 0.3),
    "a turn": lambda i: setattr(i, "rotation_euler", (0.1, 0.0, 0.0)),
}


@pytest.mark.parametrize("change", LAMP_CHANGES)
def test_each_change_of_a_lamp_is_another_key(lamp: Any, change: str) -> None:
    before = key_of_lamp(lamp)
    assert before is not None
    LAMP_CHANGES[change](lamp)
    assert key_of_lamp(lamp) not in (before, None)


def test_where_a_lamp_is_counts_where_its_nodes_ask_for_it(lamp: Any) -> None:
    here, placed = key_of_lamp(lamp), key_of_lamp(lamp, placed=True)
    assert key_of_lamp(lamp, rim=30.0) != here
    lamp.location.x += 1.0
    lamp.data.energy, lamp.data.color, lamp.data.name = 5.0, (1.0, 0.0, 0.0), "Other"
    bpy.context.scene.frame_set(7)
    assert key_of_lamp(lamp) == here
    assert key_of_lamp(lamp, placed=True) not in (placed, None)


LAMPS_UNSURE: dict[str, Callable[[Any], Any]] = {
    "animation of its nodes": lambda i: lamp_node(i, "TEX_IES").inputs["Strength"].keyframe_insert("default_value"),
    "animation of the lamp": lambda i: i.data.keyframe_insert("spot_size"),
    "another object": lambda i: setattr(
        i.data.node_tree.nodes.new("ShaderNodeTexCoord"), "object", bpy.data.objects.new("Empty", None)
    ),
    "a property": lambda i: setattr(i.data.node_tree.nodes.new("ShaderNodeAttribute"), "attribute_type", "OBJECT"),
    "object info": lambda i: i.data.node_tree.nodes.new("ShaderNodeObjectInfo"),
}


@pytest.mark.parametrize("case", LAMPS_UNSURE)
def test_a_lamp_that_cannot_be_told_has_no_key(lamp: Any, case: str) -> None:
    LAMPS_UNSURE[case](lamp)
    assert key_of_lamp(lamp) is None


def test_a_lamp_is_measured_once(lamp: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second request has the first one's table; one whose file is damaged is measured anew."""
    from blender_addon.bake import requests

    made: list[float] = []

    def table(_scene: Any, _instance: Any, _asked: Any, folder: Path) -> dict[str, Any]:
        made.append(1.0)
        np.save(folder / "pattern.npy", np.full((100, 3), len(made), np.float32))
        return {"pattern": "pattern.npy"}

    monkeypatch.setattr(requests, "lamp_table", table)
    scene = bpy.context.scene
    words = {"scene": scene.name, "view_layer": scene.view_layers[0].name, "cache": str(tmp_path / "cache")}
    instance = {"object": "Lamp", "parent": "", "path": None}
    for each in bpy.context.evaluated_depsgraph_get().object_instances:
        if each.object.original == lamp:
            instance = requests.name_of(each)

    def asked(number: int) -> float:
        place = tmp_path / f"place_{number}"
        place.mkdir()
        answer = requests.lamp(words | {"instance": instance, "asked": LAMP_ASKED, "folder": str(place)})
        return float(np.load(place / answer["pattern"])[0, 0])

    assert [asked(1), asked(2), len(made)] == [1.0, 1.0, 1]
    (kept,) = (tmp_path / "cache").glob("*/pattern.npy")
    kept.write_bytes(kept.read_bytes()[:-4] + b"1234")
    assert [asked(3), asked(4), len(made)] == [2.0, 2.0, 2]
