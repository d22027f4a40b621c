# SPDX-License-Identifier: Apache-2.0
"""Which faces are in the same place."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.files.ply_file import TriangleMesh
from blender_addon.export.job import check_export
from blender_addon.export.meshes.coincident import most_parallel, normals_around, shared_faces

from ..scenes import add_camera, add_light, add_mesh, add_quad, new_material


def mesh(corners: Any) -> TriangleMesh:
    positions = np.asarray(corners, np.float32).reshape(-1, 3)
    triangles = np.arange(len(positions), dtype=np.int32).reshape(-1, 3)
    return TriangleMesh(positions, np.zeros_like(positions), np.zeros((len(positions), 2), np.float32), triangles)


FACE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def test_a_face_twice_is_found_within_an_object_and_between_two() -> None:
    turned = np.roll(FACE, 1, axis=0)[::-1]
    assert shared_faces([("A", mesh([FACE, turned]))]) == [("A", "A")]
    assert shared_faces([("A", mesh([FACE])), ("B", mesh([turned, FACE + 3]))]) == [("A", "B")]
    assert shared_faces([("A", mesh([FACE, FACE + 1e-2])), ("B", mesh([FACE + 2]))]) == []
    assert shared_faces([]) == []


def test_a_label_just_above_faces_of_its_own_shape_is_not_in_their_place() -> None:
    above, moved = FACE + np.array([0, 0, 2e-4]), FACE + np.array([2e-4, 0, 0])
    ground = ("Ground", mesh([100 * FACE - 1.0]))  # which makes what is looked at coarse
    assert shared_faces([("Bottle", mesh([FACE])), ("Label", mesh([above])), ground]) == []
    assert shared_faces([("Half", mesh([FACE])), ("Mirrored", mesh([moved])), ground]) == [("Half", "Mirrored")]


def test_doubled_faces_among_many_of_several_objects_are_those_that_comparing_all_finds() -> None:
    random = np.random.default_rng(2)
    faces = random.random((60, 3, 3)).astype(np.float32)
    faces[41] = faces[3][[2, 0, 1]]  # B and A
    faces[55] = faces[50][[1, 0, 2]]  # C by itself
    faces[30] = faces[29]  # B by itself
    parts = {"A": slice(0, 20), "B": slice(20, 45), "C": slice(45, 60)}
    names = [name for name, part in parts.items() for _ in faces[part]]
    sorted_corners = [sorted(map(tuple, face)) for face in faces.tolist()]
    wanted = {
        (names[a], names[b]) for a in range(60) for b in range(a + 1, 60) if sorted_corners[a] == sorted_corners[b]
    }
    found = shared_faces([(name, mesh(faces[part])) for name, part in parts.items()])
    assert set(found) == wanted == {("A", "B"), ("B", "B"), ("C", "C")}


def test_small_faces_of_a_large_scene_and_faces_without_area_are_none() -> None:
    small = 1e-4 * FACE
    assert shared_faces([("A", mesh([small, small + 1e-4, 100 * FACE]))]) == []
    point = 0 * FACE
    assert shared_faces([("A", mesh([point, point, FACE]))]) == []


def test_an_object_with_faces_twice_is_named(scene: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    item = bpy.context.object
    item.data.materials.append(new_material("Target"))
    add_light("POINT", (3, -3, 3), energy=300.0)
    add_camera("PERSP", (0, -6, 0), rotation=(np.pi / 2, 0, 0))
    assert not any("twice" in note for note in check_export(bpy.context, item)[1])
    item.modifiers.new("Mirror", "MIRROR").use_axis = (True, True, False)
    assert any("'Cube' has faces twice in the same place" in note for note in check_export(bpy.context, item)[1])


def test_points_lie_in_faces_where_they_are_inside_them_and_in_their_plane() -> None:
    faces = mesh([FACE, FACE + np.array([5, 0, 1]), 0 * FACE, 2 * FACE - np.array([0.1, 0.1, 0])])

    def count(*point: float, reach: float = 1e-6) -> int:
        return max(map(len, normals_around(np.array([point, (9.0, 9.0, 9.0)]), np.full(2, reach), faces)))

    assert count(0.3, 0.3, 0.0) == 2
    assert count(5.3, 0.3, 1.0) == 1
    assert count(0.6, 0.6, 0.0) == 1  # in the bounds and the plane of the other
    assert count(1.1, 1.1, 0.0) == 0
    assert count(0.3, 0.3, 1e-4) == 0
    assert count(0.3, 0.3, 1e-4, reach=2e-4) == 2
    turned = np.array([[0.2, -0.5, 0.7], [1.3, 0.4, -0.2], [0.1, 1.1, 0.9]])
    weights = np.random.default_rng(3).dirichlet([1.0, 1.0, 1.0], 20)
    outside = weights + np.array([-1.01, 0.0, 1.01])
    for shares, wanted in ((weights, 1), (outside, 0)):
        assert [len(*normals_around(w[None] @ turned, np.array([1e-6]), mesh([turned]))) for w in shares] == [
            wanted
        ] * 20


def test_faces_that_cross_are_in_no_one_place() -> None:
    up, aslant = np.array([[0.0, 0.0, 1.0]]), np.array([[0.1, 0.0, 0.995]])
    assert most_parallel([up], [-up]) == 1
    assert most_parallel([up], [np.concatenate([aslant, up, up])]) == 2
    assert most_parallel([up, aslant], [aslant, up]) == 0
    assert most_parallel([up], [np.empty((0, 3))]) == 0


def test_a_wall_that_goes_through_a_floor_is_not_named(scene: Any) -> None:
    """The camera looks along the line where they meet, with a row of rays on it."""
    floor = add_quad("Floor", 4.0, 0.0, new_material("Target"))
    add_quad("Wall", 4.0, 0.0, new_material("Wall")).rotation_euler = (np.pi / 2, 0, 0)
    add_light("POINT", (3, -3, 3), energy=300.0)
    add_camera("ORTHO", (0, -5, 5), rotation=(np.pi / 4, 0, 0), ortho_scale=2.4, shift_y=1 / 24)
    assert not any("in the same place" in note for note in check_export(bpy.context, floor)[1])
    add_quad("Rug", 1.0, 0.0, new_material("Rug"))
    assert any("'Floor' and 'Rug' have faces in the same" in note for note in check_export(bpy.context, floor)[1])


@pytest.mark.parametrize(("lift", "named"), [(0.0, True), (0.001, False)])
@pytest.mark.parametrize("is_target", [True, False])
def test_what_a_glass_stands_on_is_seen_through_it(scene: Any, lift: float, named: bool, is_target: bool) -> None:
    """Its bottom lies in the plane of the table, which Cycles has black there; that of an opaque block nobody sees."""
    table = add_quad("Table", 4.0, 0.0, new_material("Table"))
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.3, 0.2, 0.5 + lift))
    block = bpy.context.object
    add_light("POINT", (3, -3, 3), energy=300.0)
    add_camera("ORTHO", (0, -5, 5), rotation=(np.pi / 4, 0, 0), ortho_scale=2.4)
    for transmission in (0.0, 1.0):
        block.data.materials.clear()
        block.data.materials.append(new_material("Block", Transmission_Weight=transmission))
        notes = check_export(bpy.context, block if is_target else table)[1]
        assert any("'Cube'" in n and "'Table'" in n and "same place" in n for n in notes) == (
            transmission > 0 and named
        )


def test_faces_of_the_target_in_a_larger_one_of_its_own_are_named(scene: Any) -> None:
    corners = [(x, y, 0) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    squares = [(0, 1, 4, 3), (1, 2, 5, 4), (3, 4, 7, 6), (4, 5, 8, 7)]
    target = add_mesh("Board", corners, squares, new_material("Target"))
    add_light("POINT", (3, -3, 3), energy=300.0)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=3.0)
    assert not any("in the same place" in note for note in check_export(bpy.context, target)[1])
    larger = add_mesh("Larger", corners, [*squares, (0, 6, 8, 2)], new_material("Target"))
    bpy.data.objects.remove(target)
    assert any("'Larger' has faces twice in the same" in note for note in check_export(bpy.context, larger)[1])


@pytest.mark.parametrize(("gap", "is_named"), [(0.0, True), (1e-4, False)])
def test_an_object_in_the_plane_of_the_target_is_named_where_it_is_seen(gap: float, is_named: bool, scene: Any) -> None:
    """A text on a turned board; the board's foot stands on the floor, where nothing sees it."""
    bpy.ops.mesh.primitive_cube_add(size=2.0, location=(0.0, 0.0, 1.0))
    item = bpy.context.object
    item.data.materials.append(new_material("Target"))
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    bpy.ops.object.text_add(location=(-0.8, -1.0 - gap, 1.0), rotation=(np.pi / 2, 0, 0))
    turn = bpy.data.objects.new("Turn", None)
    scene.collection.objects.link(turn)
    for each in list(scene.objects):
        each.parent = turn if each != turn else None
    turn.rotation_euler = (0.2, 0.1, 0.4)
    add_light("POINT", (3, -3, 3), energy=300.0)
    add_camera("PERSP", (2.0, -6.0, 2.0), rotation=(1.4, 0, 0.3))
    bpy.context.view_layer.update()
    said = [note for note in check_export(bpy.context, item)[1] if "in the same place" in note]
    assert [note[:40] for note in said] == (["'Cube' and 'Text' have faces in the same"] if is_named else [])


def test_what_a_box_below_a_close_decal_stands_on_is_not_seen(scene: Any) -> None:
    """A ray that went on within the box met its foot, and the floor in the same plane."""
    bpy.ops.mesh.primitive_plane_add(size=20.0)
    bpy.context.object.data.materials.append(new_material("Floor"))
    bpy.ops.mesh.primitive_cube_add(size=2.0, location=(0.0, 0.0, 1.0))
    box = bpy.context.object
    box.data.materials.append(new_material("Target"))
    bpy.ops.mesh.primitive_plane_add(size=1.5, location=(0.0, -1.0 - 5e-5, 1.0), rotation=(np.pi / 2, 0, 0))
    bpy.context.object.data.materials.append(new_material("Decal", Alpha=0.5))
    add_light("POINT", (3, -3, 3), energy=300.0)
    add_camera("PERSP", (0.0, -5.0, 4.0), rotation=(np.radians(55), 0, 0))
    bpy.context.view_layer.update()
    assert not any("in the same place" in note for note in check_export(bpy.context, box)[1])


@pytest.mark.parametrize("gap", [0.0, 0.001])
def test_walls_that_overlap_behind_the_camera(scene: Any, gap: float) -> None:
    """They light what it sees: a room was 3.6 % too bright by them, and nothing said so."""
    add_camera("PERSP", location=(0.0, 0.0, 2.0))
    add_light("POINT", location=(0.5, 0.0, 1.0), energy=100.0)
    floor = add_quad("Floor", 4.0, 0.0, new_material("Floor"))
    for name, size, height in (("A", 4.0, 3.0), ("B", 3.0, 3.0 + gap)):
        add_quad(name, size, height, new_material(name))
    bpy.context.view_layer.objects.active = floor
    said = [note for note in check_export(bpy.context, floor)[1] if "in the same place" in note]
    assert len(said) == (1 if gap == 0.0 else 0)
