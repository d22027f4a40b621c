# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights as emitters that light the target as Cycles does. Knows nothing of bpy.

Mitsuba has an equal for point lights of no extent and for suns of no angle. All others are plugins of the backend
(`mfo_backend/render/lamps`): they have no shape, so that they block no other light, as in Cycles.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..files.xml_scene import Element, add, bitmap, boolean, integer, plugin, rgb, scalar, string, transform
from .light_model import Light, Vector, area_radiance, point_intensity, sphere_radiance, sun_irradiance, sun_radiance

# Blender's spot, sun and area shine along local -Z, Mitsuba's along +Z
TURN = np.diag([1.0, -1.0, -1.0, 1.0])
# radians; a sun without shadows is a lamp of ours, which has an angle: as narrow as no highlight shows
NARROW_SUN = math.radians(0.01)


def light_element(light: Light, identifier: str, save: Callable[[NDArray[np.float32]], str]) -> Element:
    """Return the emitter for `light`; `save` keeps a picture and returns its path."""
    element = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}[light.kind](light, identifier)
    _add_tables(element, light, save)
    return element if light.shadow else add(element, boolean("shadow", False))


def _add_tables(element: Element, light: Light, save: Callable[[NDArray[np.float32]], str]) -> None:
    """Add what the light's nodes make of it."""
    if light.pattern is not None:
        height, width = light.pattern.pixels.shape[:2]
        add(element, bitmap("pattern", save(light.pattern.pixels), extension="clamp"))
        add(element, string("pattern_by", light.pattern.by), scalar("pattern_rim", light.pattern.rim))
        add(element, integer("pattern_halves", width // height))
    if light.falloff is not None:
        add(element, bitmap("falloff", save(light.falloff), extension="clamp"))


def _point(light: Light, identifier: str) -> Element:
    shaped = light.pattern is not None or light.falloff is not None
    place = transform("to_world", light.world @ TURN if shaped else _translation(light.position))
    if light.radius <= 0.0 and (shaped or not light.shadow):
        return _sharp_spot(light, identifier, place, 360.0)
    if light.radius <= 0.0:
        return add(plugin("emitter", "point", identifier), place, rgb("intensity", point_intensity(light)))
    lamp = _lamp("blender_point", light, identifier, sphere_radiance(light))
    return add(lamp, place, *_ball(light))


def _spot(light: Light, identifier: str) -> Element:
    place, degrees = transform("to_world", light.world @ TURN), math.degrees(light.spot_size)
    if light.radius <= 0.0:
        return _sharp_spot(light, identifier, place, degrees, light.spot_blend)
    lamp = add(_lamp("blender_spot", light, identifier, sphere_radiance(light)), *_ball(light))
    return add(lamp, place, scalar("cone", degrees), scalar("blend", light.spot_blend))


def _sharp_spot(light: Light, identifier: str, place: Element, degrees: float, blend: float = 0.0) -> Element:
    lamp = add(plugin("emitter", "blender_sharp_spot", identifier), rgb("intensity", point_intensity(light)))
    return add(lamp, place, scalar("cone", degrees), scalar("blend", blend))


def _sun(light: Light, identifier: str) -> Element:
    frame = transform("to_world", _frame(-light.world[:3, 2] / np.linalg.norm(light.world[:3, 2])))
    if light.sun_angle <= 0.0 and not light.shadow:
        light = replace(light, sun_angle=NARROW_SUN, normalize=True)
    if light.sun_angle <= 0.0:
        return add(plugin("emitter", "directional", identifier), frame, rgb("irradiance", sun_irradiance(light)))
    lamp = _lamp("blender_sun", light, identifier, sun_radiance(light))
    return add(lamp, frame, scalar("angle", math.degrees(light.sun_angle)))


def _area(light: Light, identifier: str) -> Element:
    width, height = light.sizes
    lamp = _lamp("blender_area", light, identifier, area_radiance(light))
    matrix = light.world @ TURN @ np.diag([width / 2.0, height / 2.0, 1.0, 1.0])
    spread = scalar("spread", min(math.degrees(light.spread), 180.0))
    return add(lamp, transform("to_world", matrix), boolean("round", light.is_round), spread)


def _lamp(kind: str, light: Light, identifier: str, radiance: Vector) -> Element:
    return add(plugin("emitter", kind, identifier), rgb("radiance", radiance), boolean("camera", light.camera))


def _ball(light: Light) -> tuple[Element, Element]:
    return scalar("radius", light.radius), boolean("soft_falloff", light.soft_falloff)


def _translation(position: Vector) -> NDArray[np.float64]:
    matrix = np.eye(4)
    matrix[:3, 3] = position
    return matrix


def _frame(z_axis: Vector) -> NDArray[np.float64]:
    """Return a rigid matrix whose +Z is `z_axis`."""
    helper = np.eye(3)[int(np.argmin(np.abs(z_axis)))]
    x_axis = np.cross(helper, z_axis)
    x_axis /= np.linalg.norm(x_axis)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = x_axis, np.cross(z_axis, x_axis), z_axis
    return matrix
