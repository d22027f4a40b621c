# SPDX-License-Identifier: Apache-2.0
"""The check of several listed materials: each finding names its own, and each button mends its own."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from .found import check, stopping
from .test_libraries import from_library


@pytest.fixture
def listed(scene: SimpleNamespace) -> SimpleNamespace:
    """Cube and floor, both listed; the cube, which is the active object, has no fault."""
    bpy = scene.bpy
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    bpy.context.object.name = "Floor"
    bpy.context.object.data.materials.append(bpy.data.materials["Glaze"].copy())
    bpy.context.object.active_material.name = "Wood"
    bpy.context.scene.mfo.reference_path = scene.reference
    assert bpy.ops.mfo.list_materials() == {"FINISHED"}
    bpy.context.view_layer.objects.active = bpy.data.objects["Väse"]
    return scene


def wood(scene: SimpleNamespace) -> Any:
    return scene.bpy.data.materials["Wood"].node_tree


def principled(tree: Any) -> Any:
    return next((node for node in tree.nodes if node.type == "BSDF_PRINCIPLED"), None)


def mend(scene: SimpleNamespace, kind: str) -> str:
    """Press the only button of this kind that is not of the active material; returns what it was beside."""
    ((found, fix),) = ((f, fix) for f in check(scene) for fix in f.fixes if fix.kind == kind)
    assert fix.of is not None
    name, slot = fix.of
    assert scene.bpy.ops.mfo.mend(kind=kind, argument=fix.argument, object=name, slot=slot) == {"FINISHED"}
    return found.sentence


def test_what_stops_another_than_the_active_one_is_found_and_mended(listed: SimpleNamespace) -> None:
    tree = wood(listed)
    hair = tree.nodes.new("ShaderNodeBsdfHair")
    tree.links.new(hair.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Surface"])
    assert len(stopping(listed)) == 1
    assert "'Wood'" in mend(listed, "principled")
    assert stopping(listed) == {}
    glaze = listed.bpy.data.materials["Glaze"].node_tree
    assert len([n for n in glaze.nodes if n.type == "BSDF_PRINCIPLED"]) == 1  # the active one stays


def test_a_driver_of_each_has_its_own_line_and_button(listed: SimpleNamespace) -> None:
    for name in ("Wood", "Glaze"):
        principled(listed.bpy.data.materials[name].node_tree).inputs["Metallic"].driver_add("default_value")
    found = [f for f in check(listed) if f.fixes and f.fixes[0].kind == "remove_driver"]
    assert [f.sentence.partition(":")[0] for f in found] == ["'Wood'", "'Glaze'"]
    assert [f.fixes[0].of for f in found] == [("Floor", 0), ("Väse", 0)]
    fix = found[0].fixes[0]
    listed.bpy.ops.mfo.mend(kind=fix.kind, argument=fix.argument, object=fix.of[0], slot=fix.of[1])
    left = [f.sentence for f in check(listed) if f.fixes and f.fixes[0].kind == "remove_driver"]
    assert left == [found[1].sentence]


def test_a_shared_one_gets_a_single_user_that_stays_listed(listed: SimpleNamespace) -> None:
    bpy = listed.bpy
    twin = bpy.data.objects.new("Twin", bpy.data.objects["Floor"].data)
    bpy.context.scene.collection.objects.link(twin)
    mend(listed, "single_user")
    assert twin.active_material.name == "Wood"
    own = bpy.data.objects["Floor"].active_material
    assert own != twin.active_material
    assert own in [entry.material for entry in bpy.context.scene.mfo.targets]
    assert bpy.data.objects["Väse"].active_material.name == "Glaze"


def test_one_of_a_library_is_made_local(listed: SimpleNamespace, tmp_path: Any) -> None:
    floor = listed.bpy.data.objects["Floor"]
    floor.active_material = from_library(listed, tmp_path, "materials", "Wood")
    assert listed.bpy.ops.mfo.list_materials() == {"FINISHED"}
    mend(listed, "make_local")
    assert floor.active_material.library is None
    assert stopping(listed) == {}


def test_what_is_not_ticked_is_not_looked_at(listed: SimpleNamespace) -> None:
    principled(wood(listed)).inputs["Metallic"].driver_add("default_value")
    entries = listed.bpy.context.scene.mfo.targets
    next(entry for entry in entries if entry.material.name == "Wood").use = False
    assert not [f for f in check(listed) if "Wood" in f.sentence]
    for entry in entries:
        entry.use = False
    assert list(stopping(listed)) == [
        "No material of the list is ticked: tick those that are to be fitted, or fit one material."
    ]
    assert listed.bpy.ops.mfo.check() == {"FINISHED"}


def test_everything_of_all_comes_with_the_button(listed: SimpleNamespace) -> None:
    """The export's own findings, too; nothing need be active."""
    from blender_addon.check import preflight

    bpy = listed.bpy
    bpy.data.objects["Floor"].hide_render = True
    check(listed)
    bpy.context.view_layer.objects.active = None
    assert bpy.ops.mfo.check() == {"FINISHED"}
    assert preflight.is_thorough
    (hidden,) = (f for f in preflight.findings if "hidden in the render" in f.sentence)
    assert [(fix.kind, fix.of) for fix in hidden.fixes] == [("show_in_render", ("Floor", 0))]
    assert bpy.ops.mfo.mend(kind="show_in_render", object="Floor") == {"FINISHED"}
    assert bpy.ops.mfo.check() == {"FINISHED"}
    assert not [f for f in preflight.findings if f.level == "stops"], preflight.findings
    bpy.data.objects["Floor"].location.z = -1000.0  # which only rays tell
    assert bpy.ops.mfo.check() == {"FINISHED"}
    assert [f.sentence for f in preflight.findings if f.level == "stops"] == [
        "The camera does not see 'Floor': move it into the frame."
    ]


def test_fifty_take_no_longer_than_a_window_can_wait(listed: SimpleNamespace) -> None:
    """Made by a timer after each change."""
    from blender_addon.check.checks import quick_check

    bpy = listed.bpy
    cube = bpy.data.objects["Väse"]
    for number in range(48):
        twin = bpy.data.objects.new(f"Twin {number}", cube.data.copy())
        bpy.context.scene.collection.objects.link(twin)
        twin.active_material = bpy.data.materials["Glaze"].copy()
        entry = bpy.context.scene.mfo.targets.add()
        entry.object, entry.material = twin, twin.active_material
    began = time.process_time()
    quick_check(bpy.context.scene, bpy.context.view_layer)
    assert time.process_time() - began < 0.25  # 0.04 s on one core; the time between two checks
