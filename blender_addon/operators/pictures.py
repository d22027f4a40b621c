# SPDX-License-Identifier: GPL-3.0-or-later
"""`mfo.show_pictures`, `mfo.open_report` and `mfo.copy_values`."""

# pyright: reportInvalidTypeForm=false
# Blender reads properties from annotations

from collections.abc import Iterable
from contextlib import suppress
from functools import partial
from pathlib import Path

import bpy
from bpy.props import StringProperty

from ..pictures.comparison import comparison_image, picture_image, split_image
from ..result.report_page import shown_report
from ..sentences.translated import translated

_DRAWN = 0.3  # seconds until a new window has its size


class _JobOperator:
    """Finds the job folder: the one given, else that of the last fit, else the one applied to the active material."""

    def folder(self, context: bpy.types.Context) -> str:
        given = self.job_folder  # type: ignore[attr-defined]  # declared by the operator
        return bpy.path.abspath(given) if given else job_folder_of(context)

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """In windows only where a job is known."""
        if not bpy.app.background and not job_folder_of(context):
            cls.poll_message_set(translated("There is no result yet; run a fit"))  # type: ignore[attr-defined]
            return False
        return True


class MFO_OT_show_pictures(_JobOperator, bpy.types.Operator):
    """Show pictures of the fit in an Image Editor, in a new window if none is open"""

    bl_idname = "mfo.show_pictures"
    bl_label = "Compare Pictures"
    bl_options = {"REGISTER", "UNDO"}

    job_folder: StringProperty(name="Job Folder", description="Empty: the last fit", options={"HIDDEN", "SKIP_SAVE"})
    show: StringProperty(
        name="Show",
        description='"strip", "split" or the name of one picture, as reference, start, result, difference or cycles',
        default="strip",
        options={"HIDDEN", "SKIP_SAVE"},
    )

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        """A tooltip for each kind of view."""
        return {
            "strip": "Show reference, result and difference side by side in an Image Editor",
            "split": "Show reference and result as one picture with a line between them that the slider moves",
        }.get(properties.show, f"Show the picture {properties.show} at full size in an Image Editor")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Load the pictures, build the image, show it."""
        pictures = Path(self.folder(context)) / "pictures"
        try:
            if self.show == "strip":
                image = comparison_image(pictures)
            elif self.show == "split":
                image = split_image(pictures, context.window_manager.mfo_runtime.split)
            else:
                image = picture_image(pictures, Path(self.show).name)
        except OSError as error:
            self.report({"ERROR"}, translated(f"The pictures of the fit cannot be read ({error}): run the fit again."))
            return {"CANCELLED"}
        for area in _image_editors(context):
            area.spaces.active.image = image
            area.tag_redraw()
        return {"FINISHED"}


class MFO_OT_open_report(_JobOperator, bpy.types.Operator):
    """Open the report of the fit in the web browser"""

    bl_idname = "mfo.open_report"
    bl_label = "Open Report"
    bl_options = {"REGISTER"}

    job_folder: StringProperty(name="Job Folder", description="Empty: the last fit", options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Hand index.html, in the user's language, to the system."""
        report = Path(self.folder(context)) / "index.html"
        if not report.is_file():
            self.report({"ERROR"}, translated(f"There is no report in {report.parent}: run the fit again."))
            return {"CANCELLED"}
        bpy.ops.wm.url_open(url=shown_report(report.absolute()).as_uri())
        return {"FINISHED"}


class MFO_OT_copy_values(bpy.types.Operator):
    """Copy the recovered values as text, one a line"""

    bl_idname = "mfo.copy_values"
    bl_label = "Copy Values"
    bl_options = {"REGISTER"}

    name: StringProperty(name="Name", description="Of one value; empty: all", options={"HIDDEN", "SKIP_SAVE"})

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Only with a result."""
        if not context.window_manager.mfo_runtime.has_result:
            cls.poll_message_set(translated("There is no result yet; run a fit"))
            return False
        return True

    @classmethod
    def description(cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        """Of one value what it was, is, and how sure."""
        row = context.window_manager.mfo_runtime.values.get(properties.name)
        if row is None:
            return translated("Copy all recovered values as text")
        said = translated(f"{row.name}: {row.start or 'unknown'} before, {row.result} recovered")
        return f"{said} ({translated(row.words)})" if row.words else said

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Put the lines on the clipboard."""
        rows = [row for row in context.window_manager.mfo_runtime.values if self.name in ("", row.name)]
        context.window_manager.clipboard = values_as_text(rows)
        self.report({"INFO"}, translated(f"Copied {len(rows)} values." if len(rows) != 1 else "Copied 1 value."))
        return {"FINISHED"}


def values_as_text(rows: Iterable[bpy.types.PropertyGroup]) -> str:
    """Recovered values as lines of text, colours as hex codes of sRGB."""
    return "\n".join(f"{row.name}: {row.result}" for row in rows)


def _image_editors(context: bpy.types.Context) -> list[bpy.types.Area]:
    """All Image Editors that are open; that of a new window where there is none, and none in background mode."""
    windows = context.window_manager.windows
    found = [area for window in windows for area in window.screen.areas if area.type == "IMAGE_EDITOR"]
    if not found and not bpy.app.background and context.window is not None:
        before = set(windows)
        bpy.ops.wm.window_new()
        for window in set(windows) - before:
            area = max(window.screen.areas, key=lambda a: a.width * a.height)
            area.type = "IMAGE_EDITOR"
            found.append(area)
            bpy.app.timers.register(partial(_fill, window, area), first_interval=_DRAWN)
    return found


def _fill(window: bpy.types.Window, area: bpy.types.Area) -> None:
    """Show the picture of a new window as large as the window, which has to be drawn once to have a size."""
    if window not in list(bpy.context.window_manager.windows) or area not in list(window.screen.areas):
        return  # closed at once
    region = next(region for region in area.regions if region.type == "WINDOW")
    with bpy.context.temp_override(window=window, area=area, region=region), suppress(RuntimeError):
        bpy.ops.image.view_all(fit_view=True)


def job_folder_of(context: bpy.types.Context) -> str:
    """Folder of the last result, else of what was applied to the active material, else empty."""
    runtime = context.window_manager.mfo_runtime
    if runtime.has_result:
        return runtime.job_folder
    material = context.object.active_material if context.object else None
    return material.mfo.job_folder if material else ""


CLASSES = (MFO_OT_show_pictures, MFO_OT_open_report, MFO_OT_copy_values)
