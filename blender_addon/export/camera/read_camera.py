# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene camera and the picture's size, as Cycles would use them."""

from __future__ import annotations

import bpy
import numpy as np

from ...versions import cycles_settings
from ..findings import Findings, Fix
from .camera_model import CAMERA_NOT_FINITE, Camera, PixelFilter
from .render_region import Size, picture_size, pictured_region, render_region, square_size


def read_camera(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, findings: Findings, picture: Size | None = None
) -> Camera | None:
    """Return the scene camera for a reference of the size `picture`, or None with an error in `findings`."""
    if not has_camera(scene, findings):
        return None
    evaluated = scene.camera.evaluated_get(depsgraph)
    data = evaluated.data
    render = scene.render
    name = scene.camera.name
    note_picture_settings(scene, findings, picture)
    width, height = picture_size(render)
    square_width, square_height = square_size(render)
    if (square_width, square_height) != (width, height):
        findings.note(
            f"Pixel aspect {render.pixel_aspect_x:g}:{render.pixel_aspect_y:g}: the reference is averaged from "
            f"{width}x{height} to {square_width}x{square_height} square pixels."
        )
    world = np.array(evaluated.matrix_world, dtype=np.float64)
    if not np.isfinite(world).all():
        findings.error(CAMERA_NOT_FINITE)
        return None
    lengths = np.linalg.norm(world[:3, :3], axis=0)
    if lengths.min() < 1e-12:
        findings.error(f"Camera '{name}' has a scale of zero: give it and its parents a scale other than zero.")
        return None
    world[:3, :3] /= lengths  # Cycles ignores the scale of a camera
    if not np.allclose(world[:3, :3].T @ world[:3, :3], np.eye(3), atol=1e-4):
        findings.error(f"Camera '{name}' is sheared by its parents: clear the parent's non-uniform scale.")
    return Camera(
        kind=data.type,
        world=world,
        width=square_width,
        height=square_height,
        fit=data.sensor_fit,
        sensor_width=data.sensor_width,
        sensor_height=data.sensor_height,
        lens=data.lens,
        ortho_scale=data.ortho_scale,
        shift_x=data.shift_x,
        shift_y=data.shift_y,
        clip_start=data.clip_start,
        clip_end=data.clip_end,
        aperture_radius=_aperture_radius(data),
        focus_distance=_focus_distance(evaluated, depsgraph),
        region=pictured_region(render, picture),
    )


def _aperture_radius(data: bpy.types.Camera) -> float:
    """Radius of the lens in metres as Cycles has it (sync of blender/camera.cpp); 0 where everything is sharp."""
    if not data.dof.use_dof or _why_sharp(data):
        return 0.0
    return data.lens * 1e-3 / (2.0 * max(data.dof.aperture_fstop, 1e-5))


def _why_sharp(data: bpy.types.Camera) -> str:
    """The sentence on what of a camera the renderer's lens does not have, for the camera's name."""
    if data.type != "PERSP":
        return "Camera '{}' is orthographic: its depth of field is left out, everything is sharp."
    if data.shift_x != 0.0 or data.shift_y != 0.0:
        return "Camera '{}' has a shift: its depth of field is left out, everything is sharp."
    return ""


def _focus_distance(camera: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> float:
    """Distance in metres from the lens to the plane that is sharp: along the view, of an object or a bone of it."""
    dof = camera.data.dof
    if dof.focus_object is None:
        return max(dof.focus_distance, 1e-5)
    item = dof.focus_object.evaluated_get(depsgraph)
    place = item.matrix_world
    bone = item.pose.bones.get(dof.focus_subtarget) if item.pose is not None else None
    if bone is not None:
        place = place @ bone.matrix
    view = camera.matrix_world.col[2].xyz.normalized()
    return max(abs(view.dot(camera.matrix_world.translation - place.translation)), 1e-5)


def note_picture_settings(scene: bpy.types.Scene, findings: Findings, picture: Size | None = None) -> None:
    """Report what the scene's camera and output settings do to a picture of this size and the fit does not."""
    render = scene.render
    region = render_region(render)
    if region is not None and min(region.size) <= 0:
        findings.error("The Render Region holds no pixel: turn Render Region off.", Fix("whole_frame"))
    elif pictured_region(render, picture) is not None and render.pixel_aspect_x != render.pixel_aspect_y:
        findings.error(
            "Render Region cuts pictures whose pixels are not square: turn Render Region off.", Fix("whole_frame")
        )
    if render.use_multiview:
        findings.error("Stereoscopy is on: turn it off to fit a single picture.", Fix("one_eye"))
    camera, dof = scene.camera, scene.camera.data.dof
    if dof.use_dof and _why_sharp(camera.data):
        findings.note(_why_sharp(camera.data).format(camera.name))
    elif dof.use_dof and (dof.aperture_blades > 0 or dof.aperture_ratio != 1.0):
        findings.note(f"Camera '{camera.name}': the aperture is taken for a circle (Blades 0, Ratio 1).")
    if render.use_motion_blur:
        findings.note("Motion blur is left out: the scene is exported at the current frame.")


def has_camera(scene: bpy.types.Scene, findings: Findings) -> bool:
    """Whether the scene camera is one the fit knows; else an error in `findings` says why not."""
    camera = scene.camera
    if camera is None or camera.type != "CAMERA":
        names = [item.name for item in scene.objects if item.type == "CAMERA"]
        fixes = [Fix("camera", name) for name in names[:3]] or [Fix("new_camera")]
        findings.error("The scene has no camera: add one and make it the active camera.", *fixes)
        return False
    if camera.data.type not in ("PERSP", "ORTHO"):
        sentence = f"Camera '{camera.name}' is of type {camera.data.type.title()}: make it Perspective or Orthographic."
        findings.error(sentence, Fix("perspective"))
        return False
    return True


def read_pixel_filter(scene: bpy.types.Scene) -> PixelFilter:
    """Return Cycles' pixel filter; its default where Cycles is off."""
    cycles = cycles_settings(scene)
    if cycles is None:
        return PixelFilter("BLACKMAN_HARRIS", 1.5)
    return PixelFilter(cycles.pixel_filter_type, cycles.filter_width)
