# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels, in the order of the work, in the sidebar of the 3D view and in the Material properties.

`draw` only reads: properties, icons and findings that exist already. It touches no file and computes nothing.
"""

from __future__ import annotations

import bpy

from . import check, compare, history, parameters, reference, result, run
from .menu import MFO_MT_material_fit

_BODIES = (check.Check, parameters.Parameters, run.Run, compare.Compare, result.Result, history.History)
_PLACES = {
    "fit": {"bl_space_type": "VIEW_3D", "bl_region_type": "UI", "bl_category": "Material Fit"},
    "properties": {"bl_space_type": "PROPERTIES", "bl_region_type": "WINDOW", "bl_context": "material"},
}


def _panels(place: str) -> list[type]:
    """The panel of one place and its sub-panels."""
    root = f"MFO_PT_{place}"
    settings: dict[str, object] = {"bl_idname": root, **_PLACES[place]}
    made = [type(root, (reference.Reference, bpy.types.Panel), settings)]
    for body in _BODIES:
        name = f"{root}_{body.__name__.lower()}"
        settings = {"bl_idname": name, "bl_parent_id": root, **_PLACES[place]}
        made.append(type(name, (body, bpy.types.Panel), settings))
    return made


CLASSES = (history.MFO_UL_history, MFO_MT_material_fit, *_panels("fit"), *_panels("properties"))
