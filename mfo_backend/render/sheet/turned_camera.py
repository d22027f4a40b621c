# SPDX-License-Identifier: Apache-2.0
"""Cameras that a picture was not made with: its own, turned around the target, and others, as one sensor."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class View:
    """Where a perspective camera stands: `to_world` (4, 4) and its field of view along x, degrees."""

    to_world: NDArray[np.float64]
    fov: float


def target_center(shape: mi.Shape) -> NDArray[np.float64]:
    """Middle of a shape's bounding box in world space, (3,)."""
    return np.array(shape.bbox().center(), np.float64).ravel()


def turn_about(center: NDArray[np.float64], degrees: float) -> NDArray[np.float64]:
    """The matrix (4, 4) of a turn around the vertical (world Z) through `center`: from above, a positive one goes
    against the clock."""
    turn, c, s = np.eye(4), math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    turn[:2, :2] = [[c, -s], [s, c]]
    turn[:3, 3] = center - turn[:3, :3] @ center
    return turn


def view_of(sensor: mi.Sensor) -> View | None:
    """Where a sensor stands; None for one that is no perspective camera, or of whose film a part is rendered."""
    if tuple(sensor.film().crop_size()) != tuple(sensor.film().size()):
        return None
    params = mi.traverse(sensor)
    if "x_fov" not in params or "to_world" not in params:
        return None
    matrix = np.array(params["to_world"].matrix, np.float64).reshape(4, 4)
    return View(matrix, float(np.array(params["x_fov"]).ravel()[0]))


def side_by_side(views: Sequence[View], size: tuple[int, int]) -> mi.Sensor:
    """Cameras as one sensor, whose pictures of `size` (height, width) lie side by side on its film."""
    film = {"type": "hdrfilm", "height": size[0], "rfilter": {"type": "box"}}
    cameras = {
        f"sensor_{number:03d}": {
            "type": "perspective",
            "fov": view.fov,
            "fov_axis": "x",
            "to_world": mi.ScalarTransform4f(view.to_world),
            "film": film | {"width": size[1]},
        }
        for number, view in enumerate(views)
    }
    return mi.load_dict({"type": "batch", **cameras, "film": film | {"width": size[1] * len(views)}})
