# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights as Mitsuba emitters that light the target as Cycles does. Knows nothing of bpy."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .findings import Findings
from .light_model import (
    Light,
    Vector,
    area_of,
    area_radiance,
    point_intensity,
    sphere_radiance,
    spot_falloff,
    spread_falloff,
    sun_irradiance,
)
from .xml_scene import Element, add, bitmap, plugin, rgb, scalar, transform

# Blender's spot, sun and area shine along local -Z, Mitsuba's along +Z
TURN = np.diag([1.0, -1.0, -1.0, 1.0])
FALLOFF_PIXELS = 1024
# tan(80 degrees) = 5.7: beyond it the falloff picture, which is a plane across the cone, becomes too coarse
WIDEST_CONE = math.radians(80.0)
# a far disk stands in for the sun; its parallax over the scene is 1/1000 of the scene's own size
SUN_DISTANCE = 1000.0
WIDEST_SUN = math.radians(170.0)
# an area light with a spread becomes this many spots along each side
SPREAD_GRID = 6

SaveTexture = Callable[[NDArray[np.float32]], str]


@dataclass(frozen=True)
class Surroundings:
    """What a light needs to know: the scene's bounding sphere and the middle of the target, in metres."""

    center: Vector
    radius: float
    target: Vector


def light_elements(
    light: Light, identifier: str, around: Surroundings, save: SaveTexture, findings: Findings
) -> list[Element]:
    """Return the emitters and emitting shapes for `light`; `save` writes a picture and returns its path in the job."""
    if light.kind == "POINT":
        return [_point(light, identifier, around, findings)]
    if light.kind == "SPOT":
        return [_spot(light, identifier, around, save, findings)]
    if light.kind == "SUN":
        return [_sun(light, identifier, around, findings)]
    if light.spread < math.pi - 1e-3:
        return _area_with_spread(light, identifier, save, findings)
    return [_area(light, identifier)]


def has_surface(light: Light) -> bool:
    """Whether the light becomes a shape, which Mitsuba lets block other light and be seen."""
    extended = {"POINT": light.radius > 0.0, "SUN": light.sun_angle > 0.0, "SPOT": False}
    return extended.get(light.kind, light.spread >= math.pi - 1e-3)


def _facing_disk_factor(light: Light, around: Surroundings) -> float:
    """d^2 / (d^2 + r^2): a disk that always faces the shading point against a sphere of equal radiance."""
    distance = float(np.linalg.norm(light.position - around.target))
    return distance**2 / max(distance**2 + light.radius**2, 1e-30)


def _point(light: Light, identifier: str, around: Surroundings, findings: Findings) -> Element:
    if light.radius <= 0.0:
        return add(
            plugin("emitter", "point", identifier),
            transform("to_world", _translation(light.position)),
            rgb("intensity", point_intensity(light)),
        )
    radiance = sphere_radiance(light)
    if light.soft_falloff:
        radiance = radiance * _facing_disk_factor(light, around)
        findings.note(
            f"Light '{light.name}': Soft Falloff is a sphere of {light.radius:.3g} m whose level is exact at the "
            "target's middle only; turn Soft Falloff off for an exact match."
        )
    shape = plugin("shape", "sphere", identifier)
    matrix = _translation(light.position) @ np.diag([light.radius] * 3 + [1.0])
    return _emitting(shape, matrix, radiance)


def _spot(light: Light, identifier: str, around: Surroundings, save: SaveTexture, findings: Findings) -> Element:
    intensity = point_intensity(light)
    if light.radius > 0.0:
        intensity = (intensity if light.normalize else intensity * 4.0 * math.pi * light.radius**2 / 4.0) * (
            _facing_disk_factor(light, around) if light.soft_falloff else 1.0
        )
        findings.note(
            f"Light '{light.name}': a spot light's radius of {light.radius:.3g} m is left out, so its shadows are "
            "sharp; set Radius to 0 for an exact match."
        )
    half = light.spot_size / 2.0
    if half > WIDEST_CONE:
        findings.note(
            f"Light '{light.name}': a cone of {math.degrees(light.spot_size):.0f} degrees is cut at "
            f"{math.degrees(2.0 * WIDEST_CONE):.0f} degrees, the widest that is exported."
        )
    cone = min(half, WIDEST_CONE)
    element = _cone(light.world @ TURN, identifier, intensity, cone)
    if light.spot_blend > 0.0:
        tangent = _tangents(cone)
        falloff = spot_falloff(1.0 / np.sqrt(1.0 + tangent**2), light.spot_size, light.spot_blend)
        add(element, bitmap("texture", save(falloff.astype(np.float32)[:, :, None]), extension="clamp"))
    return element


def _sun(light: Light, identifier: str, around: Surroundings, findings: Findings) -> Element:
    direction = -light.world[:3, 2] / np.linalg.norm(light.world[:3, 2])
    irradiance = sun_irradiance(light)
    if light.sun_angle <= 0.0:
        frame = _frame(direction)
        return add(
            plugin("emitter", "directional", identifier),
            transform("to_world", frame),
            rgb("irradiance", irradiance),
        )
    angle = min(light.sun_angle, WIDEST_SUN)
    if angle < light.sun_angle:
        findings.note(f"Light '{light.name}': an angle above {math.degrees(WIDEST_SUN):.0f} degrees is cut there.")
    distance = SUN_DISTANCE * around.radius
    size = distance * math.tan(angle / 2.0)
    frame = _frame(direction)
    frame[:3, 3] = around.center - direction * distance
    radiance = irradiance / (math.pi * math.sin(angle / 2.0) ** 2)
    return _emitting(plugin("shape", "disk", identifier), frame @ np.diag([size, size, 1.0, 1.0]), radiance)


def _area(light: Light, identifier: str) -> Element:
    width, height = light.sizes
    shape = plugin("shape", "disk" if light.is_round else "rectangle", identifier)
    # Mitsuba's unit disk and rectangle reach from -1 to 1
    matrix = light.world @ TURN @ np.diag([width / 2.0, height / 2.0, 1.0, 1.0])
    return _emitting(shape, matrix, area_radiance(light))


def _area_with_spread(light: Light, identifier: str, save: SaveTexture, findings: Findings) -> list[Element]:
    findings.note(
        f"Light '{light.name}': a spread of {math.degrees(light.spread):.0f} degrees has no counterpart in Mitsuba; "
        f"{SPREAD_GRID}x{SPREAD_GRID} small spots stand in for it, which show as dots in sharp reflections."
    )
    width, height = light.sizes
    steps = (np.arange(SPREAD_GRID) + 0.5) / SPREAD_GRID - 0.5
    places = [(x, y) for y in steps for x in steps if not light.is_round or x * x + y * y < 0.25]
    cone = min(max(light.spread, 1e-3) / 2.0, WIDEST_CONE)
    tangent = _tangents(cone)
    # radiance times the projected area: the cosine of a flat emitter belongs into the falloff
    falloff = spread_falloff(tangent, light.spread) / np.sqrt(1.0 + tangent**2)
    peak = float(falloff.max())
    picture = save((falloff / peak).astype(np.float32)[:, :, None])
    intensity = area_radiance(light) * area_of(light) / len(places) * peak
    frame = _frame(-light.world[:3, 2] / np.linalg.norm(light.world[:3, 2]))
    elements = []
    for index, (x, y) in enumerate(places):
        frame[:3, 3] = (light.world @ np.array([x * width, y * height, 0.0, 1.0]))[:3]
        spot = _cone(frame, f"{identifier}_{index:02d}", intensity, cone)
        elements.append(add(spot, bitmap("texture", picture, extension="clamp")))
    return elements


def _cone(to_world: NDArray[np.float64], identifier: str, intensity: Vector, half_angle: float) -> Element:
    # beam_width equal to the cutoff leaves the falloff to the texture
    degrees = math.degrees(half_angle)
    return add(
        plugin("emitter", "spot", identifier),
        transform("to_world", to_world),
        rgb("intensity", intensity),
        scalar("cutoff_angle", degrees),
        scalar("beam_width", degrees * (1.0 - 1e-6)),
    )


def _tangents(half_angle: float) -> NDArray[np.float64]:
    """Tangent of the angle to the axis at every pixel of the picture Mitsuba projects through a spot."""
    steps = ((np.arange(FALLOFF_PIXELS) + 0.5) / FALLOFF_PIXELS * 2.0 - 1.0) * math.tan(half_angle)
    return np.hypot(steps[None, :], steps[:, None])


def _emitting(shape: Element, matrix: NDArray[np.float64], radiance: Vector) -> Element:
    emitter = add(plugin("emitter", "area"), rgb("radiance", radiance))
    black = add(plugin("bsdf", "diffuse"), rgb("reflectance", (0.0, 0.0, 0.0)))
    return add(shape, transform("to_world", matrix), black, emitter)


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
