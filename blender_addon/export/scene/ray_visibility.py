# SPDX-License-Identifier: GPL-3.0-or-later
"""Which rays find an object, and what an object has that no ray of the fit does."""

from __future__ import annotations

import bpy

from ...versions import cycles_settings, divides_adaptively
from ..audit.object_table import OBJECT_CYCLES
from ..audit.rules import name_settings
from ..findings import Findings
from ..meshes.read_mesh import material_of_slot
from ..render_state import shown_by


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


def note_visibility(instance: bpy.types.DepsgraphObjectInstance, findings: Findings) -> None:
    """Name what of an instance is left out."""
    item, parent = instance.object, shown_by(instance)
    name_settings(OBJECT_CYCLES, cycles_settings(item), item.name, findings)
    if any(divides_adaptively(modifier, item) for modifier in item.modifiers):
        findings.note(
            f"Adaptive Subdivision of '{item.name}' is left out: its mesh has the modifier's level for renders."
        )
    for system in item.particle_systems:
        if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
            findings.note(f"The hair '{system.name}' of '{item.name}' is left out.")
    if any(each.is_holdout or each.is_shadow_catcher for each in (item, parent)):
        findings.note(f"Object '{item.name}' is a holdout or shadow catcher; in the fit it is an object.")
