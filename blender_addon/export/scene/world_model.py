# SPDX-License-Identifier: GPL-3.0-or-later
"""The surroundings as numbers and the Mitsuba emitter that equals them. Knows nothing of bpy."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..files.xml_scene import Element, add, bitmap, plugin, rgb, scalar, string, transform

# Mitsuba's envmap looks up local (x, y, z), Y up; Blender's equirectangular image has +X in its middle and Z up
AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
# pictures up to this height get rows between their rows, so that both renderers interpolate alike
EXACT_HEIGHT = 1024
BLACK_PICTURE = np.zeros((2, 4, 3), np.float32)


@dataclass(frozen=True)
class World:
    """Radiance of the surroundings: `color` alone, or times `pixels`, an equirectangular picture (height, width, 3).

    `lookup` is the linear part of what moves a world direction before the look-up. `camera_pixels` is what the camera
    sees instead, radiance laid out alike, where that differs.
    """

    color: NDArray[np.float64]
    pixels: NDArray[np.float32] | None = None
    lookup: NDArray[np.float64] | None = None
    camera: bool = True  # whether the camera sees it
    camera_pixels: NDArray[np.float32] | None = None

    @property
    def is_lit(self) -> bool:
        """Whether any light comes from it."""
        return self.color.max() > 0.0 and (self.pixels is None or float(self.pixels.max()) > 0.0)


def world_element(world: World, save: Callable[[NDArray[np.float32]], str]) -> Element | None:
    """Return the `<emitter>`, or None if the world is black.

    Raises
    ------
    NotFiniteError
        If its colour is NaN or infinite.
    """
    color = rgb("radiance", world.color)  # also of a picture: NaN would count as black
    if not world.is_lit:
        return None
    if world.pixels is None:
        return add(plugin("emitter", "constant", "world"), color)
    tinted = world.pixels * world.color.astype(np.float32)
    rotation = np.eye(3) if world.lookup is None else world.lookup
    matrix = np.eye(4)
    matrix[:3, :3] = rotation.T @ AXES
    return add(
        plugin("emitter", "envmap", "world"),
        string("filename", save(_rows_on_poles(tinted))),
        scalar("scale", 1.0),
        transform("to_world", matrix),
    )


def camera_world_element(
    world: World, save: Callable[[NDArray[np.float32]], str], *, hidden: bool = False
) -> Element | None:
    """Return the `<texture>` that camera rays see behind everything, as `camera_world` of the backend reads it.

    It is black if the world is `hidden`, or itself hidden from the camera, and None if it is the world as it is.
    """
    if not world.is_lit:
        return None
    pixels = BLACK_PICTURE if hidden or not world.camera else world.camera_pixels
    if pixels is None:
        return None
    element = bitmap("camera_world", save(pixels))
    element.set("id", element.attrib.pop("name"))  # nothing of Mitsuba's own refers to it
    return element


def world_irradiance(world: World) -> float:
    """Return about how much light, mean of the channels, a surface gets from the world."""
    mean = 1.0
    if world.pixels is not None:
        height = world.pixels.shape[0]
        weights = np.sin((np.arange(height) + 0.5) / height * math.pi)
        mean = float(weights @ world.pixels.mean(axis=(1, 2), dtype=np.float64)) / float(weights.sum())
    return math.pi * mean * float(world.color.mean())


def resample(
    pixels: NDArray[np.float32], lookup: NDArray[np.float64], offset: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the equirectangular picture seen without mapping, for mappings that are more than a rotation."""
    height, width = pixels.shape[:2]
    azimuth = -(((np.arange(width) + 0.5) / width) - 0.5) * 2.0 * math.pi
    polar = (np.arange(height) + 0.5) / height * math.pi
    polar, azimuth = np.meshgrid(polar, azimuth, indexing="ij")
    directions = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    return sample(pixels, directions @ lookup.T + offset)


def sample(pixels: NDArray[np.float32], directions: NDArray[np.float64]) -> NDArray[np.float32]:
    """Look `directions` (..., 3) up as Cycles does (direction_to_equirectangular, bilinear, repeated in u)."""
    height, width = pixels.shape[:2]
    length = np.linalg.norm(directions, axis=-1)
    cosine = np.clip(directions[..., 2] / np.maximum(length, 1e-12), -1.0, 1.0)
    u = 0.5 - np.arctan2(directions[..., 1], directions[..., 0]) / (2.0 * math.pi)
    x, y = u * width - 0.5, np.arccos(cosine) / math.pi * height - 0.5
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    along, down = (x - left)[..., None], (y - top)[..., None]
    rows = np.clip(top, 0, height - 1), np.clip(top + 1, 0, height - 1)
    columns = left % width, (left + 1) % width
    upper = pixels[rows[0], columns[0]] * (1.0 - along) + pixels[rows[0], columns[1]] * along
    lower = pixels[rows[1], columns[0]] * (1.0 - along) + pixels[rows[1], columns[1]] * along
    return (upper * (1.0 - down) + lower * down).astype(np.float32)


def _rows_on_poles(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return 2 h + 1 rows: Mitsuba's first and last row lie on the poles, Blender's half a row inside."""
    height = pixels.shape[0]
    if height > EXACT_HEIGHT:
        return pixels
    rows = np.empty((2 * height + 1, *pixels.shape[1:]), dtype=np.float32)
    rows[1::2] = pixels
    rows[2:-1:2] = 0.5 * (pixels[:-1] + pixels[1:])
    rows[0], rows[-1] = pixels[0], pixels[-1]
    return rows
