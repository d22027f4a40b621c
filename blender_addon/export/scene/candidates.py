# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene has for a further picture: its other cameras, and lights that can be moved or left alone."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..camera.camera_model import TURN, Camera
from ..lights.light_model import irradiance_at
from .origin import moved
from .scene_data import SceneData

MOST_CAMERAS, MOST_LIGHTS = 12, 3  # the most that the backend's `fit.candidates` takes


def candidates(scene: bpy.types.Scene, data: SceneData) -> dict[str, Any]:
    """The lists `cameras` and `lights` of request.json; those that give the target most light come first.

    Cameras are perspective ones without shift, and none for a picture of a Render Region alone. Where lights come by
    instances there are none that could be moved alone.
    """
    others = [obj for obj in scene.objects if obj.type == "CAMERA" and obj != scene.camera]
    cameras = [_camera(obj, data.camera, data.origin) for obj in others if data.camera.region is None]
    counts = Counter(light.name for light in data.lights)
    single = all(count == 1 and name in scene.objects for name, count in counts.items())
    middle = data.middle() if data.target is None else data.target.mesh.positions.mean(axis=0)
    found = [
        (irradiance_at(light, middle), {"name": light.name, "emitter": f"light_{number + 1:04d}"})
        for number, light in enumerate(data.lights if single else ())
    ]
    found.sort(key=lambda one: -one[0])
    return {
        "cameras": [camera for camera in cameras if camera is not None][:MOST_CAMERAS],
        "lights": [light for _, light in found[:MOST_LIGHTS]],
    }


def _camera(obj: bpy.types.Object, present: Camera, origin: NDArray[np.float64]) -> dict[str, Any] | None:
    """A camera with a picture of the present one's size, its place from an origin; None for one of another kind."""
    data = obj.data
    if data.type != "PERSP" or data.shift_x != 0.0 or data.shift_y != 0.0:
        return None
    world = moved(np.array(obj.matrix_world, np.float64), origin)
    lengths = np.linalg.norm(world[:3, :3], axis=0)
    if lengths.min() < 1e-12:
        return None
    world[:3, :3] /= lengths  # Cycles ignores the scale of a camera
    if not np.allclose(world[:3, :3].T @ world[:3, :3], np.eye(3), atol=1e-4):
        return None
    camera = replace(
        present,
        world=world,
        fit=data.sensor_fit,
        sensor_width=data.sensor_width,
        sensor_height=data.sensor_height,
        lens=data.lens,
    )
    half = math.tan(math.radians(camera.field_of_view) / 2.0)
    wide = half if camera.fits_width else half * camera.width / camera.height
    return {
        "name": obj.name,
        "to_world": [float(value) for value in (world @ TURN).ravel()],
        "fov": math.degrees(2.0 * math.atan(wide)),
    }
