# SPDX-License-Identifier: Apache-2.0
"""Materials: every socket in request.json, pictures on sockets, other shaders, and their brightness against Cycles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.job import check_export

from ..load_scene import load_scene
from ..scenes import add_camera, add_light, add_quad, diffuse_material, emission_material, new_material, world_color
from ..socket_walk import silent_sockets


def principled(material: Any) -> Any:
    return material.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node


def picture(name: str, value: Any, *, float_buffer: bool = False, space: str | None = None) -> Any:
    image = bpy.data.images.new(name, 4, 2, float_buffer=float_buffer, alpha=True)
    if space:
        image.colorspace_settings.name = space
    image.pixels.foreach_set(np.broadcast_to(np.array(value, np.float32), (2, 4, 4)).ravel())
    return image


def image_node(material: Any, image: Any) -> Any:
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    return node


def read_exr(path: Any) -> np.ndarray:
    OpenEXR = pytest.importorskip("OpenEXR")
    pixels = next(iter(OpenEXR.File(str(path)).channels().values())).pixels
    return pixels.reshape(*pixels.shape[:2], -1)


def test_every_socket_is_in_the_request(scene: Any, export: Any) -> None:
    world_color(scene, 1.0)
    material = new_material(
        "Glaze", Base_Color=(0.1, 0.2, 0.3), Roughness=0.25, Coat_Weight=0.5, Thin_Film_Thickness=300.0
    )
    principled(material).distribution = "GGX"
    add_camera("ORTHO", ortho_scale=2.0)
    report = export(add_quad("Target", 1.0, 0.0, material), fit={"preset": "paper", "model": "mitsuba_principled"})
    entry = report.request["materials"]["target_bsdf"]
    assert entry["name"] == "Glaze"
    assert entry["distribution"] == "GGX"
    names = {socket.name for socket in principled(material).inputs} - {"Weight"}
    assert set(entry["sockets"]) == names
    assert entry["sockets"]["Base Color"]["value"] == pytest.approx([0.1, 0.2, 0.3])
    assert entry["sockets"]["Roughness"] == {"value": 0.25, "linked": False}
    assert entry["sockets"]["Subsurface Radius"]["value"] == pytest.approx([1.0, 0.2, 0.1])
    assert report.request["fit"] == {"preset": "paper", "model": "mitsuba_principled"}
    assert any("Thin Film Thickness has no counterpart" in note for note in report.notes)
    assert report.request["notes"] == list(report.notes)


def test_what_no_model_has_is_listed(scene: Any, export: Any) -> None:
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=2.0)
    glow = {"Emission_Color": (1.0, 0.5, 0.2), "Emission_Strength": 2.0}
    add_quad("Floor", 1.0, -1.0, new_material("Glow", **glow))
    add_quad("Wall", 1.0, -2.0, new_material("Coated", Coat_Weight=0.5, **glow))
    material = new_material("Plain", Subsurface_Weight=0.3)
    target = add_quad("Target", 1.0, 0.0, material)
    for method in ("RANDOM_WALK", "RANDOM_WALK_SKIN", "BURLEY"):
        principled(material).subsurface_method = method
        assert export(target, method).notes == ()
    notes = export(target, "other", fit={"model": "mitsuba_principled"}).notes
    assert [note for note in notes if "dimmed" in note] == [
        "Material 'Coated': the emission is not dimmed by Coat Weight in a fit with the model mitsuba_principled."
    ]


def test_pictures_stay_linked(scene: Any, export: Any, mitsuba: Any) -> None:
    """sRGB bytes are decoded, Non-Color is not, float pictures are linear already; channels can be picked."""
    world_color(scene, 1.0)
    material = new_material("Target")
    tree, node = material.node_tree, principled(material)
    color = image_node(material, picture("colour", (0.5, 0.25, 1.0, 1.0)))
    tree.links.new(color.outputs["Color"], node.inputs["Base Color"])
    packed = image_node(material, picture("orm", (0.2, 0.4, 0.6, 1.0), space="Non-Color"))
    separate = tree.nodes.new("ShaderNodeSeparateColor")
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(packed.outputs["Color"], reroute.inputs[0])
    tree.links.new(reroute.outputs[0], separate.inputs[0])
    tree.links.new(separate.outputs[1], node.inputs["Roughness"])
    times = tree.nodes.new("ShaderNodeMath")
    times.operation = "MULTIPLY"
    times.inputs[1].default_value = 0.5
    tree.links.new(separate.outputs[2], times.inputs[0])
    tree.links.new(times.outputs[0], node.inputs["Metallic"])
    value = tree.nodes.new("ShaderNodeValue")
    value.outputs[0].default_value = 0.3
    tree.links.new(value.outputs[0], node.inputs["Sheen Weight"])
    add_camera("ORTHO", ortho_scale=2.0)
    report = export(add_quad("Target", 1.0, 0.0, material))
    sockets = report.request["materials"]["target_bsdf"]["sockets"]
    wanted = {
        "Base Color": [0.2140411, 0.0508761, 1.0],  # IEC 61966-2-1 of 128/255 and 64/255, which the bytes round to
        "Roughness": [0.4],
        "Metallic": [0.3],
    }
    for name, value in wanted.items():
        assert sockets[name]["linked"] is True
        pixels = read_exr(report.folder / sockets[name]["texture"])
        assert pixels.shape == (2, 4, len(value))
        np.testing.assert_allclose(pixels[0, 0], value, atol=0.003)  # 8 bits
        np.testing.assert_allclose(sockets[name]["value"], value if len(value) == 3 else value[0], atol=0.003)
    assert sockets["Sheen Weight"] == {"value": pytest.approx(0.3), "linked": True, "graph": "graph/socket_00.npy"}
    assert sockets["IOR"]["linked"] is False
    scene_read = load_scene(mitsuba, report, optimize=False)
    parameters = mitsuba.traverse(scene_read)
    for name in ("base_color", "roughness", "metallic"):
        assert f"target_bsdf.brdf_0.{name}.data" in parameters


def test_rows_of_a_picture_are_top_first(scene: Any, export: Any) -> None:
    world_color(scene, 1.0)
    material = new_material("Target")
    image = picture("rows", (0, 0, 0, 1), float_buffer=True)
    pixels = np.zeros((2, 4, 4), np.float32)
    pixels[1, 2] = (3.0, 2.0, 1.0, 1.0)  # Blender's second row is the upper one
    image.pixels.foreach_set(pixels.ravel())
    material.node_tree.links.new(
        image_node(material, image).outputs["Color"], principled(material).inputs["Base Color"]
    )
    add_camera("ORTHO", ortho_scale=2.0)
    report = export(add_quad("Target", 1.0, 0.0, material))
    path = report.request["materials"]["target_bsdf"]["sockets"]["Base Color"]["texture"]
    np.testing.assert_array_equal(read_exr(report.folder / path)[0, 2], (3.0, 2.0, 1.0))


def test_unknown_node_on_context_is_baked(scene: Any) -> None:
    world_color(scene, 1.0)
    target, other = new_material("Target"), new_material("Other", Roughness=0.7)
    floor, quad = add_quad("Floor", 3.0, -1.0, other), add_quad("Target", 1.0, 0.0, target)
    add_camera("ORTHO", ortho_scale=2.0)
    for material in (target, other):
        noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
        material.node_tree.links.new(noise.outputs[0], principled(material).inputs["Roughness"])
    errors, notes = check_export(bpy.context, quad)
    assert errors == []
    assert notes == ["Material 'Other' of 'Floor' is baked into textures by Cycles."]
    assert floor.material_slots[0].material == other


def test_other_shaders_of_the_surroundings(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    """Diffuse and emission are exact, another shader is its nearest model with a note, nothing linked is black."""
    world_color(scene, 0.5)
    materials = [diffuse_material("d", (0.2, 0.5, 0.8)), emission_material("e", (0.3, 0.2, 0.1)), new_material("black")]
    hair = diffuse_material("hair", (1, 1, 1))
    tree = hair.node_tree
    node = tree.nodes.new("ShaderNodeBsdfHair")
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    materials[2].node_tree.links.clear()
    for index, material in enumerate([*materials, hair]):
        quad = add_quad(f"Quad {index}", 0.5, 0.0, material)
        quad.location.x = index * 0.5 - 0.75
    target = add_quad("Target", 0.1, 0.0, new_material("Target"))
    target.location.y = 0.9
    add_camera("ORTHO", ortho_scale=2.0)
    report = export(target)
    assert [note for note in report.notes if "hair" in note] == [
        "Material 'hair': Hair BSDF is approximated by its nearest model.",
    ]
    expected, found = render_cycles(), render_mitsuba(report, 256)
    for index in range(3):
        area = np.s_[14:18, 8 * index + 1 : 8 * index + 7]
        np.testing.assert_allclose(found[area].mean(axis=(0, 1)), expected[area].mean(axis=(0, 1)), rtol=0.02)


def _cut_out(glow: Any) -> None:
    glow.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node.inputs["Alpha"].default_value = 0.3
    cycles = bpy.context.scene.cycles
    cycles.max_bounces = cycles.diffuse_bounces = 6  # Mitsuba counts what a ray passes
    _lamp_box(glow, 3.0)


def _lamp_box(glow: Any, size: float, *, around: bool = False, inwards: bool = False, faces: Any = None) -> None:
    bpy.ops.mesh.primitive_cube_add(size=size, location=(0.3, 0.2, 0.0 if around else 8.0))
    mesh = bpy.context.object.data
    if inwards:
        mesh.flip_normals()
    for material in (new_material("Dark", Base_Color=(0, 0, 0)), glow) if faces else (glow,):
        mesh.materials.append(material)
    for polygon in mesh.polygons if faces else ():
        polygon.material_index = int(faces(polygon.center))


@pytest.mark.parametrize(
    "build",
    [
        pytest.param(lambda glow: add_quad("Glow", 1.5, 8.0, glow), id="a quad, its back to the floor"),
        pytest.param(lambda glow: _lamp_box(glow, 0.8), id="a box"),
        pytest.param(lambda glow: _lamp_box(glow, 0.8, inwards=True), id="a box inside out"),
        pytest.param(_cut_out, id="a box that lets light through"),
        pytest.param(lambda glow: _lamp_box(glow, 60.0, around=True), id="a box around everything"),
        pytest.param(
            lambda glow: _lamp_box(glow, 60.0, around=True, faces=lambda at: at.z > 1.0), id="the ceiling of a box"
        ),
        pytest.param(lambda glow: _lamp_box(glow, 0.8, faces=lambda at: at.z < -0.1), id="one side of a box"),
    ],
)
def test_glowing_mesh_lights_what_its_faces_see(
    build: Any, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """Oracle: Cycles, in which both sides of every face give light."""
    from ..scene.test_light_levels import floor, tiles

    target = floor()
    build(new_material("Glow", Base_Color=(0, 0, 0), Emission_Color=(1.0, 0.5, 0.2), Emission_Strength=4.0))
    scene.cycles.samples = 256
    report = export(target)
    expected, found = tiles(render_cycles()), tiles(render_mitsuba(report, 512))
    assert expected.mean() > 0.002
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.01)


@pytest.mark.parametrize(
    "sockets",
    [
        {"Roughness": 1.0},
        {"Roughness": 0.5, "Base_Color": (0.8, 0.3, 0.1)},
        {"Metallic": 1.0, "Roughness": 0.3, "Base_Color": (0.9, 0.6, 0.3)},
        {"Metallic": 1.0, "Roughness": 0.8, "Base_Color": (0.5, 0.5, 0.5)},
        {"Alpha": 0.5},
    ],
)
def test_principled_albedo_is_near_that_of_cycles(
    sockets: Any, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """Two different models under a white sky, seen at cos 0.8, where the mapping matches their albedos."""
    world_color(scene, 1.0)
    add_camera("ORTHO", (3.0, 0.0, 4.0), (0.0, np.arccos(0.8), 0.0), ortho_scale=0.5)
    target = add_quad("Target", 2.0, 0.0, new_material("Target", **sockets))
    expected, found = render_cycles().mean(axis=(0, 1)), render_mitsuba(export(target), 64).mean(axis=(0, 1))
    # measured: at most 1.4 % (rough metal); without the mapping plastic is 8 % and this metal 30 % off
    np.testing.assert_allclose(found, expected, rtol=0.025)


def test_faces_without_material_look_as_in_cycles(
    scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    world_color(scene, 0.2)
    add_light("SUN", rotation=(0.0, -0.7, 0.0), energy=2.0, angle=0.0)
    add_camera("ORTHO", (3.0, 0.0, 4.0), (0.0, np.arccos(0.8), 0.0), ortho_scale=0.5)
    add_quad("Floor", 4.0, 0.0, None)
    target = add_quad("Target", 0.02, 0.01, new_material("Target"))
    expected, found = render_cycles().mean(axis=(0, 1)), render_mitsuba(export(target)).mean(axis=(0, 1))
    # near the mirror direction, where a Lambertian surface would be 20 % darker
    np.testing.assert_allclose(found, expected, rtol=0.08)


def test_working_space_is_converted(scene: Any, export: Any) -> None:
    """With a wide working space of Blender 5 the same numbers are another colour."""
    if not hasattr(getattr(bpy.data, "colorspace", None), "working_space"):
        pytest.skip("this Blender has one working space")
    world_color(scene, 1.0)
    add_light("POINT", energy=10.0)
    add_camera("ORTHO", ortho_scale=2.0)
    bpy.ops.wm.set_working_color_space(working_space="Linear Rec.2020", convert_colors=False)
    material = new_material("Target", Base_Color=(0.2, 0.4, 0.3))
    report = export(add_quad("Target", 1.0, 0.0, material))
    # ITU-R BT.2087, BT.2020 to BT.709
    matrix = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
    found = report.request["materials"]["target_bsdf"]["sockets"]["Base Color"]["value"]
    np.testing.assert_allclose(found, matrix @ (0.2, 0.4, 0.3), atol=1e-3)


def test_picture_files_of_a_saved_blend(scene: Any, export: Any, tmp_path: Any) -> None:
    """Files that Blender has not loaded yet are loaded; missing ones are magenta, as in Cycles, and named."""
    from blender_addon.export.files.png_file import write_png

    write_png(tmp_path / "grey.png", np.full((4, 4, 3), 188, np.uint8))
    world_color(scene, 1.0)
    material = new_material("Target")
    image = bpy.data.images.load(str(tmp_path / "grey.png"))
    material.node_tree.links.new(
        image_node(material, image).outputs["Color"], principled(material).inputs["Base Color"]
    )
    add_camera("ORTHO", ortho_scale=2.0)
    add_quad("Target", 1.0, 0.0, material)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    target = bpy.data.objects["Target"]
    report = export(target)
    value = report.request["materials"]["target_bsdf"]["sockets"]["Base Color"]["value"]
    np.testing.assert_allclose(value, 0.5028865, atol=1e-5)  # sRGB 188
    (tmp_path / "grey.png").unlink()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "a.blend"))
    target = bpy.data.objects["Target"]
    said = (
        "Material 'Target': the image 'grey.png' of the node 'Image Texture' is missing; it is magenta, as in Cycles. "
        "If the reference shows it, find it first: File > External Data > Find Missing Files."
    )
    assert check_export(bpy.context, target) == ([], [said])
    report = export(target)
    assert said in report.request["left_out"]  # if it does not match, this may be why
    magenta = report.request["materials"]["target_bsdf"]["sockets"]["Base Color"]
    assert magenta["linked"]
    np.testing.assert_allclose(magenta["value"], (1.0, 0.0, 1.0), atol=1e-4)


@pytest.mark.parametrize("socket", ["Base Color", "Subsurface Radius"])
def test_a_missing_picture_keeps_no_target_from_a_fit(scene: Any, socket: str) -> None:
    """Whether the model has the socket or not."""
    world_color(scene, 1.0)
    material = new_material("Target")
    node = image_node(material, bpy.data.images.new("gone.png", 4, 4))
    node.image.source, node.image.filepath = "FILE", "//gone.png"
    material.node_tree.links.new(node.outputs["Color"], principled(material).inputs[socket])
    add_camera("ORTHO", ortho_scale=2.0)
    errors, notes = check_export(bpy.context, add_quad("Target", 1.0, 0.0, material))
    assert errors == []
    assert [note for note in notes if "the image 'gone.png' of the node 'Image Texture' is missing" in note]


@pytest.mark.parametrize("is_there", [True, False])
def test_a_sequence_is_missing_where_its_first_picture_is(is_there: bool, scene: Any, tmp_path: Path) -> None:
    """Blender has no pixels of one before it is shown."""
    made = bpy.data.images.new("made", 4, 4)
    made.filepath_raw, made.file_format = str(tmp_path / "frame_0001.png"), "PNG"
    made.save()
    material = new_material("Target")
    node = image_node(material, bpy.data.images.load(made.filepath_raw))
    node.image.source = "SEQUENCE"
    material.node_tree.links.new(node.outputs["Color"], principled(material).inputs["Base Color"])
    add_camera("ORTHO", ortho_scale=2.0)
    add_light("POINT", energy=10.0)
    if not is_there:
        (tmp_path / "frame_0001.png").unlink()
    _, notes = check_export(bpy.context, add_quad("Target", 1.0, 0.0, material))
    assert any("is missing; it is magenta" in note for note in notes) != is_there


def test_no_socket_is_dropped_in_silence(scene: Any) -> None:
    """Each is a parameter of the model, or a sentence; every link that is not exported is one, too."""
    assert silent_sockets() == []


def test_tangents_that_no_mesh_holds_are_said(scene: Any) -> None:
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=2.0)
    material = new_material("Brushed", Metallic=1.0, Anisotropic=0.5)
    target, other = add_quad("Target", 1.0, 0.0, material), new_material("Other", Metallic=1.0, Anisotropic=0.5)
    add_quad("Beside", 0.2, -0.5, other)
    assert check_export(bpy.context, target) == ([], [])
    shader = other.node_tree.nodes.new("ShaderNodeBsdfAnisotropic")
    shader.inputs["Anisotropy"].default_value = 0.5
    turned = other.node_tree.nodes.new("ShaderNodeVectorMath")
    other.node_tree.links.new(turned.outputs[0], shader.inputs["Tangent"])
    other.node_tree.links.new(shader.outputs[0], other.node_tree.get_output_node("CYCLES").inputs["Surface"])
    assert "Material 'Other': what is linked to Tangent is left out." in check_export(bpy.context, target)[1]
    bpy.data.objects["Beside"].active_material = None
    node = material.node_tree.nodes.new("ShaderNodeTangent")
    node.direction_type = "UV_MAP"
    material.node_tree.links.new(node.outputs[0], principled(material).inputs["Tangent"])
    assert check_export(bpy.context, target) == ([], [])
