# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's camera as numbers, and the Mitsuba sensor that sees the same. Knows nothing of bpy."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..files.xml_scene import Element, add, boolean, integer, plugin, scalar, string, transform

# Blender looks along -Z with +X right; Mitsuba looks along +Z with +X left
TURN = np.diag([-1.0, 1.0, -1.0, 1.0])
# Standard deviation of Cycles' Blackman-Harris filter over its width: 0.2770, so 0.4155 px at the default 1.5
BLACKMAN_HARRIS_SIGMA = 0.2770
CAMERA_NOT_FINITE = (
    "The place or a setting of the camera is NaN or infinite: mend the driver, constraint or keyframe that gives it."
)


@dataclass(frozen=True)
class PixelFilter:
    """Cycles' pixel filter: kind BOX, GAUSSIAN or BLACKMAN_HARRIS, width in pixels."""

    kind: str
    width: float


@dataclass(frozen=True)
class Region:
    """A rectangle of pixels, from the upper left corner of the frame on; `right` and `bottom` are the first beside."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        return self.right - self.left, self.bottom - self.top

    def parts_of(self, width: int, height: int) -> tuple[float, float, float, float]:
        """Its edges as parts of the frame's width and height."""
        return self.left / width, self.top / height, self.right / width, self.bottom / height


def edges_of(region: Region | None) -> list[int] | None:
    """Left, top, right and bottom, for JSON."""
    return None if region is None else [region.left, region.top, region.right, region.bottom]


@dataclass(frozen=True)
class Camera:
    """A Blender camera. `world` is a rigid 4x4 matrix; lengths in metres, `lens` and `sensor` in millimetres.

    `width` and `height` count square pixels of the frame; `fit` is AUTO, HORIZONTAL or VERTICAL; shifts are in units of
    the fitted dimension. The picture is all of the frame or a `region` of it.
    """

    kind: str  # PERSP or ORTHO
    world: NDArray[np.float64]
    width: int
    height: int
    fit: str
    sensor_width: float
    sensor_height: float
    lens: float
    ortho_scale: float
    shift_x: float
    shift_y: float
    clip_start: float
    clip_end: float
    # of a perspective camera without shift; a radius of 0 leaves everything sharp
    aperture_radius: float = 0.0
    focus_distance: float = 0.0
    region: Region | None = None

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture."""
        return (self.width, self.height) if self.region is None else self.region.size

    def shown(self, places: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether pixel coordinates (n, 2) of the frame lie in the picture, (n,)."""
        left, top, right, bottom = self._edges()
        return ((places > (left, top)) & (places < (right, bottom))).all(axis=1)

    def beside(self, places: NDArray[np.float64]) -> bool:
        """Whether all pixel coordinates (n, 2) lie beyond one and the same edge of the picture."""
        left, top, right, bottom = self._edges()
        return bool(((places < (left, top)).all(axis=0) | (places > (right, bottom)).all(axis=0)).any())

    def _edges(self) -> list[int]:
        return edges_of(self.region) or [0, 0, self.width, self.height]

    @property
    def fits_width(self) -> bool:
        """Whether the field of view is given for the horizontal axis (AUTO: the larger one)."""
        return self.fit == "HORIZONTAL" or (self.fit == "AUTO" and self.width >= self.height)

    @property
    def fitted_pixels(self) -> int:
        """Pixels along the axis that the field of view is given for."""
        return self.width if self.fits_width else self.height

    @property
    def field_of_view(self) -> float:
        """Full angle along the fitted axis in degrees. AUTO always takes the sensor's width."""
        sensor = self.sensor_height if self.fit == "VERTICAL" else self.sensor_width
        return math.degrees(2.0 * math.atan(sensor / (2.0 * self.lens)))

    def project(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return pixel coordinates (n, 2), origin at the top left, and depths (n) of world `points` (n, 3)."""
        local = (points - self.world[:3, 3]) @ self.world[:3, :3]
        depth = -local[:, 2]
        if self.kind == "ORTHO":
            plane = local[:, :2] / self.ortho_scale
        else:
            scale = 2.0 * math.tan(math.radians(self.field_of_view) / 2.0)
            safe = np.where(np.abs(depth) < 1e-12, 1e-12, depth)
            plane = local[:, :2] / (safe[:, None] * scale)
        x = self.width / 2 + (plane[:, 0] - self.shift_x) * self.fitted_pixels
        y = self.height / 2 - (plane[:, 1] - self.shift_y) * self.fitted_pixels
        return np.stack([x, y], axis=1), depth


def sensor_element(camera: Camera, pixel_filter: PixelFilter, spp: int) -> Element:
    """Return the `<sensor>` with film, pixel filter and sampler."""
    fit = camera.fitted_pixels
    if camera.kind == "ORTHO":
        # Mitsuba's film is 2 wide before to_world; the shift moves the camera in its own plane
        half_width = 0.5 * camera.ortho_scale * camera.width / fit
        moved = np.eye(4)
        moved[:2, 3] = camera.shift_x * camera.ortho_scale, camera.shift_y * camera.ortho_scale
        sensor = plugin("sensor", "orthographic", "sensor")
        matrix = camera.world @ moved @ TURN @ np.diag([half_width, half_width, 1.0, 1.0])
        add(sensor, transform("to_world", matrix))
    else:
        sensor = plugin("sensor", "thinlens" if camera.aperture_radius > 0.0 else "perspective", "sensor")
        add(
            sensor,
            transform("to_world", camera.world @ TURN),
            scalar("fov", camera.field_of_view),
            string("fov_axis", "x" if camera.fits_width else "y"),
        )
        if camera.aperture_radius > 0.0:
            lens = scalar("aperture_radius", camera.aperture_radius), scalar("focus_distance", camera.focus_distance)
            add(sensor, *lens)
        else:
            add(
                sensor,
                scalar("principal_point_offset_x", camera.shift_x * fit / camera.width),
                scalar("principal_point_offset_y", -camera.shift_y * fit / camera.height),
            )
    film = add(
        plugin("film", "hdrfilm"),
        integer("width", camera.width),
        integer("height", camera.height),
        *_crop(camera.region),
        string("pixel_format", "rgb"),
        string("component_format", "float32"),
        boolean("sample_border", True),  # Cycles' filter reaches beyond the picture
        filter_element(pixel_filter),
    )
    sampler = add(plugin("sampler", "independent"), integer("sample_count", spp))
    return add(sensor, scalar("near_clip", camera.clip_start), scalar("far_clip", camera.clip_end), film, sampler)


def _crop(region: Region | None) -> list[Element]:
    if region is None:
        return []
    width, height = region.size
    named = {"offset_x": region.left, "offset_y": region.top, "width": width, "height": height}
    return [integer(f"crop_{name}", value) for name, value in named.items()]


def filter_element(pixel_filter: PixelFilter) -> Element:
    """Return the `<rfilter>` closest to Cycles' filter."""
    if pixel_filter.kind == "BOX":
        return plugin("rfilter", "box")
    if pixel_filter.kind == "GAUSSIAN":
        # Cycles: exp(-2 (6 x / w)^2) with w = 3 width (filter_table in film.cpp)
        sigma = pixel_filter.width / 4.0
    else:
        sigma = BLACKMAN_HARRIS_SIGMA * pixel_filter.width
    return add(plugin("rfilter", "gaussian"), scalar("stddev", sigma))
