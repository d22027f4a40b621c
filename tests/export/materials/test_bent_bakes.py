# SPDX-License-Identifier: Apache-2.0
"""Baked surfaces whose normals nodes bend: instances of other sizes, surfaces seen from the side, displacements."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import bpy
import numpy as np
import pytest

from blender_addon.export.scene import scene_bakes
from mfo_backend.scene.image_file import read_image
from studies.parity.cycles_parity import render_job

from ..scene.test_baked_surfaces import Nodes, at_vertices, attribute, read_ply, stage
from ..scenes import add_camera, add_light, add_quad, new_material

__all__ = ["stage"]  # a fixture

DISPLACED = ("BUMP by UV", "BOTH by UV", "BOTH by Object")


def _instances(ball: Any, *scales: tuple[float, float, float]) -> None:
    """Put instances of `ball` in its place."""
    prefab = bpy.data.collections.new("Prefab")
    prefab.objects.link(ball)
    bpy.context.scene.collection.objects.unlink(ball)
    for number, scale in enumerate(scales):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", prefab
        empty.scale, empty.location.x, empty.rotation_euler.z = scale, 0.3 * number - 1.0, 0.5 * number
        bpy.context.scene.collection.objects.link(empty)


def _bump(nodes: Nodes) -> None:
    """A height that grows with the object's own z; its slope is 0.5 on a ball of one metre."""
    separate, bump = nodes.new("SeparateXYZ"), nodes.new("Bump")
    bump.inputs["Distance"].default_value = 0.5
    nodes.tree.links.new(nodes.new("TexCoord").outputs["Object"], separate.inputs[0])
    nodes.tree.links.new(separate.outputs["Z"], bump.inputs["Height"])
    nodes.tree.links.new(bump.outputs[0], nodes.principled.inputs["Normal"])


def _references(report: Any) -> list[str]:
    scene = ElementTree.parse(report.folder / "scene.xml").getroot()
    refs = [attribute(shape, "ref", "id") for shape in scene.iterfind("shape")]
    return [each for each in refs if each.startswith("baked")]


def test_bumps_of_instances_have_the_slopes_of_each_size(stage: Any, export: Any) -> None:
    """A height over an object's own z is half as steep on an instance of twice its size; turned ones share a bake."""
    target, ball, nodes = stage
    ball.scale, ball.rotation_euler = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
    _bump(nodes)
    _instances(ball, (1.0, 1.0, 1.0), (2.0, 2.0, 2.0), (1.0, 1.0, 1.0), (1.0, 2.0, 1.0))
    report = export(target)
    assert _references(report) == ["baked_0001", "baked_0002", "baked_0001", "baked_0003"]
    scene = ElementTree.parse(report.folder / "scene.xml").getroot()
    for number, size in ((0, 1.0), (1, 2.0)):
        name = f"baked_{number + 1:04d}"
        shape = next(each for each in scene.iterfind("shape") if attribute(each, "ref", "id") == name)
        positions, uv = read_ply(report.folder / attribute(shape, "string", "value"))
        bsdf = next(each for each in scene.iterfind("bsdf") if each.get("id") == name)
        bumped = next(each for each in bsdf.iter("bsdf") if each.get("type") == "normalmap")
        picture = np.asarray(read_image(report.folder / attribute(bumped, "texture/string", "value")).pixels)
        outwards = (positions - (0.3 * number - 1.0, 0.0, 0.0)) / (0.5 * size)
        # along the surface the height changes with the cosine to the axis
        slope = 0.5 / size * np.sqrt(np.clip(1.0 - outwards[:, 2] ** 2, 0.0, 1.0))
        found = 2.0 * at_vertices(picture, uv)[:, 2] - 1.0
        # facets are up to 7.5 degrees off the ball; by the other size it is 0.04
        assert np.median(np.abs(found - 1.0 / np.hypot(1.0, slope))) < 0.02


def test_a_normal_map_on_instances_of_other_sizes_shares_a_bake_and_on_stretched_ones_not(
    stage: Any, export: Any
) -> None:
    target, ball, nodes = stage
    bent = nodes.new("NormalMap")
    bent.inputs["Color"].default_value = (0.7, 0.5, 0.9, 1.0)
    nodes.tree.links.new(nodes.new("TexCoord").outputs["Generated"], nodes.principled.inputs["Base Color"])
    nodes.tree.links.new(bent.outputs[0], nodes.principled.inputs["Normal"])
    _instances(ball, (1.0, 1.0, 1.0), (2.0, 2.0, 2.0), (1.0, 2.0, 1.0), (-1.0, 1.0, 1.0))
    assert _references(export(target)) == ["baked_0001", "baked_0001", "baked_0002", "baked_0003"]


def test_bumps_on_instances_of_many_sizes_are_baked_for_some_and_named(
    stage: Any, export: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    most = 2
    monkeypatch.setattr(scene_bakes, "MOST_PLACES", most)
    target, ball, nodes = stage
    _bump(nodes)
    _instances(ball, *((0.5 + 0.1 * number,) * 3 for number in range(most + 2)))
    report = export(target)
    assert _references(report) == [f"baked_{number + 1:04d}" for number in range(most)] + ["baked_0001"] * 2
    said = f"beyond {most} sizes all have those of the first."
    assert [said in note for note in report.notes].count(True) == 1


def test_waves_that_are_narrower_than_a_texel_are_baked_finer(scene: Any, in_both: Any) -> None:
    """Slopes of up to 9 that turn within six texels: by their means the floor was 9 % too bright."""
    scene.cycles.samples = 256
    add_camera("ORTHO", ortho_scale=4.0)
    add_light("SUN", rotation=(0.0, 0.9, 0.3), energy=3.0)
    floor, target = add_quad("Floor", 4.0, 0.0, new_material("Floor")), add_quad("T", 0.5, 1.0, new_material("T"))
    nodes = Nodes(floor.data.materials[0])
    waves, bump = nodes.new("TexWave"), nodes.new("Bump")
    waves.inputs["Scale"].default_value, bump.inputs["Distance"].default_value = 12.0, 0.3
    nodes.tree.links.new(waves.outputs["Fac"], bump.inputs["Height"])
    nodes.tree.links.new(bump.outputs[0], nodes.principled.inputs["Normal"])
    _, ours, theirs = in_both(target)
    assert ours[:8].mean() == pytest.approx(theirs[:8].mean(), rel=0.02)


@pytest.mark.parametrize("lean", [-0.8, 0.8], ids=["towards the camera", "away from the camera"])
def test_a_leaning_normal_on_a_surface_that_is_seen_from_the_side_shades_as_in_cycles(
    lean: float, scene: Any, export: Any, render_cycles: Callable[[], np.ndarray]
) -> None:
    """Diffuse light falls on a normal as it is, also on one that the camera does not see; reflections bend it."""
    add_light("SUN", rotation=(-0.6, 0.0, 0.0), energy=3.0)
    add_camera("PERSP", (0.0, -4.0, 0.8), (1.374, 0.0, 0.0))
    target = add_quad("Target", 0.1, 0.1, new_material("Target"))
    floor = add_quad("Floor", 3.0, 0.0, new_material("Floor"))
    nodes = Nodes(floor.data.materials[0])
    normal = nodes.new("CombineXYZ")
    normal.inputs["Y"].default_value, normal.inputs["Z"].default_value = lean, 1.0
    nodes.tree.links.new(normal.outputs[0], nodes.principled.inputs["Normal"])
    expected = render_cycles()
    job = export(target, reference=bpy.data.images.new("Any", 32, 32)).folder
    found = np.mean(render_job(job, 64, "roughness"), axis=0)
    lit = expected.min(axis=-1) > 0.05
    assert lit.sum() > 50
    assert found[lit].mean() == pytest.approx(expected[lit].mean(), rel=0.01)


@pytest.mark.parametrize("method", ["BUMP", "a Bump node", "a Bump node on BUMP"])
def test_a_displacement_by_bump_takes_the_place_of_the_smooth_normal_and_a_bump_lies_on_it(
    method: str, scene: Any, export: Any, render_cycles: Callable[[], np.ndarray]
) -> None:
    """A matt slope under a sun that grazes the floor: only the Bump's has the shadows of bumps, a seventh of it.

    Those of a Bump on a displacement begin at its normal: by the floor's own nothing was left.
    """
    add_light("SUN", rotation=(1.2, 0.0, 0.0), energy=3.0)
    add_camera("ORTHO", ortho_scale=1.0)
    target = add_quad("Target", 0.1, 0.1, new_material("Target"))
    floor = add_quad("Floor", 3.0, 0.0, new_material("Floor", Roughness=1.0, Specular_IOR_Level=0.0))
    nodes = Nodes(floor.data.materials[0])
    separate = nodes.new("SeparateXYZ")
    nodes.tree.links.new(nodes.new("TexCoord").outputs["Object"], separate.inputs[0])
    if "BUMP" in method:
        moved = nodes.new("Displacement")
        moved.inputs["Midlevel"].default_value, moved.inputs["Scale"].default_value = 0.0, 1.0
        floor.data.materials[0].displacement_method = "BUMP"
        nodes.tree.links.new(separate.outputs["Y"], moved.inputs["Height"])
        nodes.tree.links.new(moved.outputs[0], nodes.tree.get_output_node("CYCLES").inputs["Displacement"])
    if "node" in method:
        bump = nodes.new("Bump")
        bump.inputs["Distance"].default_value = 1.0
        nodes.tree.links.new(separate.outputs["Y"], bump.inputs["Height"])
        nodes.tree.links.new(bump.outputs[0], nodes.principled.inputs["Normal"])
    expected = render_cycles()
    job = export(target, reference=bpy.data.images.new("Any", 32, 32)).folder
    found = np.mean(render_job(job, 64, "roughness"), axis=0)
    assert expected.mean() > 0.5  # the slope faces the sun; flat it is 0.28
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01)


@pytest.mark.parametrize("kind", ["NormalMap", "Position", "Object", "Generated", "UV", "attribute", *DISPLACED])
@pytest.mark.parametrize("is_behind", [False, True])
def test_normals_of_a_floor_that_is_seen_from_behind(scene: Any, in_both: Any, kind: str, is_behind: bool) -> None:
    """Cycles turns those of a Normal Map round on back faces: a floor with its normals down was 16 % too bright.

    So it does with heights between vertices, and not with those by the place: such floors were 79 % too dark. Where a
    displacement moves faces, too, it is the other way round.
    """
    scene.cycles.samples = 256
    add_camera("ORTHO", ortho_scale=4.0)
    add_light("SUN", rotation=(0.0, 0.9, 0.3), energy=3.0)
    floor, target = add_quad("Floor", 4.0, 0.0, new_material("Floor")), add_quad("T", 0.5, 1.0, new_material("T"))
    floor.data.uv_layers.new(name="UVMap")
    _bend(Nodes(floor.data.materials[0]), kind)
    if kind in DISPLACED:
        floor.data.materials[0].displacement_method = kind.partition(" ")[0]
    floor.data.attributes.new("x", "FLOAT_VECTOR", "POINT").data.foreach_set(
        "vector", np.ravel([vertex.co for vertex in floor.data.vertices])
    )
    if is_behind:
        floor.data.flip_normals()
    report, ours, theirs = in_both(target)
    assert ours[:8].mean() == pytest.approx(theirs[:8].mean(), rel=0.01)
    turned = [m.get("turned", False) for m in report.request["materials"].values()]
    assert any(turned) == (kind not in ("Position", "Object", "BOTH by UV"))


def _vase(coordinate: str, *, is_behind: bool, is_flat: bool) -> Any:
    """An open vase of 12 facets that waves move and bend; returns a target beside it."""
    add_camera("ORTHO", (0.0, -5.0, 0.5), (math.pi / 2, 0.0, 0.0), ortho_scale=3.0)
    add_light("SUN", rotation=(0.5, 1.1, 0.0), energy=3.0)
    bpy.ops.mesh.primitive_cylinder_add(vertices=12, end_fill_type="NOTHING")
    vase, target = bpy.context.object, add_quad("T", 0.2, 2.0, new_material("T"))
    vase.data.polygons.foreach_set("use_smooth", [not is_flat] * len(vase.data.polygons))
    vase.data.materials.append(new_material("Vase", Roughness=0.8))
    nodes = Nodes(vase.data.materials[0])
    separate, wide, wave, moved = (nodes.new(kind) for kind in ("SeparateXYZ", "Math", "Math", "Displacement"))
    wide.operation, wave.operation, wide.inputs[1].default_value = "MULTIPLY", "SINE", 5.0
    moved.inputs["Midlevel"].default_value, moved.inputs["Scale"].default_value = 0.0, 0.09
    output = nodes.tree.get_output_node("CYCLES").inputs["Displacement"]
    along = "Y" if coordinate == "UV" else "Z"
    for source, socket in ((nodes.new("TexCoord").outputs[coordinate], separate), (separate.outputs[along], wide),
                           (wide.outputs[0], wave), (wave.outputs[0], moved)):  # fmt: skip
        nodes.tree.links.new(source, socket.inputs[0])
    nodes.tree.links.new(moved.outputs[0], output)
    vase.data.materials[0].displacement_method = "BOTH"
    if is_behind:
        vase.data.flip_normals()
    return target


@pytest.mark.parametrize("coordinate", ["UV", "Object"])
@pytest.mark.parametrize("is_behind", [False, True])
@pytest.mark.parametrize("is_flat", [False, True])
def test_displacement_and_bump_bends_the_normals_that_faces_had_before_they_moved(
    scene: Any, in_both: Any, coordinate: str, is_behind: bool, is_flat: bool
) -> None:
    """With those that the moved faces have blocks of 4 x 4 pixels were up to 64 % of the picture's mean off.

    That was on backs, which are mirrored at them; where shadow rays start by them 10 % were missing in front, too.
    """
    scene.cycles.samples = 256
    report, ours, theirs = in_both(_vase(coordinate, is_behind=is_behind, is_flat=is_flat))
    assert [note for note in report.notes if "'Vase'" in note and "is baked" not in note] == []
    assert _worst(ours, theirs) < 0.08


def test_a_neighbour_that_moves_faces_alone_leaves_the_normals_of_what_bends_them_too(scene: Any, in_both: Any) -> None:
    """Both widen a vase by the same, one its upper half: where they meet a block of its back was 36 % off."""
    import bmesh  # which bpy brings

    scene.cycles.samples = 256
    target = _vase("Object", is_behind=True, is_flat=False)
    vase = bpy.context.object
    made = bmesh.new()
    made.from_mesh(vase.data)
    upright = [edge for edge in made.edges if abs(edge.verts[0].co.z - edge.verts[1].co.z) > 1.0]
    bmesh.ops.subdivide_edges(made, edges=upright, cuts=5)
    made.to_mesh(vase.data)
    made.free()
    both = vase.data.materials[0]
    wide = next(node for node in both.node_tree.nodes if getattr(node, "operation", "") == "MULTIPLY")
    both.node_tree.links.remove(wide.inputs[0].links[0])
    wide.inputs[0].default_value = 0.25
    vase.data.materials.append(both.copy())
    vase.data.materials[1].displacement_method = "DISPLACEMENT"
    for polygon in vase.data.polygons:
        polygon.material_index = int(polygon.center.z > 0.1)
    _, ours, theirs = in_both(target)
    assert _worst(ours, theirs) < 0.08


def _worst(ours: np.ndarray, theirs: np.ndarray) -> float:
    """The largest difference of a block of 4 x 4 pixels, in parts of the picture's mean."""
    off = (ours - theirs).mean(axis=2).reshape(8, 4, 8, 4).mean(axis=(1, 3)) / theirs.mean()
    return float(abs(off).max())


def test_a_bump_leans_along_the_faces_as_a_displacement_has_turned_them(scene: Any, in_both: Any) -> None:
    """A floor that its material turns by 69 degrees: along the faces as they were it was 0.54 for 0.25."""
    scene.cycles.samples = 256
    add_camera("ORTHO", ortho_scale=2.0)
    add_light("SUN", rotation=(0.0, 0.9, 0.3), energy=3.0)
    floor, target = add_quad("Floor", 4.0, 0.0, new_material("Floor")), add_quad("T", 0.5, 1.0, new_material("T"))
    floor.data.uv_layers.new(name="UVMap")
    nodes = Nodes(floor.data.materials[0])
    _bend(nodes, "UV")
    turned, way, moved = nodes.new("VectorRotate"), nodes.new("VectorMath"), nodes.new("VectorDisplacement")
    turned.inputs["Angle"].default_value, way.operation, moved.space = 1.2, "SUBTRACT", "OBJECT"
    moved.inputs["Midlevel"].default_value, moved.inputs["Scale"].default_value = 0.0, 1.0
    place = nodes.new("TexCoord").outputs["Object"]
    for source, socket in ((place, turned.inputs[0]), (turned.outputs[0], way.inputs[0]), (place, way.inputs[1]),
                           (way.outputs[0], moved.inputs[0])):  # fmt: skip
        nodes.tree.links.new(source, socket)
    nodes.tree.links.new(moved.outputs[0], nodes.tree.get_output_node("CYCLES").inputs["Displacement"])
    floor.data.materials[0].displacement_method = "DISPLACEMENT"
    _, ours, theirs = in_both(target)
    assert ours[:8].mean() == pytest.approx(theirs[:8].mean(), rel=0.01)


def _bend(nodes: Nodes, kind: str) -> None:
    """A normal that leans along X: by a Normal Map, by a Bump of a coordinate, or by a displacement in its place."""
    link, normal = nodes.tree.links.new, nodes.new("NormalMap" if kind == "NormalMap" else "Bump")
    if kind == "NormalMap":
        normal.inputs["Color"].default_value = (0.7, 0.6, 0.95, 1.0)
        link(normal.outputs[0], nodes.principled.inputs["Normal"])
        return
    attribute, separate = nodes.new("Attribute"), nodes.new("SeparateXYZ")
    attribute.attribute_name = "x"
    coordinates = {"Position": nodes.new("NewGeometry").outputs["Position"], "attribute": attribute.outputs["Vector"]}
    link(coordinates.get(kind) or nodes.new("TexCoord").outputs[kind.rpartition(" ")[2]], separate.inputs[0])
    # UV and Generated coordinates have 1 for four metres
    distance = 2.0 if kind.endswith(("UV", "Generated")) else 0.5
    if kind in DISPLACED:
        moved, inside, height = nodes.new("Displacement"), nodes.new("Math"), nodes.new("Math")
        moved.inputs["Midlevel"].default_value, moved.inputs["Scale"].default_value = 0.0, distance
        inside.operation, height.operation = "COMPARE", "MULTIPLY"  # the corners stay where they are
        middle, half = (0.5, 0.48) if kind.endswith("UV") else (0.0, 1.92)
        inside.inputs[1].default_value, inside.inputs[2].default_value = middle, half
        link(separate.outputs["X"], inside.inputs[0])
        link(separate.outputs["X"], height.inputs[0])
        link(inside.outputs[0], height.inputs[1])
        link(height.outputs[0], moved.inputs["Height"])
        link(moved.outputs[0], nodes.tree.get_output_node("CYCLES").inputs["Displacement"])
        return
    normal.inputs["Distance"].default_value = distance
    link(separate.outputs["X"], normal.inputs["Height"])
    link(normal.outputs[0], nodes.principled.inputs["Normal"])
