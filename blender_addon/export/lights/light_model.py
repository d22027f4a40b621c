# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's lights as numbers and the radiometry Cycles gives them. Knows nothing of bpy.

Formulas: measured on renders of Cycles 5.0; P is power (sun: strength) times 2^exposure, c the colour.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...bake.lamp_layout import FAR, NEAR, Lookup, distances

MOST_TAKEN = 1e-3  # of the light that is given; less is what filters leave in pictures

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Pattern:
    """Factors by direction from the lamp, by the normal of its sphere or by place on it: `by`, and `pixels`, linear
    Rec.709 (side, halves * side, 3), float32. `rim` is the half angle of a disc in degrees."""

    by: str
    pixels: NDArray[np.float32]
    rim: float = 90.0


@dataclass(frozen=True)
class Light:
    """A Blender light. `world` is its 4x4 matrix, `color` linear Rec.709, angles in radians, lengths in metres."""

    kind: str  # POINT, SPOT, SUN or AREA
    name: str
    world: NDArray[np.float64]
    color: Vector
    power: float  # watts, for a sun watts per square metre; exposure included
    normalize: bool = True
    radius: float = 0.0
    soft_falloff: bool = True
    spot_size: float = math.pi / 4
    spot_blend: float = 0.15
    sun_angle: float = 0.0
    shape: str = "SQUARE"  # SQUARE, RECTANGLE, DISK or ELLIPSE
    size_x: float = 1.0
    size_y: float = 1.0
    spread: float = math.pi
    camera: bool = False  # whether the camera sees it
    shadow: bool = True  # whether anything blocks its light
    nodes: Lookup | None = None  # what is still to be measured
    pattern: Pattern | None = None
    falloff: NDArray[np.float32] | None = None  # factors by distance, (1, STEPS, 3)

    @property
    def position(self) -> Vector:
        """Where the light is."""
        return self.world[:3, 3]

    @property
    def is_round(self) -> bool:
        """Whether an area light is a disk or an ellipse."""
        return self.shape in ("DISK", "ELLIPSE")

    @property
    def sizes(self) -> tuple[float, float]:
        """Width and height of an area light in its own space."""
        return self.size_x, self.size_y if self.shape in ("RECTANGLE", "ELLIPSE") else self.size_x


def takes_light(radiance: NDArray[np.floating]) -> bool:
    """Whether numbers below zero, which Cycles takes for light and the fit does not, are more than rounding."""
    given, taken = (float(part.sum(dtype=np.float64)) for part in (radiance.clip(0.0), -radiance.clip(max=0.0)))
    return taken > MOST_TAKEN * given


def point_intensity(light: Light) -> Vector:
    """Radiant intensity in W/sr of a point or spot light without extent: P c / (4 pi), unnormalised P c / pi."""
    return light.color * light.power / (4.0 * math.pi if light.normalize else math.pi)


def sphere_radiance(light: Light) -> Vector:
    """Radiance of a point or spot light with a radius: P c / (4 pi^2 r^2); not normalised: P c / pi."""
    area = 4.0 * math.pi * light.radius**2 if light.normalize else 1.0
    return light.color * light.power / (math.pi * area)


def area_of(light: Light) -> float:
    """Area in square metres of an area light, its object's scale included."""
    width, height = light.sizes
    sides = np.linalg.norm(light.world[:3, 0] * width) * np.linalg.norm(light.world[:3, 1] * height)
    return float(sides) * (math.pi / 4.0 if light.is_round else 1.0)


def area_radiance(light: Light) -> Vector:
    """Radiance of an area light: P c / (pi A); not normalised: P c / pi."""
    return light.color * light.power / (math.pi * (area_of(light) if light.normalize else 1.0))


def sun_irradiance(light: Light) -> Vector:
    """Irradiance on a plane that faces the sun: P c; a disk that is not normalised has radiance P c."""
    solid = math.pi * math.sin(light.sun_angle / 2.0) ** 2
    return light.color * light.power * (1.0 if light.normalize or solid == 0.0 else solid)


def sun_radiance(light: Light) -> Vector:
    """Radiance of a sun's disk of angle a: P c / (pi sin^2(a / 2)); not normalised: P c."""
    return sun_irradiance(light) / (math.pi * math.sin(light.sun_angle / 2.0) ** 2)


def irradiance_at(light: Light, point: Vector) -> float:
    """Return about how much light, mean of the channels, arrives at `point` on a surface that faces it."""
    if light.kind == "SUN":
        return float(sun_irradiance(light).mean())
    square = max(float(np.sum((light.position - point) ** 2)), 1e-6)
    if light.falloff is not None:
        light = replace(light, color=light.color * falloff_at(light.falloff, math.sqrt(square)), falloff=None)
    if light.kind == "AREA":
        return float(area_radiance(light).mean()) * area_of(light) / (square + area_of(light))
    if light.radius > 0.0:
        return float(sphere_radiance(light).mean()) * math.pi * light.radius**2 / max(square, light.radius**2)
    return float(point_intensity(light).mean()) / square


def falloff_at(falloff: NDArray[np.float32], distance: float) -> NDArray[np.float64]:
    """The three factors at a distance in metres, of a falloff (1, STEPS, 3)."""
    at = np.log(np.clip(distance, NEAR, FAR))
    return np.array([np.interp(at, np.log(distances()), falloff[0, :, channel]) for channel in range(3)])
