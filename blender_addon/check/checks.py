# SPDX-License-Identifier: GPL-3.0-or-later
"""What is fine, ignored, still to choose, or stops a fit, as plain data; looks at no mesh and no pixel, so it is quick.

The export itself checks more (geometry, lights, visibility): `mfo.check` adds what it says.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace

import bpy

from ..export.camera.read_camera import has_camera, note_picture_settings
from ..export.camera.render_region import pictured_region, pictured_size, render_region
from ..export.findings import Findings, Fix
from ..export.fitted_slot import FittedSlot
from ..export.images.image_pixels import without_pixels
from ..export.materials.read_material import read_target
from ..export.meshes.read_mesh import MESH_TYPES
from ..export.nodes.shader_graph import source_of
from ..export.nodes.target_shader import TargetShader, fits_all_leaves, target_shader
from ..export.render_state import instanced_objects, rendered_objects
from ..graph_values.mix_values import default_values, inside_values
from ..properties import SOCKET_ITEMS, SOCKETS_START, crossed_limits, node_value_key
from ..result.animated_sockets import DRIVER, REPLACE, animation_of
from ..result.local_copy import unwritable
from ..versions import overrides_of
from .finding import FINE, IGNORED, STOPS, TO_CHOOSE, Finding
from .picture_checks import more_pictures, reference, reference_size, used_pictures
from .ticked_slots import NONE_TICKED, left_out, ticked_slots

REGION_ALONE = "Render Region is on, and the picture shows the region alone."
REGION_IN_FRAME = "Render Region is on: where the picture is empty beside the region, the region alone counts."
SHOWN_INSIDE = 3  # values of nodes that the check names
# details of a lobe, and the socket that says how much there is of it
AMOUNT_OF = {
    **dict.fromkeys(("Coat Roughness", "Coat IOR", "Coat Tint"), "Coat Weight"),
    **dict.fromkeys(("Sheen Roughness", "Sheen Tint"), "Sheen Weight"),
    **dict.fromkeys(("Subsurface Radius", "Subsurface Scale"), "Subsurface Weight"),
    "Thin Film IOR": "Thin Film Thickness",
    "Anisotropic Rotation": "Anisotropic",
    "Emission Color": "Emission Strength",
    "Absorption Color": "Absorption Density",
}
_FITTED = {name for _, name, *_ in SOCKET_ITEMS}


def quick_check(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> tuple[Finding, ...]:
    """Everything that can be known about the next fit without reading geometry; worst first.

    It is of the ticked materials where several are listed, else of the active object's.
    """
    of_all = [*_picture(scene, view_layer), *reference(scene), *more_pictures(scene)]
    return in_order([*_targets(scene, view_layer), *(replace(found, of_all=True) for found in of_all)])


def from_export(findings: Findings) -> tuple[Finding, ...]:
    """The sentences of an export as lines of the check."""
    levels = [(STOPS, findings.errors), (IGNORED, findings.notes)]
    return tuple(Finding(level, s, findings.fixes[s]) for level, sentences in levels for s in sentences)


def in_order(found: list[Finding]) -> tuple[Finding, ...]:
    """Each sentence once: what stops the fit, what is still to choose, what is ignored, what is fine."""
    once = {finding.sentence: finding for finding in reversed(found)}
    levels = (STOPS, TO_CHOOSE, IGNORED, FINE)
    return tuple(f for level in levels for f in reversed(list(once.values())) if f.level == level)


def _targets(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> list[Finding]:
    if not scene.mfo.targets:
        target = view_layer.objects.active
        return _target(scene, view_layer, target, target.active_material_index if target is not None else 0)
    slots = ticked_slots(scene)
    gone = left_out(scene)
    found = [Finding(IGNORED if slots else STOPS, sentence) for sentence in gone]
    found += [] if slots or gone else [Finding(STOPS, NONE_TICKED)]
    for each in slots:
        found += [_named(finding, each) for finding in _target(scene, view_layer, each.object, each.slot)]
    return found


def _named(finding: Finding, fitted: FittedSlot) -> Finding:
    """A line with the name of the material that it is of, unless it names it or the object; its buttons mend that."""
    name = fitted.material.name if fitted.material is not None else ""
    is_named = any(f"'{each}'" in finding.sentence for each in (name, fitted.object.name))
    sentence = finding.sentence if is_named else f"'{name}': {finding.sentence}"
    of = fitted.object.name, fitted.slot
    return replace(finding, sentence=sentence, fixes=tuple(replace(fix, of=of) for fix in finding.fixes))


def _target(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, target: bpy.types.Object | None, slot: int
) -> list[Finding]:
    if target is None or target.type not in MESH_TYPES:
        what = "No object is active" if target is None else f"'{target.name}' has no faces"
        fixes = [Fix("select", item.name) for item in scene.objects if _can_be_fitted(item, view_layer)]
        return [Finding(STOPS, f"{what}: select the object whose material is to be fitted.", tuple(fixes[:3]))]
    findings = Findings()
    if target.name_full not in rendered_objects(view_layer) | instanced_objects(view_layer):
        findings.error(f"Object '{target.name}' is hidden in the render: show it.", Fix("show_in_render"))
    material = target.material_slots[slot].material if slot < len(target.material_slots) else None
    with without_pixels():
        read_target(material, target.name, slot, findings)
    found = list(from_export(findings))
    if material is None or target_shader(material) is None:
        return found
    if unwritable(material):
        found.append(Finding(STOPS, unwritable(material), (Fix("make_local"),)))
    found += _animation(scene, material)
    others = _others_with(material, target, scene)
    if others:
        listed = ", ".join(others[:2]) + (f" and {len(others) - 2} more" if len(others) > 2 else "")
        sentence = f"Material '{material.name}' is also on {listed}: applied values change it there too."
        found.append(Finding(IGNORED, sentence, (Fix("single_user"),)))
    found += _free_values(scene, material, "".join(findings.errors))
    return found


def _animation(scene: bpy.types.Scene, material: bpy.types.Material) -> list[Finding]:
    target = target_shader(material)
    assert target is not None
    found = []
    for fitted, what in animation_of(target.sockets).items():
        if fitted not in _FITTED:
            continue
        name = target.own_name(fitted)
        if scene.mfo.animated == REPLACE:
            done = "the driver" if what == DRIVER else "the value at this frame"
            found.append(Finding(FINE, f"{name} has {what}: an apply replaces {done}."))
            continue
        fix = Fix("remove_driver", name) if what == DRIVER else Fix("replace_animation")
        sentence = f"{name} has {what}: it is fitted as it is at this frame, and an apply leaves it out."
        found.append(Finding(IGNORED, sentence, (fix,)))
    return found


def _others_with(material: bpy.types.Material, target: bpy.types.Object, scene: bpy.types.Scene) -> list[str]:
    """Names of other objects of the scene that have the material."""
    if material.users <= 1 and target.data.users <= 1:
        return []
    return [o.name for o in scene.objects if o != target and any(s.material == material for s in o.material_slots)]


def _free_values(scene: bpy.types.Scene, material: bpy.types.Material, said: str) -> list[Finding]:
    target = target_shader(material)
    assert target is not None
    sockets = {name: socket for name, socket in target.sockets.items() if name in _FITTED}
    linked = [name for name, socket in sockets.items() if source_of(socket) is not None]
    settings = scene.mfo
    found = [Finding(FINE, f"'{material.name}' has a {target.node.bl_label}.")]
    inside = _inside(settings, target, material)
    by_set = {"chosen": settings.sockets, "reduced": SOCKETS_START}
    if settings.parameter_set in by_set and settings.model == "blender_principled":
        wanted, is_chosen = by_set[settings.parameter_set], settings.parameter_set == "chosen"
        chosen = {name for key, name, *_ in SOCKET_ITEMS if key in wanted and name in sockets}
        of_others = is_chosen and bool(settings.targets) and len(settings.node_values) > 0
        if not chosen - set(linked) and not inside and not of_others:
            fix = (Fix("all_parameters"),)
            return [Finding(STOPS, "No value is chosen that has no link: choose at least one, or All.", fix)]
        linked = [name for name in linked if name in chosen]
        found += _without_effect(target, chosen)
        for name in crossed_limits(settings) if is_chosen else ():
            found.append(Finding(STOPS, f"The limits of {name} leave nothing: the least must be below the most."))
    linked = [target.own_name(name) for name in linked if f"{target.own_name(name)} of material" not in said]
    if inside:
        more = f" and {len(inside) - SHOWN_INSIDE} more" if len(inside) > SHOWN_INSIDE else ""
        where = "beside it" if target.is_mixed else "inside nodes"
        found.append(Finding(FINE, f"Fitted {where}: {', '.join(inside[:SHOWN_INSIDE])}{more}."))
    elif linked:
        sentence = f"Kept as nodes give it, not fitted: {', '.join(linked)}."
        found.append(Finding(FINE, sentence, tuple(Fix("unlink", name) for name in linked[:3])))
    return found


def _without_effect(target: TargetShader, chosen: Container[str]) -> list[Finding]:
    """Chosen details of a lobe that has no weight and gets none, and a strength that its colour stands for."""
    found = []
    for detail, amount in AMOUNT_OF.items():
        lobe = target.sockets.get(amount)
        if detail not in chosen or amount in chosen or lobe is None or source_of(lobe) is not None:
            continue
        if lobe.default_value == 0.0:
            names = target.own_name(detail), target.own_name(amount)
            sentence = "{} has no effect while {} is 0: give that a value, or choose it too.".format(*names)
            found.append(Finding(STOPS, sentence, (Fix("all_parameters"),)))
    color = target.sockets.get("Emission Color")
    if "Emission Strength" in chosen and color is not None and source_of(color) is None:
        sentence = "Emission Strength multiplies Emission Color, which has no link: choose that."
        found.append(Finding(STOPS, sentence, (Fix("all_parameters"),)))
    return found


def _inside(settings: bpy.types.PropertyGroup, target: TargetShader, material: bpy.types.Material) -> list[str]:
    """Names of the values inside the target's nodes, or of a mix the others', that the next fit changes."""
    if settings.model != "blender_principled" or settings.parameter_set == "reduced" or settings.preset == "paper":
        return []
    if settings.parameter_set == "chosen":
        keys = {value.name: node_value_key(settings, material, value.name) for value in inside_values(target)}
        return [name for name, key in keys.items() if key in settings.node_values]
    return [value.name for value in default_values(target, all_leaves=fits_all_leaves(material))]


def _picture(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> list[Finding]:
    findings, size = Findings(), reference_size(scene)
    is_camera = has_camera(scene, findings)
    if scene.mfo.pictures and all(one.camera is not None for one in used_pictures(scene)):
        findings = Findings()  # each has one of its own
    if is_camera:
        note_picture_settings(scene, findings, size)
    replaced = overrides_of(view_layer)
    if replaced:
        name, other = view_layer.name, replaced[0]
        sentence = f"View layer '{name}' replaces materials or the world by '{other}': remove the override."
        findings.error(sentence, Fix("no_override"))
    found = list(from_export(findings))
    if scene.render.engine != "CYCLES":
        engine = scene.render.engine.removeprefix("BLENDER_").replace("_", " ").title()
        sentence = f"The render engine is {engine}; the fit reproduces what Cycles shows."
        found.append(Finding(IGNORED, sentence, (Fix("cycles"),)))
    if is_camera and not findings.errors:
        width, height = pictured_size(scene.render, size)
        found.append(Finding(FINE, f"Camera '{scene.camera.name}', {width} x {height} pixels."))
        if render_region(scene.render) is not None:
            alone = pictured_region(scene.render, size) is not None
            sentence = REGION_ALONE if alone else REGION_IN_FRAME
            found.append(Finding(FINE, sentence, (Fix("whole_frame"),)))
    return found


def _can_be_fitted(item: bpy.types.Object, view_layer: bpy.types.ViewLayer) -> bool:
    has_faces = item.type in MESH_TYPES and item.name in view_layer.objects
    return has_faces and target_shader(item.active_material) is not None
