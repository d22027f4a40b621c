# SPDX-License-Identifier: Apache-2.0
"""Cameras and lights that an export names for a further picture."""

from __future__ import annotations

import math
from typing import Any
from xml.etree import ElementTree

import bpy
import pytest

from tests.export.scenes import add_camera, add_light, add_quad, new_material


@pytest.fixture
def table(scene: Any) -> Any:
    add_camera(ortho_scale=4.0)
    for energy in (5.0, 90.0, 20.0, 1.0):
        add_light("POINT", energy=energy).name = f"Light {energy:.0f}"
    return add_quad("Table", 1.0, 0.5, new_material("Glass", Metallic=1.0))


def other_camera(name: str, **settings: Any) -> bpy.types.Object:
    camera = bpy.data.objects.new(name, bpy.data.cameras.new(name))
    for key, value in settings.items():
        setattr(camera.data, key, value)
    camera.location, camera.scale = (0.0, 0.0, 3.0), (2.0, 2.0, 2.0)
    bpy.context.collection.objects.link(camera)
    return camera


def test_perspective_cameras_are_named_with_their_place_and_angle(table: Any, export: Any) -> None:
    other_camera("Top", angle=math.radians(40.0))
    other_camera("Flat", type="ORTHO")
    other_camera("Moved", shift_x=0.1)
    bpy.context.view_layer.update()
    (found,) = export(table).request["cameras"]
    assert found["name"] == "Top"
    render = bpy.context.scene.render
    wide = math.tan(math.radians(20.0)) * min(1.0, render.resolution_x / render.resolution_y)
    assert found["fov"] == pytest.approx(math.degrees(2.0 * math.atan(wide)), rel=1e-4)
    # it looks down: Mitsuba's +Z is the view, +X to the left
    assert found["to_world"] == pytest.approx([-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 3, 0, 0, 0, 1], abs=1e-6)


def test_the_lights_that_give_most_are_named_with_their_emitters(table: Any, export: Any) -> None:
    report = export(table)
    assert [light["name"] for light in report.request["lights"]] == ["Light 90", "Light 20", "Light 5"]
    text = (report.folder / "scene.xml").read_text("utf-8")
    level = {
        each.get("id"): float(each.find("rgb").get("value").replace(",", " ").split()[0])  # type: ignore[union-attr]
        for each in ElementTree.fromstring(text).iter("emitter")
    }
    assert level[report.request["lights"][0]["emitter"]] == max(level.values())


def test_lights_that_come_by_instances_are_not_named(table: Any, export: Any) -> None:
    group = bpy.data.collections.new("Lamps")
    group.objects.link(add_light("POINT", energy=10.0))
    for _ in range(2):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", group
        bpy.context.collection.objects.link(empty)
    bpy.context.view_layer.update()
    assert export(table).request["lights"] == []
