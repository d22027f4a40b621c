# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba texture `projective`: values as the camera sees them, found by projecting a surface point onto the film.

Choose the variant before importing this. Properties are `filename` and `positions`, .npy files of float32
(height, width, 1 or 3) for the same subpixels, world positions NaN where the camera does not see the surface, further
`camera`, the (3, 4) matrix from the world to column, row and 1 as twelve numbers, and `outside`, the value of points
that the camera does not see. The files may hold several `depths`, as of `seen_surface.SeenSurface`.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

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
        self.size = values.shape[2]
        outside = props.get("outside", 0.0)
        self.outside = mi.Color3f(outside if isinstance(outside, (int, float)) else mi.ScalarColor3f(outside))
        self.values = own_memory(values, mi.Float)
        dr.eval(self.values)

    @property
    def picture(self) -> NDArray[np.float32]:
        """The values as an array (height, width, 1 or 3)."""
        return self.values.numpy().reshape(self.surface.rows, self.surface.width, self.size)

    def show(self, picture: NDArray[np.float32]) -> None:
        """Take other values (height, width, 1 or 3) of the same subpixels."""
        if picture.shape != (self.surface.rows, self.surface.width, self.size):
            raise ValueError(f"a picture of {picture.shape} does not fit {self}")
        self.values = own_memory(picture, mi.Float)
        dr.eval(self.values)

    def eval(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """Three values at the surface point."""
        index, seen = self.surface.find(si.p, active)
        if self.size == 3:
            found = dr.gather(mi.Color3f, self.values, index, seen)
        else:
            found = mi.Color3f(dr.gather(mi.Float, self.values, index, seen))
        return dr.select(seen, found, self.outside)

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
