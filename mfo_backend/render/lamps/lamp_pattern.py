# SPDX-License-Identifier: Apache-2.0
"""Tables of what a lamp's nodes multiply its light with: IES, gobos, falloffs.

Choose the variant before importing this. The add-on measures them in Cycles and says how they are
laid out (`blender_addon/bake/lamp_layout.py`).
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# pyright: reportIncompatibleMethodOverride=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import math
from copy import copy
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

MARGIN = 1  # pixels around a disc or a square
NEAR, FAR = 1e-3, 1e3  # metres, of a falloff's first and last column, which are even in their logarithms


class LampPattern:
    """Properties, all of which a lamp may go without: `pattern`, a texture of factors, with `pattern_by` ("direction",
    "normal" or "place"), `pattern_rim` (half angle of a disc, degrees) and `pattern_halves` (1 or 2), and `falloff`, a
    texture of one row. `frame` (3, 3) maps the lamp's space, in which it shines along +Z, to the world."""

    def __init__(self, props: mi.Properties, frame: np.ndarray) -> None:
        self.pattern, self.falloff = (
            props.get_emissive_texture(name) if name in props else None for name in ("pattern", "falloff")
        )
        self.by = str(props.get("pattern_by", "direction"))
        self.halves = int(props.get("pattern_halves", 1))
        self.rim = dr.opaque(mi.Float, math.sin(math.radians(float(props.get("pattern_rim", 90.0))) / 2.0))
        self.rows = [_opaque(row) for row in np.linalg.inv(frame)] if self.pattern is not None else []

    def turned(self, turn: np.ndarray) -> LampPattern:
        """The pattern after a rotation (3, 3) of the lamp."""
        other = copy(self)
        other.rows = [_opaque(turn @ np.array(row, np.float64).ravel()) for row in self.rows]
        return other

    def __bool__(self) -> bool:
        return self.pattern is not None or self.falloff is not None

    def of(self, factor: Any, distance: mi.Float, away: mi.Vector3f, place: tuple[Any, Any] | None = None) -> Any:
        """A `factor` of the lamp times the table's at a distance.

        `away` points from the lamp to what it lights, or for a pattern by normals is that of the lamp; `place` is on a
        square from -1 to 1.
        """
        if self.pattern is not None:
            half, (x, y) = (0, place) if self.by == "place" and place is not None else self._on_disc(away)
            inside = 0.5 - MARGIN / self.pattern.resolution()[1]
            factor = factor * _eval(self.pattern, (half + 0.5 + inside * x) / self.halves, 0.5 - inside * y)
        if self.falloff is not None:
            steps = self.falloff.resolution()[0]
            # so near to 0 and so far that nothing is lit there
            step = dr.log(dr.clip(distance, NEAR, FAR) / NEAR) * ((steps - 1) / math.log(FAR / NEAR))
            factor = factor * _eval(self.falloff, (step + 0.5) / steps, mi.Float(0.5))
        return factor

    def _on_disc(self, away: mi.Vector3f) -> tuple[Any, tuple[Any, Any]]:
        """Which disc a direction lies on, the front (0) or the back, and where, within 1."""
        local = dr.normalize(mi.Vector3f(*(dr.dot(row, away) for row in self.rows)))
        half = mi.Float(0)
        if self.halves == 2:
            back = local.z < 0
            half = dr.select(back, 1, 0)
            local = dr.select(back, mi.Vector3f(-local.x, local.y, -local.z), local)
        scale = dr.rsqrt(dr.maximum(2 * (1 + local.z), 1e-6)) / self.rim
        return half, (dr.clip(local.x * scale, -1, 1), dr.clip(local.y * scale, -1, 1))


def _eval(texture: Any, u: mi.Float, v: mi.Float) -> mi.Color3f:
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(u))
    si.uv = mi.Point2f(u, v)
    return mi.Color3f(texture.eval(si))


def _opaque(row: np.ndarray) -> mi.Vector3f:
    vector = mi.Vector3f(*(float(value) for value in row))
    dr.make_opaque(vector)
    return vector
