# SPDX-License-Identifier: Apache-2.0
"""Targets that come from a library or are overrides: found before a fit, and made local by a button."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from .found import check, stopping


def from_library(scene: SimpleNamespace, folder: Path, kind: str, name: str):
    """Save the scene, and take a datablock of that file into it as a link."""
    bpy, file = scene.bpy, str(folder / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=file, copy=True)
    with bpy.data.libraries.load(file, link=True) as (_, wanted):
        setattr(wanted, kind, [name])
    (linked,) = getattr(wanted, kind)
    return linked


def test_a_material_of_a_library_is_made_local_by_its_button(scene: SimpleNamespace, tmp_path: Path) -> None:
    linked = from_library(scene, tmp_path, "materials", "Glaze")
    target = scene.bpy.data.objects["Väse"]
    target.active_material = linked
    found = next(f for f in check(scene) if {fix.kind for fix in f.fixes} == {"make_local"})
    assert found.level == "stops"
    assert not target.active_material.is_editable
    with pytest.raises(RuntimeError, match="comes from a library: make it local first"):
        scene.bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job)
    assert not Path(scene.job).exists()
    assert scene.bpy.ops.mfo.mend(kind="make_local") == {"FINISHED"}
    assert target.active_material.is_editable
    assert target.active_material.library is None
    assert found.sentence not in {f.sentence for f in check(scene)}
    assert stopping(scene) == {}


def test_an_object_of_a_library_becomes_local_with_mesh_and_material(scene: SimpleNamespace, tmp_path: Path) -> None:
    linked = from_library(scene, tmp_path, "objects", "Väse")
    scene.bpy.context.scene.collection.objects.link(linked)
    scene.bpy.context.view_layer.objects.active = linked
    assert {"make_local"} in [{fix.kind for fix in f.fixes} for f in check(scene)]
    assert scene.bpy.ops.mfo.mend(kind="make_local") == {"FINISHED"}
    target = scene.bpy.context.view_layer.objects.active
    assert [item.library for item in (target, target.data, target.active_material)] == [None] * 3
    assert stopping(scene) == {}


def test_an_override_is_made_local(scene: SimpleNamespace, tmp_path: Path) -> None:
    linked = from_library(scene, tmp_path, "objects", "Väse")
    scene.bpy.context.scene.collection.objects.link(linked)
    target = linked.override_create(remap_local_usages=True)
    mesh = target.data.override_create(remap_local_usages=True)
    mesh.materials[0].override_create(remap_local_usages=True)
    scene.bpy.context.view_layer.objects.active = target
    assert target.active_material.is_editable  # which alone would have let the fit run
    (found,) = (f for f in check(scene) if {fix.kind for fix in f.fixes} == {"make_local"})
    assert "library override, in which Blender keeps no values of nodes" in found.sentence
    assert scene.bpy.ops.mfo.mend(kind="make_local") == {"FINISHED"}
    target = scene.bpy.context.view_layer.objects.active
    items = (target, target.data, target.active_material)
    assert [(item.library, item.override_library) for item in items] == [(None, None)] * 3
    assert stopping(scene) == {}


def test_what_a_linked_collection_holds_stays_there_and_it_is_said(scene: SimpleNamespace, tmp_path: Path) -> None:
    bpy = scene.bpy
    collection = from_library(scene, tmp_path, "collections", "Collection")
    bpy.context.scene.collection.children.link(collection)
    target = next(o for o in collection.all_objects if o.name == "Väse")
    bpy.context.view_layer.objects.active = target
    with pytest.raises(RuntimeError, match="The object 'Väse' stays in its library, because only a linked collection"):
        bpy.ops.mfo.mend(kind="make_local")
