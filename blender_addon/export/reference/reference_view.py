# SPDX-License-Identifier: GPL-3.0-or-later
"""How a display picture was made: the view it went through, which no PNG or JPEG tells and only the user knows."""

from __future__ import annotations

import bpy

from ..findings import ExportError, Fix

# answers to the question: rendered in this scene, or a photograph or a render under Standard
SCENE, STANDARD = "scene", "standard"
REFERENCE_VIEWS = (SCENE, STANDARD)
_WITHOUT_VIEW = ("OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR")  # output formats that are written scene-linear


def output_view(scene: bpy.types.Scene) -> tuple[bpy.types.ColorManagedViewSettings, str]:
    """The view and the display device under which the scene's output writes a display picture.

    They are the output's own where its colour management is set to Override, else the scene's.
    """
    output = scene.render.image_settings
    if output.color_management == "OVERRIDE" and output.file_format not in _WITHOUT_VIEW:
        return output.view_settings, output.display_settings.display_device
    return scene.view_settings, scene.display_settings.display_device


def mixed_by(scene: bpy.types.Scene) -> list[str]:
    """What in the scene's view no formula undoes, in words: all but exposure, gamma and the sRGB curve."""
    view, device = output_view(scene)
    found = []
    if view.view_transform != "Standard":
        found.append(f"the view transform {view.view_transform}")
    if view.look not in ("None", ""):
        found.append(f"the look {view.look}")
    if view.use_curve_mapping:
        found.append("view curves")
    if getattr(view, "use_white_balance", False):
        found.append("a white balance")
    if device != "sRGB":
        found.append(f"the display device {device}")
    return found


def needs_table(scene: bpy.types.Scene, name: str, made: str) -> bool:
    """Whether the view of the display picture `name`, by the answer `made`, is one that no formula undoes.

    Raises
    ------
    ExportError
        If it is that of another display than sRGB, whose colours the comparison does not know.
    """
    device = output_view(scene)[1]
    if made == SCENE and device != "sRGB":
        raise ExportError(
            f"The reference {name} holds display colours and the scene is shown on the display device {device}: render "
            "it as OpenEXR or for the display sRGB; if it is a photograph or an sRGB picture, choose Photo or Standard "
            "(--reference-view standard).",
            Fix("reference_view", STANDARD),
        )
    return made == SCENE and bool(mixed_by(scene))


def view_note(scene: bpy.types.Scene, name: str, made: str) -> str:
    """What was taken for granted of the display picture `name`, or nothing where both answers are the same."""
    mixed = mixed_by(scene)
    if not mixed:
        return ""
    words = " and ".join(mixed)
    if made == SCENE:
        return (
            f"The reference {name} is taken as rendered in this scene: pictures are compared under its view as it is "
            f"now ({words}). If it is a photograph or was rendered under Standard, choose Photo or Standard "
            "(--reference-view standard)."
        )
    return (
        f"The reference {name} is taken as a photograph or a render under Standard: {words} of the scene "
        f"{'does' if len(mixed) == 1 else 'do'} not count, its exposure and gamma do. If it was rendered in this "
        "scene, choose In This Scene (--reference-view scene)."
    )
