# SPDX-License-Identifier: Apache-2.0
"""Several materials in one export: what is written for each, what the camera sees, and what is refused."""

from __future__ import annotations

import json
import re
from typing import Any
from xml.etree import ElementTree

import bpy
import pytest

from blender_addon.export.findings import ExportError
from blender_addon.export.fitted_slot import FittedSlot
from blender_addon.export.job import LEFT_OUT
from blender_addon.export.reference.picture_setup import PictureSetup
from blender_addon.export.scene.seen_slots import seen_slots
from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.request import read_request
from tests.export.scenes import add_camera, add_light, add_quad, new_material


@pytest.fixture
def room(scene: Any) -> dict[str, Any]:
    """A floor whose second slot has one of its two faces, a table on it, and something behind the camera."""
    add_camera(ortho_scale=4.0)
    add_light("POINT", energy=100.0)
    floor = add_quad("Floor", 4.0, 0.0, new_material("Wood", Roughness=0.3))
    floor.data.clear_geometry()
    corners = [(x, y, 0.0) for y in (-2.0, 2.0) for x in (-2.0, 0.0, 2.0)]
    floor.data.from_pydata(corners, [], [(0, 1, 4, 3), (1, 2, 5, 4)])
    floor.data.materials.append(new_material("Rug", Roughness=0.9))
    floor.data.polygons[1].material_index = 1
    table = add_quad("Table", 1.0, 0.5, new_material("Glass", Metallic=1.0))
    away = add_quad("Away", 1.0, 9.0, new_material("Unseen"))
    bpy.context.view_layer.update()
    return {"Floor": floor, "Table": table, "Away": away}


def test_each_material_has_a_shape_and_a_request_of_its_own(room: dict[str, Any], export: Any) -> None:
    slots = [FittedSlot(room["Floor"], 1), FittedSlot(room["Table"], 0), FittedSlot(room["Floor"], 0)]
    report = export(room["Floor"], targets=slots, fit={"parameters": ["roughness"]})
    request = report.request
    assert request["targets"] == ["targets/1", "targets/2", "targets/3"]
    assert request["target"]["material"] == "Rug"
    inner = [json.loads((report.folder / path / "request.json").read_text("utf-8")) for path in request["targets"]]
    said = [(one["target"]["shape_id"], one["target"]["material"], one["target"]["slot"]) for one in inner]
    assert said == [("target", "Rug", 1), ("target_2", "Glass", 0), ("target_3", "Wood", 0)]
    assert "targets" not in inner[0]
    text = (report.folder / "scene.xml").read_text("utf-8")
    used = {
        shape.get("id"): shape.find("ref").get("id")  # type: ignore[union-attr]
        for shape in ElementTree.fromstring(text).iter("shape")
    }
    assert [used[name] for name in ("target", "target_2", "target_3")] == [one["target"]["bsdf_id"] for one in inner]
    for path in request["targets"]:
        assert (report.folder / path / "scene.xml").read_text("utf-8") == text
        assert (report.folder / path / "meshes" / "target_2.ply").samefile(report.folder / "meshes" / "target_2.ply")
    roughness = [one["materials"][one["target"]["bsdf_id"]]["sockets"]["Roughness"]["value"] for one in inner]
    assert roughness == pytest.approx([0.9, 0.5, 0.3])


def test_the_camera_sees_these_materials(room: dict[str, Any]) -> None:
    found = [(each.object.name, each.slot) for each in seen_slots(bpy.context)]
    assert sorted(found[:2]) == [("Floor", 0), ("Floor", 1)]
    assert found[2:] == [("Table", 0)]
    room["Table"].hide_render = True
    bpy.context.view_layer.update()
    assert "Table" not in [each.object.name for each in seen_slots(bpy.context)]


def test_what_is_wrong_is_said_before_anything_is_written(room: dict[str, Any], export: Any, tmp_path: Any) -> None:
    floor, table = FittedSlot(room["Floor"], 0), FittedSlot(room["Table"], 0)
    room["Away"].data.materials[0] = bpy.data.materials["Glass"]
    twin = FittedSlot(room["Away"], 0)
    for slots, sentence in (
        ([floor, table, floor], "Slot 1 of 'Floor' (material 'Wood') is named twice: name it once."),
        ([table, floor, twin], "Material 'Glass' is named twice, in slot 1 of 'Table' and in slot 1 of 'Away'"),
        ([floor, FittedSlot(room["Floor"], 5)], "Slot 6 of 'Floor' has no material"),
    ):
        with pytest.raises(ExportError, match=re.escape(sentence)):
            export(room["Floor"], targets=slots)
    room["Away"].data.materials[0] = new_material("Unseen 2")
    with pytest.raises(ExportError, match="The camera does not see 'Away'"):
        export(room["Floor"], targets=[floor, twin])
    assert not (tmp_path / "job").exists()


def test_each_picture_has_all_materials(room: dict[str, Any], export: Any) -> None:
    for number, level in ((1, 0.5), (2, 0.4)):
        image = bpy.data.images.new(str(number), 32, 32, float_buffer=True)
        image.pixels[:] = [level, level, level, 1.0] * 32**2
    side = add_camera(ortho_scale=3.0)
    side.name = "Side"
    pictures = [PictureSetup(bpy.data.images["1"], 1), PictureSetup(bpy.data.images["2"], 2, camera="Side")]
    slots = [FittedSlot(room["Floor"], 0), FittedSlot(room["Table"], 0)]
    report = export(room["Floor"], targets=slots, reference=pictures)
    assert (report.request["more_pictures"], report.request["targets"]) == (
        ["more_pictures/2"],
        ["targets/1", "targets/2"],
    )
    request = read_request(JobFolder.open(report.folder))
    ((path, more),) = request.more_pictures
    assert [each.target for _, each in more.targets] == [each.target for _, each in request.targets]
    assert more.picture.camera == "Side"
    mesh = report.folder / "meshes" / "target_2.ply"
    assert mesh.samefile(report.folder / path / "targets" / "2" / "meshes" / "target_2.ply")


@pytest.fixture
def apart(room: dict[str, Any]) -> dict[str, Any]:
    """The floor's two materials, each before a camera of its own: a mix by noise, and one whose glow is by noise."""
    for name, x in (("Left", -1.0), ("Right", 1.0)):
        camera = add_camera(ortho_scale=1.2)
        camera.name, camera.location.x = name, x
        image = bpy.data.images.new(name, 32, 32, float_buffer=True)
        image.pixels[:] = [0.5, 0.4 + 0.1 * x, 0.3, 1.0] * 32**2
    bpy.data.objects.remove(room["Table"])
    mix, glow = (bpy.data.materials[name].node_tree for name in ("Wood", "Rug"))
    shader, output = (next(n for n in mix.nodes if n.type == t) for t in ("BSDF_PRINCIPLED", "OUTPUT_MATERIAL"))
    noise, mixer, cover = (mix.nodes.new(f"ShaderNode{kind}") for kind in ("TexNoise", "MixShader", "BsdfDiffuse"))
    noise.inputs["Scale"].default_value = 8.0
    above = mix.nodes.new("ShaderNodeMath")  # the Diffuse BSDF covers most: which only a picture of it can say
    above.operation, above.inputs[1].default_value = "MULTIPLY_ADD", 0.2
    above.inputs[2].default_value = 0.75
    mix.links.new(noise.outputs[0], above.inputs[0])
    mix.links.new(above.outputs[0], mixer.inputs[0])
    mix.links.new(shader.outputs[0], mixer.inputs[1])
    mix.links.new(cover.outputs[0], mixer.inputs[2])
    mix.links.new(mixer.outputs[0], output.inputs["Surface"])
    lit = next(n for n in glow.nodes if n.type == "BSDF_PRINCIPLED")
    spots = glow.nodes.new("ShaderNodeTexNoise")
    lit.inputs["Emission Strength"].default_value = 0.0
    glow.links.new(spots.outputs[0], lit.inputs["Emission Strength"])
    bpy.context.view_layer.update()
    return room


def pictures_from(*cameras: str) -> list[PictureSetup]:
    return [PictureSetup(bpy.data.images[name], number, camera=name) for number, name in enumerate(cameras, 1)]


def test_a_picture_without_a_material_of_nodes_leaves_them_to_the_picture_that_shows_it(
    apart: dict[str, Any], export: Any
) -> None:
    slots = [FittedSlot(apart["Floor"], 0), FittedSlot(apart["Floor"], 1)]
    report = export(apart["Floor"], targets=slots, reference=pictures_from("Right", "Left"))
    inner = {
        (picture, target): json.loads((report.folder / path / f"targets/{target}/request.json").read_text("utf-8"))
        for picture, path in (("Right", "."), ("Left", "more_pictures/2"))
        for target in (1, 2)
    }
    assert {key for key, request in inner.items() if "graph" in request} == {("Left", 1), ("Right", 2)}
    # the first picture does not show the mix, and has its leaves in the order of the one that does
    assert [inner[picture, 1]["target"]["node"] for picture in ("Right", "Left")] == [["Diffuse BSDF"]] * 2
    seen = inner["Left", 1]["materials"]["target_bsdf"]
    assert seen["weight"]["value"] == pytest.approx(0.85, abs=0.05)
    assert not (report.folder / "targets" / "1" / "graph").exists()
    # a glow that nodes give is an emitter where the picture does not show it, too
    for path in (".", "more_pictures/2"):
        root = ElementTree.parse(report.folder / path / "scene.xml").getroot()
        shape = next(s for s in root.iter("shape") if s.get("id") == "target_2")
        assert shape.find("emitter") is not None
    read_request(JobFolder.open(report.folder))


def test_a_material_in_none_of_the_pictures_is_refused_by_name(apart: dict[str, Any], export: Any) -> None:
    slots = [FittedSlot(apart["Floor"], 0), FittedSlot(apart["Floor"], 1), FittedSlot(apart["Away"], 0)]
    said = "Material 'Unseen' of 'Away' is in none of the pictures: leave it out, or add a picture that shows it."
    with pytest.raises(ExportError, match=re.escape(said)):
        export(apart["Floor"], targets=slots, reference=pictures_from("Right", "Left"))
    said = "Material 'Wood' of 'Floor' is in none of the pictures"
    with pytest.raises(ExportError, match=re.escape(said)):
        export(apart["Floor"], targets=slots[:2], reference=pictures_from("Right", "Right"))
    said = "Material 'Unseen' of 'Away' is in none of the pictures"
    with pytest.raises(ExportError, match=re.escape(said)):  # and the second picture shows none of the two
        export(apart["Floor"], targets=slots[1:], reference=pictures_from("Right", "Left"))


def test_a_picture_that_shows_none_of_the_materials_is_left_out(apart: dict[str, Any], export: Any) -> None:
    slots = [FittedSlot(apart["Floor"], 1)]
    report = export(apart["Floor"], targets=slots, reference=pictures_from("Right", "Left"))
    why = "Picture 2 (Left): The camera does not see 'Floor'"
    assert [note for note in report.notes if note.startswith(LEFT_OUT.format(why=why))]
    assert read_request(JobFolder.open(report.folder)).more_pictures == ()


def test_what_is_named_wrongly_is_said_of_no_picture(apart: dict[str, Any], export: Any) -> None:
    slots, pictures = [FittedSlot(apart["Floor"], 0), FittedSlot(apart["Floor"], 1)], pictures_from("Right", "Left")
    paper = {"parameters": ["Wood/Noise Texture/Scale"], "preset": "paper"}
    for name, said in (
        ("Nose/Scale", "None of the materials has a value 'Nose/Scale' (the nearest is 'Noise Texture/Scale')"),
        ("Wood/Noise Texture/Size", "The material's nodes have no value 'Noise Texture/Size'"),
    ):
        with pytest.raises(ExportError, match="^" + re.escape(said)):
            export(apart["Floor"], targets=slots, reference=pictures, fit={"parameters": [name]})
    with pytest.raises(ExportError, match=r"^Noise Texture/Scale cannot be fitted: the preset paper"):
        export(apart["Floor"], targets=slots, reference=pictures, fit=paper)
    with pytest.raises(ExportError, match=r"^Slot 1 of 'Floor' .material 'Wood'. is named twice"):
        export(apart["Floor"], targets=[*slots, slots[0]], reference=pictures)
    with pytest.raises(ExportError, match=r"^The material's nodes have no value 'Nose/Scale'"):
        export(apart["Floor"], reference=pictures, fit={"parameters": ["Nose/Scale"]})


@pytest.fixture
def patterned(room: dict[str, Any]) -> dict[str, Any]:
    """The floor's two materials, each with colours inside its nodes, and a table without."""
    for name in ("Wood", "Rug"):
        tree = bpy.data.materials[name].node_tree
        shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
        ramp, noise = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("ValToRGB", "TexNoise"))
        tree.links.new(noise.outputs[0], ramp.inputs[0])
        tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
    bpy.context.view_layer.update()
    return room


def values_by_material(folder: Any) -> dict[str, list[str]]:
    """Names of what is fitted of each material: sockets' and those inside nodes."""
    found = {}
    for path in sorted(folder.glob("targets/*/request.json")):
        request = json.loads(path.read_text("utf-8"))
        inside = [value["name"] for value in request.get("graph", {}).get("values", ())]
        parameters = request["fit"].get("parameters", "all")
        found[request["target"]["material"]] = [*([] if isinstance(parameters, str) else parameters), *inside]
    return found


def test_values_inside_the_nodes_of_each_are_asked_for(patterned: dict[str, Any], export: Any) -> None:
    """*All* takes the colours of both; a name is for all that have it, or for the one that is named before it."""
    slots = [FittedSlot(patterned["Floor"], 0), FittedSlot(patterned["Floor"], 1), FittedSlot(patterned["Table"], 0)]
    colors = ["Color Ramp/Stop 0", "Color Ramp/Stop 1"]
    image = bpy.data.images.new("Picture", 32, 32, float_buffer=True)
    image.pixels[:] = [0.5, 0.4, 0.3, 1.0] * 32**2
    report = export(patterned["Floor"], targets=slots, reference=image)
    assert values_by_material(report.folder) == {"Wood": colors, "Rug": colors, "Glass": []}
    assert "graph" not in report.request
    assert sorted(path.relative_to(report.folder).parts[0] for path in report.folder.rglob("*.blend")) == ["graph"]
    request = read_request(JobFolder.open(report.folder))
    evaluated = [each.graph.evaluate for _, each in request.targets if each.graph is not None]
    assert [(entry["object"], entry["slot"]) for entry in evaluated if entry] == [("Floor", 0), ("Floor", 1)]

    names = ["color ramp/stop 0", "Rug/Color Ramp/Position 1", "rug/noise texture/scale", "Glass/Roughness", "Metallic"]
    report = export(patterned["Floor"], targets=slots, fit={"parameters": names})
    assert values_by_material(report.folder) == {
        "Wood": ["Metallic", "Color Ramp/Stop 0"],
        "Rug": ["Metallic", "Color Ramp/Stop 0", "Color Ramp/Position 1", "Noise Texture/Scale"],
        "Glass": ["Roughness", "Metallic"],
    }


def test_one_that_lets_light_through_keeps_its_nodes_and_is_named(patterned: dict[str, Any], export: Any) -> None:
    tree = bpy.data.materials["Rug"].node_tree
    next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED").inputs["Transmission Weight"].default_value = 0.5
    slots = [FittedSlot(patterned["Floor"], number) for number in (0, 1)]
    report = export(patterned["Floor"], targets=slots)
    assert values_by_material(report.folder) == {"Wood": ["Color Ramp/Stop 0", "Color Ramp/Stop 1"], "Rug": []}
    said = (
        "Values inside nodes of material 'Rug' (Color Ramp/Stop 0, Color Ramp/Stop 1) stay as they are: a fit of them"
    )
    assert [note for note in report.notes if note.startswith(said)]
