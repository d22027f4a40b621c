# SPDX-License-Identifier: Apache-2.0
"""Geometry that is broken or extreme is exported without what cannot be drawn, or refused with a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.job import ExportError
from mfo_backend.scene.ply_file import check_ply

from ..scenes import add_camera, add_mesh, new_material, world_color

SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
FACES = [(0, 1, 2), (0, 2, 3)]


def target(
    scene: Any, vertices: Any = SQUARE, faces: Any = FACES, move: dict[int, tuple[float, ...]] | None = None
) -> Any:
    """A mesh before a camera; vertices of `move` get their place afterwards, as a broken modifier would."""
    world_color(scene, 1.0)
    item = add_mesh("Broken", vertices, faces, new_material("Target"))
    for index, place in (move or {}).items():
        item.data.vertices[index].co = place
    add_camera("PERSP", (0, 0, 6))
    bpy.context.view_layer.update()
    return item


@pytest.mark.parametrize(
    ("change", "triangles", "left_out"),
    [
        ({}, 2, 0),
        ({"faces": [(0, 1, 2)]}, 1, 0),
        ({"faces": [*FACES, (0, 1, 1 + 3)], "vertices": [*SQUARE, (0, -1, 0)]}, 3, 0),  # no area
        ({"move": {3: (np.nan, 0, 0)}}, 1, 1),
        ({"move": {3: (np.inf, 0, 0)}}, 1, 1),  # which Blender makes the largest float32
        ({"move": {3: (1e12, 0, 0)}}, 2, 0),
    ],
    ids=["whole", "one triangle", "no area", "NaN", "infinite", "far"],
)
def test_what_can_be_drawn_is_exported(
    scene: Any, export: Any, mitsuba: Any, change: dict, triangles: int, left_out: int
) -> None:
    report = export(target(scene, **change))
    mesh = report.folder / "meshes" / "target.ply"
    check_ply(mesh)
    assert mitsuba.load_dict({"type": "ply", "filename": str(mesh)}).face_count() == triangles
    notes = [note for note in report.notes if "NaN, infinite" in note]
    assert len(notes) == bool(left_out)
    assert all(f"'Broken' has {left_out} triangles" in note for note in notes)


@pytest.mark.parametrize("place", [(np.nan, 0, 0), (0, -np.inf, 0), (0, 1e19, 0)])
def test_nothing_to_draw_is_refused(scene: Any, export: Any, tmp_path: Path, place: tuple) -> None:
    with pytest.raises(ExportError) as refusal:
        export(target(scene, move=dict.fromkeys(range(4), place)))
    assert str(refusal.value).startswith("All faces of 'Broken' with its active material have corners at NaN, infinite")
    assert str(refusal.value).endswith("move or scale the object, or mend its mesh.")
    assert not (tmp_path / "job").exists()


def test_a_broken_object_beside_the_target_is_left_out(scene: Any, export: Any) -> None:
    item = target(scene)
    other = add_mesh("Other", SQUARE, FACES, new_material("Second"))
    for vertex in other.data.vertices:
        vertex.co = (np.nan, 0, 0)
    bpy.context.view_layer.update()
    report = export(item)
    assert [p.name for p in (report.folder / "meshes").iterdir()] == ["target.ply"]
    assert "'Other' has 2 triangles" in " ".join(report.notes)
