# SPDX-License-Identifier: GPL-3.0-or-later
"""The first panel: which material, and the reference with what was understood of it."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..check import preflight
from ..check.picture_checks import asks_view
from ..check.ticked_slots import slot_of
from ..pictures import overlay
from ..running import running_job
from ..sentences.translated import translated, word
from ..text_width import text_width, wrapped
from .cycles_render import draw_render
from .layout import (
    BOX,
    BUTTON,
    ICON,
    LABEL,
    NAMED_NUMBER,
    UNIT,
    fits,
    names_of,
    room,
    side_by_side,
)
from .part import draw_part
from .thumbnails import thumbnail

_FIELD = 40.0  # of a path's field: margins and the button of the file browser, pixels at a scale of 1
_IMAGE = 120.0  # of the choice of an image: its buttons, as above
_ROWS, _SHARE = 4.0, 0.37  # of a picture of several: its height in rows of the interface, its share of the width


class Reference:
    """What is fitted and to which picture."""

    bl_label = "Material Fit"

    def draw(self, context: bpy.types.Context) -> None:
        """Draw the target and the choice of the reference."""
        preflight.watch(context)
        layout, settings = self.layout, context.scene.mfo  # type: ignore[attr-defined]  # from Panel
        _draw_target(layout, context)
        column = layout.column()
        column.enabled = running_job.current is None
        column.label(text="Picture to match")
        column.row().prop(settings, "reference_source", expand=True)
        if settings.reference_source == "FILE":
            _draw_path(column, context, settings, "reference_path")
        else:
            column.template_ID(settings, "reference_image", open="image.open")
            image = settings.reference_image
            if image is not None and not fits(context, room(context) - _IMAGE, image.name):
                _draw_name(column, context, image.name)
        _draw_pictures(column, context, settings)
        _draw_overlay(layout.column(align=True), context, settings.overlay)
        if asks_view(context.scene):
            question = column.column(align=True)
            question.label(text="How was it made?")
            row = side_by_side(question, context, *names_of(settings, "reference_view"), margins=BUTTON)
            row.prop(settings, "reference_view", expand=True)


def _draw_pictures(column: bpy.types.UILayout, context: bpy.types.Context, settings: bpy.types.PropertyGroup) -> None:
    """What counts of the picture; of several what each shows, too; a button to add one."""
    first, pictures = settings.first_picture, settings.pictures
    box = column
    if pictures:
        box = column.box().column(align=True)
        path = settings.reference_path if settings.reference_source == "FILE" else ""
        _draw_what_it_shows(box, context, first, path)
    draw_part(box, context, first.part)
    for index, picture in enumerate(pictures):
        box = column.box().column(align=True)
        _draw_what_it_shows(box, context, picture, picture.path, index)
        draw_part(box, context, picture.part, index + 2)
    column.operator("mfo.add_picture", text="Add Another Picture", icon="ADD")
    if context.window_manager.mfo_runtime.cycles_of_reference:
        draw_render(column, context)


def _draw_overlay(column: bpy.types.UILayout, context: bpy.types.Context, over: bpy.types.PropertyGroup) -> None:
    """The reference over the camera's view, and how it lies there."""
    shown = overlay.is_shown(context.scene.camera)
    column.operator(
        "mfo.overlay_reference", text="Over the View", icon="HIDE_OFF" if shown else "HIDE_ON", depress=shown
    )
    if not shown:
        return
    row = side_by_side(column, context, *names_of(over, "mode"), margins=BUTTON)
    row.prop(over, "mode", expand=True)
    if over.mode == "BLEND":
        column.prop(over, "opacity", slider=True)
        return
    if over.mode == "SPLIT":
        column.prop(over, "line", slider=True)
    shading = getattr(context.space_data, "shading", None)
    if shading is not None and shading.type != "RENDERED":
        turn = column.operator("wm.context_set_enum", text="Render the View", icon="SHADING_RENDERED")
        turn.data_path, turn.value = "space_data.shading.type", "RENDERED"


def _draw_path(
    layout: bpy.types.UILayout, context: bpy.types.Context, owner: bpy.types.bpy_struct, path: str, taken: float = 0.0
) -> None:
    """The field of a path; `taken` is the width of what stands beside it."""
    layout.prop(owner, path, text="")
    given = getattr(owner, path)
    if not fits(context, room(context) - taken - _FIELD, given):
        _draw_name(layout, context, Path(given).name, taken=taken)


def _draw_name(layout: bpy.types.UILayout, context: bpy.types.Context, name: str, taken: float = 0.0) -> None:
    """All of a name, below a field that cuts it."""
    column = layout.column(align=True)
    column.scale_y = 0.8
    for line in wrapped(context, name, room(context) - taken - LABEL):
        column.label(text=line, translate=False)


def _draw_what_it_shows(
    box: bpy.types.UILayout,
    context: bpy.types.Context,
    picture: bpy.types.PropertyGroup,
    path: str,
    index: int | None = None,
) -> None:
    """The settings of one of several pictures, beside the picture itself by which it is told from the others."""
    row = box.row(align=True)
    row.prop(picture, "use", text=translated(f"Picture {1 if index is None else index + 2}"))
    if index is not None:
        row.operator("mfo.remove_picture", text="", icon="X").index = index
    rest, taken = box.column(align=True), BOX
    rest.active = picture.use
    numbers = (f"{word('EV')} {picture.exposure:.3f}", f"{word('Frame')} {picture.frame}")
    icon = thumbnail(Path(bpy.path.abspath(path))) if path else 0
    if icon:
        inner = room(context) - BOX
        if fits(context, inner * (1.0 - _SHARE) - NAMED_NUMBER, *numbers):
            split, taken = rest.split(factor=_SHARE), BOX + inner * _SHARE
            split.template_icon(icon_value=icon, scale=min(inner * _SHARE / UNIT, _ROWS))
            rest = split.column(align=True)
        else:
            rest.template_icon(icon_value=icon, scale=_ROWS)
    rest.prop(picture, "camera", text="", icon="CAMERA_DATA")
    row = side_by_side(rest, context, *numbers, margins=NAMED_NUMBER, taken=taken)
    row.prop(picture, "exposure", text="EV")
    row.prop(picture, "frame")
    if index is not None:
        _draw_path(rest, context, picture, "path", taken=taken)
        if not path:
            rest.operator("mfo.render_picture", text="Render...", icon="RENDER_STILL").index = index
        if len(bpy.data.scenes) > 1:
            rest.prop(picture, "scene", text="", icon="SCENE_DATA")


def _draw_target(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    if context.scene.mfo.targets:
        _draw_targets(layout, context)
        return
    obj = context.object
    if obj is None:
        layout.label(text="Select an object", icon="ERROR")
    else:
        material = obj.active_material
        shown = material.name if material is not None else word("No material")
        row = side_by_side(layout, context, obj.name, shown)
        row.label(text=obj.name, icon="OBJECT_DATA", translate=False)  # a name is nobody's to translate
        if material is None:
            row.label(text="No material", icon="ERROR")
        else:
            row.label(text=material.name, icon="MATERIAL", translate=False)
    layout.operator("mfo.list_materials", icon="MATERIAL")


def _beside(box: bpy.types.UILayout, context: bpy.types.Context, first: str, second: str) -> bpy.types.UILayout:
    """Where two names with icons belong: halves of a line, as much of one as each needs, or two lines."""
    widths = [text_width(context, name) + ICON for name in (first, second)]
    whole = room(context) - BOX
    if max(widths) > 0.5 * whole and sum(widths) <= whole:
        return box.split(factor=widths[0] / sum(widths), align=True)
    return side_by_side(box, context, first, second, taken=BOX)


def _draw_targets(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The materials that the camera sees, each with a box to tick, and the way back to one."""
    box = layout.box().column(align=True)
    row = box.row(align=True)
    row.label(text="Fit together")
    row.operator("mfo.list_materials", text="", icon="FILE_REFRESH")
    row.operator("mfo.clear_materials", text="", icon="X")
    for entry in context.scene.mfo.targets:
        is_there = slot_of(context.scene, entry) is not None
        name = entry.material.name if entry.material is not None else word("No material")
        row = _beside(box, context, name, entry.object.name if is_there else word("Not there"))
        row.alert = entry.use and not is_there
        row.prop(entry, "use", text=name, translate=False)
        if is_there:
            row.label(text=entry.object.name, icon="OBJECT_DATA", translate=False)
        else:
            row.label(text="Not there", icon="ERROR")
    box.prop(context.scene.mfo, "queue")
