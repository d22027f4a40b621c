# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba texture `projective`: values as the camera sees them, found by projecting a surface point onto the film.

Choose the variant before importing this. Properties are `filename` and `positions`, .npy files of float32
(height, width, 1 or 3) for the same subpixels, world positions NaN where the camera does not see the surface, further
`camera`, the (3, 4) matrix from the world to column, row and 1 as twelve numbers, and `outside`, the value of points
that the camera does not see. Normals that are `turned` have the opposite direction on the other side of the surface;
others are mirrored there (`principled_plugin`). The files may hold several `depths`, as of `seen_surface.SeenSurface`.

Where values hang on the ray `elsewhere` is a file of what other rays find, one block of rows below the other for even
steps of the cosine between ray and normal, 0 to 1. A block is as `filename` in a whole number of subpixels a place.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..arrays.own_memory import own_memory
from .seen_surface import SeenSurface

PLUGIN_NAME = "projective"


class ProjectiveTexture(mi.Texture):
    """Values of a surface as the camera sees it."""

    def __init__(self, props: mi.Properties) -> None:
        mi.Texture.__init__(self, props)
        camera = np.array([float(number) for number in str(props["camera"]).split(",")]).reshape(3, 4)
        self.surface = _surface(str(props["positions"]), camera, int(props.get("depths", 1)))
        values = np.load(str(props["filename"]), allow_pickle=False)
        if values.ndim != 3 or values.shape[:2] != (self.surface.rows, self.surface.width):
            raise RuntimeError(f"{props['filename']} has the shape {values.shape}: it does not fit its positions")
        self.size, self.turned = values.shape[2], bool(props.get("turned", False))
        outside = props.get("outside", 0.0)
        is_number = isinstance(outside, (int, float))
        self._set_outside([float(outside)] if is_number else [float(v) for v in mi.ScalarColor3f(outside)])
        self.values = own_memory(values, mi.Float)
        self._elsewhere = _Elsewhere(np.load(str(props["elsewhere"])), self.surface) if "elsewhere" in props else None
        dr.eval(self.values)

    @property
    def elsewhere(self) -> NDArray[np.float32] | None:
        """The values for other rays, as an array (rows, columns, 1 or 3); None where they do not hang on the ray."""
        return None if self._elsewhere is None else self._elsewhere.picture

    @property
    def picture(self) -> NDArray[np.float32]:
        """The values as an array (height, width, 1 or 3)."""
        return self.values.numpy().reshape(self.surface.rows, self.surface.width, self.size)

    @property
    def outside(self) -> NDArray[np.float32]:
        """The value of points that the camera does not see, (3,)."""
        return self._outside.numpy().ravel()

    def _set_outside(self, value: Sequence[float]) -> None:
        # opaque: a kernel that held its digits would be compiled anew for each
        self._outside = mi.Color3f(*(dr.opaque(mi.Float, float(v)) for v in (*value, *value[:1], *value[:1])[:3]))

    def show(
        self,
        picture: NDArray[np.float32],
        elsewhere: NDArray[np.float32] | None = None,
        outside: NDArray[np.float32] | None = None,
    ) -> None:
        """Take other values (height, width, 1 or 3) of the same subpixels, those for other rays, and the value of
        points that the camera does not see, which stays without one."""
        if picture.shape != (self.surface.rows, self.surface.width, self.size):
            raise ValueError(f"a picture of {picture.shape} does not fit {self}")
        self.values = own_memory(picture, mi.Float)
        self._elsewhere = None if elsewhere is None else _Elsewhere(elsewhere, self.surface)
        dr.eval(self.values)
        if outside is not None:
            self._set_outside(outside.tolist())

    def eval(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """Three values at the surface point."""
        index, seen = self.surface.find(si.p, active)
        if self.size == 3:
            found = dr.gather(mi.Color3f, self.values, index, seen)
        else:
            found = mi.Color3f(dr.gather(mi.Float, self.values, index, seen))
        found = dr.select(seen, found, self._outside)
        if self._elsewhere is None:
            return found
        return dr.select(self.surface.is_from_camera(si), found, self._elsewhere.at(index, seen, si, active))

    def eval_1(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """One value at the surface point."""
        return self.eval(si, active).x

    def traverse(self, callback: Any) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Show the values."""
        callback.put("data", self.values, mi.ParamFlags.NonDifferentiable)

    def is_spatially_varying(self) -> bool:
        """True."""
        return True

    def to_string(self) -> str:
        """Short description."""
        return f"ProjectiveTexture[{self.surface.width} x {self.surface.height} x {self.size}]"


class _Elsewhere:
    """What rays that are not the camera's find, by the place and the cosine between ray and normal."""

    def __init__(self, picture: NDArray[np.float32], surface: SeenSurface) -> None:
        self.picture = picture
        columns, self.size = picture.shape[1:]
        scale = surface.width // columns
        rows = surface.rows // scale
        self._steps, self._places = len(picture) // rows, rows * columns
        places = np.arange(self._places).reshape(rows, columns)
        self._place = own_memory(places.repeat(scale, axis=0).repeat(scale, axis=1), mi.UInt32)  # of each subpixel
        blocks = picture.reshape(self._steps, self._places, self.size)
        seen = surface.seen.reshape(rows, scale, columns, scale).any(axis=(1, 3)).ravel()
        mean = blocks[:, seen].mean(axis=1, keepdims=True, dtype=np.float64).astype(np.float32)
        self._values = own_memory(np.concatenate([blocks, mean], axis=1), mi.Float)  # places that nobody sees: the last
        dr.eval(self._place, self._values)

    def at(self, index: Any, seen: Any, si: mi.SurfaceInteraction3f, active: Any) -> Any:
        """Three values at the place of a subpixel, or the mean of all where it is not `seen`."""
        known = active & seen
        place = dr.select(known, dr.gather(mi.UInt32, self._place, index, known), dr.opaque(mi.UInt32, self._places))
        steps, last = dr.opaque(mi.Float, self._steps), dr.opaque(mi.Float, self._steps - 1)
        step = dr.clip(dr.abs(mi.Frame3f.cos_theta(si.wi)) * steps - 0.5, 0.0, last)
        below = dr.minimum(dr.floor(step), dr.maximum(last - 1.0, 0.0))
        above = dr.minimum(below + 1.0, last)
        block = dr.opaque(mi.UInt32, self._places + 1)
        first, second = (self._gathered(mi.UInt32(k) * block + place, active) for k in (below, above))
        return dr.lerp(first, second, step - below)

    def _gathered(self, index: Any, active: Any) -> Any:
        if self.size == 3:
            return dr.gather(mi.Color3f, self._values, index, active)
        return mi.Color3f(dr.gather(mi.Float, self._values, index, active))


_surfaces: WeakValueDictionary[tuple[Any, ...], SeenSurface] = WeakValueDictionary()


def _surface(path: str, camera: NDArray[np.float64], depths: int) -> SeenSurface:
    key = (mi.variant(), path, Path(path).stat().st_mtime_ns, camera.tobytes(), depths)
    surface = _surfaces.get(key)
    if surface is None:
        surface = _surfaces[key] = SeenSurface(np.load(path, allow_pickle=False), camera, depths)
    return surface


def register() -> None:
    """Make `projective` known to Mitsuba in the current variant."""
    mi.register_texture(PLUGIN_NAME, ProjectiveTexture)
