# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba texture `mapped_normal`: the normal of a map in the frame of a surface's UV, as a direction of the world.

Choose the variant before importing this. Its properties are the texture `map`, whose colours are (n + 1) / 2 with the
third axis along the smooth normal and the first along u, as for Mitsuba's BSDF `normalmap`, and the boolean `turned`,
as that of `projective`. It is for the property `normal` of `blender_principled`, which knows what Cycles does beside a
bent normal and `normalmap` does not.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# pyright: reportIncompatibleMethodOverride=false

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

PLUGIN_NAME = "mapped_normal"


class MappedNormal(mi.Texture):
    """A normal map as directions, which are those of the mesh's front; on its back they are mirrored or `turned`."""

    def __init__(self, props: mi.Properties) -> None:
        mi.Texture.__init__(self, props)
        self.map: Any = props["map"]
        self.turned = bool(props.get("turned", False))  # as a Normal Map on a back face, and not as a Bump

    def traverse(self, callback: Any) -> None:
        """Show the map."""
        callback.put("map", self.map, mi.ParamFlags.NonDifferentiable)

    @property
    def surface(self) -> MappedNormal:
        """What knows which side is seen."""
        return self

    def is_behind(self, si: mi.SurfaceInteraction3f) -> Any:
        """Whether the back of the mesh is seen."""
        return is_behind(si)

    def eval(self, si: mi.SurfaceInteraction3f, active: Any = True) -> mi.Color3f:
        """Unit vectors of the world."""
        local = 2 * mi.Vector3f(self.map.eval_3(si, active)) - 1
        return mi.Color3f(dr.normalize(si.to_world(local)))

    def is_spatially_varying(self) -> bool:
        """Always."""
        return True


def is_behind(si: mi.SurfaceInteraction3f) -> Any:
    """Whether the back of a mesh is seen."""
    return dr.dot(si.n, si.to_world(si.wi)) < 0


def register() -> None:
    """Make `mapped_normal` known to Mitsuba in the current variant."""
    mi.register_texture(PLUGIN_NAME, MappedNormal)
