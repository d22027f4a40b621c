# SPDX-License-Identifier: Apache-2.0
"""What an export keeps of one picture for the next: its files are those that each picture alone has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import pytest

from blender_addon.export.job import export_steps
from blender_addon.export.meshes import face_notes, known_meshes
from blender_addon.export.reference.picture_setup import PictureSetup
from blender_addon.export.scene import read_scene
from blender_addon.export.steps import drained
from mfo_backend.scene.image_file import write_exr

from ..scenes import add_camera, add_light, new_material
from .test_read_mesh import mixed


@pytest.fixture
def target(scene: Any, tmp_path: Path) -> Any:
    """Three instances of one mesh, one of which moves, and a ball that another frame has of another shape."""
    import numpy as np

    mixed()
    item = bpy.context.object
    item.data.materials[0] = new_material("Target")
    for place in (3.0, -3.0):
        twin = bpy.data.objects.new("Twin", item.data)
        twin.location.x = place
        scene.collection.objects.link(twin)
    twin.keyframe_insert("location", frame=1)
    twin.location.z = 1.0
    twin.keyframe_insert("location", frame=2)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=4, location=(0, 3, 0))
    wave = bpy.context.object.modifiers.new("Wave", "WAVE")
    wave.height = 0.4
    add_light("POINT", (3, -3, 3), energy=300.0)
    add_camera("PERSP", (0, -14, 0), rotation=(np.pi / 2, 0, 0))
    item.active_material_index = 0
    scene.frame_set(1)
    write_exr(tmp_path / "reference.exr", np.full((32, 32, 3), 0.3, np.float32))
    return item


def meshes(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in (folder / "meshes").iterdir()}


def test_files_are_those_of_each_picture_alone(target: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    placed: list[object] = []
    before = read_scene.Piece.placed
    monkeypatch.setattr(read_scene.Piece, "placed", lambda piece: placed.append(piece) or before(piece))
    asked: list[object] = []
    shared = known_meshes.shared_faces
    monkeypatch.setattr(known_meshes, "shared_faces", lambda places: asked.append(places) or shared(places))

    def export(name: str, *frames: int) -> Path:
        setups = [PictureSetup(tmp_path / "reference.exr", k, frame) for k, frame in enumerate(frames, 1)]
        drained(export_steps(bpy.context, target, tmp_path / name, setups, {}, "scene", upright=False))
        return tmp_path / name

    alone = [meshes(export(f"alone {frame}", frame)) for frame in (1, 2)]
    count = len(alone[0])
    assert alone[0] != alone[1]
    placed.clear()
    asked.clear()
    job = export("job", 1, 1, 2)
    assert meshes(job) == meshes(job / "more_pictures" / "2") == alone[0]
    assert meshes(job / "more_pictures" / "3") == alone[1]
    assert len(placed) == count + 4  # three slots of what moved, and what has another shape
    assert len(asked) == 2


def test_the_file_is_as_it_was_while_much_is_computed(
    target: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (read_scene, face_notes):
        monkeypatch.setattr(module, "MANY", 1)
    division = target.modifiers.new("Subdivision", "SUBSURF")
    division.levels, division.render_levels = 0, 2
    seen: list[bool] = []
    steps = export_steps(bpy.context, target, tmp_path / "job", None, {}, "scene", upright=False)
    for pause in steps:
        assert division.levels == 0
        seen.append(pause.is_apart)
        assert pause.holds_scene == pause.is_apart
    assert seen.count(True) == 10 + 2  # pieces, faces in the same place, faces in the same plane
    sizes = [len(data) for name, data in meshes(tmp_path / "job").items() if name.startswith("target")]
    assert sizes[0] > 4 * min(map(len, meshes(tmp_path / "job").values()))
