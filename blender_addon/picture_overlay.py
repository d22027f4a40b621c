# SPDX-License-Identifier: GPL-3.0-or-later
"""How the reference lies over the camera's view, as the scene keeps it."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

from contextlib import suppress

import bpy
from bpy.props import EnumProperty, FloatProperty

from .pictures import overlay


def _changed(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    with suppress(RuntimeError):  # a picture that cannot be read any more goes; the panel's button says why
        overlay.change(settings.id_data)


_SHARE = {"min": 0.0, "max": 1.0, "default": 0.5, "subtype": "FACTOR", "update": _changed}


class MFO_PG_overlay(bpy.types.PropertyGroup):
    """The reference against the view."""

    mode: EnumProperty(
        name="Compare",
        description="How the reference lies over the camera's view",
        items=(
            ("BLEND", "Blend", "The reference, seen through"),
            ("SPLIT", "Split", "The reference on the left of a line, the scene on the right"),
            (
                "DIFFERENCE",
                "Difference",
                "Grey where the scene looks as the reference does, lighter where the scene is brighter, darker where "
                "it is darker",
            ),
        ),
        update=_changed,
    )
    opacity: FloatProperty(
        name="Opacity",
        description="How much of the reference is seen over the camera's view",
        **_SHARE,
    )
    line: FloatProperty(
        name="Line",
        description="Where the reference ends and the scene begins, from the left",
        **_SHARE,
    )
