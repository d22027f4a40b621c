# SPDX-License-Identifier: Apache-2.0
"""Cameras that a scene does not have: its own, turned around the target."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from collections.abc import Sequence

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray


def target_center(shape: mi.Shape) -> NDArray[np.float64]:
    """Middle of a shape's bounding box in world space, (3,)."""
    return np.array(shape.bbox().center(), np.float64).ravel()


def turned_cameras(
    sensor: mi.Sensor, center: NDArray[np.float64], turns: Sequence[float], size: tuple[int, int]
) -> mi.Sensor | None:
    """A perspective camera at several turns around the vertical (world Z) through `center`, as one sensor.

    Their pictures of `size` (height, width) lie side by side on its film. `turns` are degrees; from above, a positive
    one goes against the clock. None for cameras of other kinds.
    """
    params = mi.traverse(sensor)
    if "x_fov" not in params or "to_world" not in params:
        return None
    matrix = np.array(params["to_world"].matrix, np.float64).reshape(4, 4)
    fov = float(np.array(params["x_fov"]).ravel()[0])
    film = {"type": "hdrfilm", "height": size[0], "rfilter": {"type": "box"}}
    cameras = {}
    for number, degrees in enumerate(turns):
        turn, c, s = np.eye(4), math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        turn[:2, :2] = [[c, -s], [s, c]]
        turn[:3, 3] = center - turn[:3, :3] @ center
        cameras[f"sensor_{number:03d}"] = {
            "type": "perspective",
            "fov": fov,
            "fov_axis": "x",
            "to_world": mi.ScalarTransform4f(turn @ matrix),
            "film": film | {"width": size[1]},
        }
    return mi.load_dict({"type": "batch", **cameras, "film": film | {"width": size[1] * len(turns)}})
