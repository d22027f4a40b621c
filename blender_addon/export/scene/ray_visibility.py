# SPDX-License-Identifier: GPL-3.0-or-later
"""Which rays find an object, and as what: by Ray Visibility and by Light Path; what of it no ray of the fit finds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import bpy

from ...probe.light_path import BEHIND
from ...versions import cycles_settings, divides_adaptively
from ..audit.object_table import OBJECT_CYCLES
from ..audit.rules import name_settings
from ..findings import Findings
from ..material_model import Material
from ..materials.baked_material import EMISSION
from ..meshes.read_mesh import material_of_slot
from ..render_state import shown_by
from .scene_data import Hidden, SceneData

NOTHING = "nothing"  # id of a surface that all light passes
# By kinds of rays: they pass an object that is hidden from all of these. A bend through a surface is glossy, too
PASSING = {"scattered": {"diffuse"}, "glossy": {"glossy"}, "transmission": {"glossy", "transmission"}}


def camera_misses(instance: bpy.types.DepsgraphObjectInstance, view_layer: bpy.types.ViewLayer) -> bool:
    """Whether rays of the camera pass an instance: by ray visibility, its own or its parent's, or as Indirect Only."""
    parent = shown_by(instance)
    if parent.original.indirect_only_get(view_layer=view_layer) and not parent.original.holdout_get(
        view_layer=view_layer
    ):
        return True
    return not (instance.object.visible_camera and parent.visible_camera)


def shadow_transmission(instance: bpy.types.DepsgraphObjectInstance, slot: int) -> float | None:
    """What shadow rays keep at a slot's faces, None where its material says it."""
    if not (instance.object.visible_shadow and shown_by(instance).visible_shadow):
        return 1.0
    material = material_of_slot(instance.object, slot)
    return None if material is None or material.use_transparent_shadow else 0.0


def hidden_from(instance: bpy.types.DepsgraphObjectInstance) -> tuple[str, ...]:
    """The kinds of rays, of those that a surface has sent on, which pass an instance."""
    kinds, owners = ("diffuse", "glossy", "transmission"), (instance.object, shown_by(instance))
    return tuple(kind for kind in kinds if not all(getattr(each, f"visible_{kind}") for each in owners))


def is_cut(instance: bpy.types.DepsgraphObjectInstance) -> bool:
    """Whether pictures show no surface where an instance is, but what is behind it or nothing."""
    return any(each.is_holdout or each.is_shadow_catcher for each in (instance.object, shown_by(instance)))


def note_visibility(
    instance: bpy.types.DepsgraphObjectInstance, findings: Findings, *, is_fitted: bool = False
) -> None:
    """Name what of an instance is left out; of one that is fitted some of that is an error."""
    item = instance.object
    name_settings(OBJECT_CYCLES, cycles_settings(item), item.name, findings)
    if any(divides_adaptively(modifier, item) for modifier in item.modifiers):
        findings.note(
            f"Adaptive Subdivision of '{item.name}' is left out: its mesh has the modifier's level for renders."
        )
    for system in item.particle_systems:
        if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
            findings.note(f"The hair '{system.name}' of '{item.name}' is left out.")
    if is_cut(instance) and is_fitted:
        findings.error(
            f"Object '{item.name}' is a holdout or shadow catcher, so pictures do not show its material: turn that off "
            "in Object Properties > Visibility."
        )
    elif is_cut(instance):
        findings.note(f"Object '{item.name}' is a holdout or shadow catcher; in the fit it is an object.")


def scattered_id(identifier: str) -> str:
    """The id of what scattered rays find at a surface that has others for other rays."""
    return f"{identifier}_scattered"


def put_looks(
    data: SceneData,
    identifier: str,
    name: str,
    looks: Mapping[str, str],
    shapes: Sequence[str],
    findings: Findings,
) -> None:
    """Let rays find a material as it was baked for them, by the ids of its `looks`.

    Where it is nothing to the camera that passes its `shapes`; else the camera has what scattered rays find. Behind a
    pane that bends its rays a target would be fitted on whole light paths.
    """
    scattered = scattered_id(identifier)
    if scattered not in data.materials:  # its bake has failed
        return
    others = {rays: look for rays, look in looks.items() if rays != "camera"}
    if BEHIND in others and _walks_below(data, data.materials[scattered]):  # its front is what is mostly seen
        findings.note(
            f"Material '{name}' is another from behind: light travels below its surface, and in the fit both sides are "
            "as its front is."
        )
        data.materials[identifier] = data.materials.pop(scattered)
        return
    data.materials[identifier] = _by_ray(data, scattered, {"scattered": scattered} | others, findings)
    if "camera" not in looks:
        return
    if data.materials[looks["camera"]].model != "null":
        findings.note(
            f"Material '{name}' is another to the camera (Light Path): before the target the fit has it as diffuse "
            "rays see it."
        )
    how = {"camera_hidden" if data.materials[looks["camera"]].model == "null" else "seen_otherwise": True}
    data.shapes[:] = [replace(s, **how) if s.identifier in shapes else s for s in data.shapes]


def hide_from_rays(data: SceneData, findings: Findings) -> None:
    """Let rays pass the shapes that are hidden from them; what glows is named, for lights are sampled for all."""
    for number, shape in enumerate(data.shapes):
        if not shape.hidden.rays:
            continue
        rays = set(shape.hidden.rays)
        if shape in data.emitting:
            note_hidden(shape.hidden, findings)
            continue
        looks = {kind: NOTHING if hides <= rays else shape.bsdf for kind, hides in PASSING.items()}
        looks |= dict.fromkeys(("camera", "shadow"), shape.bsdf)
        identifier = "_".join((shape.bsdf, "without", *shape.hidden.rays))
        data.materials |= {NOTHING: Material(NOTHING, "null"), identifier: _by_ray(data, shape.bsdf, looks, findings)}
        data.shapes[number] = replace(shape, bsdf=identifier)


def note_hidden(hidden: Hidden, findings: Findings) -> None:
    """Name an object that rays find in the fit and not in Cycles."""
    if hidden.rays:
        findings.note(f"Object '{hidden.owner}' is hidden from {', '.join(hidden.rays)} rays; in the fit it is not.")


def _walks_below(data: SceneData, material: Material) -> bool:
    """Whether light travels below a surface; of a mix of bakes it does not."""
    return bool((data.materials[material.parts[0].bsdf] if material.model == "bumped" else material).scattering)


def _by_ray(data: SceneData, like: str, looks: Mapping[str, str], findings: Findings) -> Material:
    """A material of several looks that glows as the one of the id `like` does."""
    material = data.materials[like]
    if _walks_below(data, material):
        findings.note(
            f"Material '{material.name}' is another to some rays: its Subsurface is shown as diffuse, no light travels "
            "below the surface."
        )
    emission = {name: socket for name, socket in material.sockets.items() if name in EMISSION}
    return Material(
        material.name, "by_ray", emission, emission_is_dimmed=material.emission_is_dimmed, by_ray=dict(looks)
    )
