# SPDX-License-Identifier: Apache-2.0
"""Where camera rays meet the target, and how its frames are turned there."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi

from ..transport.smooth_facets import seen_side


@dataclass
class TargetHits:
    """First hits of the camera rays on the target, and the number of `pixels`.

    Of a mix there is the `plugin`, and `own` are the hits in the frame of the mesh, which its held materials take.
    Of a material whose lobes have normals of their own `diffuse` is that of diffuse ones; `coat` is that of a coat of
    its own, and `smooth` the mesh's, of a mix. Light comes `through` some.
    """

    si: Any
    position: mi.UInt32
    share: mi.Float
    held: tuple[Any, ...]
    pixels: int
    plugin: Any = None
    own: Any = None
    coat: Any = None
    smooth: Any = None
    diffuse: Any = None
    through: bool = False

    def lit(self, wo: mi.Vector3f) -> mi.Bool:
        """Whether light from `wo` reaches the material: below the plane of its microfacets may lie what others see."""
        if self.through:
            return wo.z != 0.0
        lit = wo.z > 0.0 if self.smooth is None else dr.dot(self.smooth, wo) > 0.0
        return lit if self.diffuse is None else lit | (dr.dot(self.diffuse, wo) > 0.0)

    def of_rays(self, ray: mi.UInt32) -> TargetHits:
        """Those of some rays, which may repeat."""
        names = ("si", "position", "share", "own", "coat", "smooth", "diffuse")
        some = {name: dr.gather(type(a), a, ray) for name in names if (a := getattr(self, name)) is not None}
        return replace(self, **some, held=tuple(dr.gather(type(a), a, ray) for a in self.held))


def without_parametrisation(si: mi.SurfaceInteraction3f, *, own_normal: bool) -> mi.SurfaceInteraction3f:
    """Where hits are and how they are turned, perhaps with the mesh's normal: all that lights and proposals need."""
    bare = dr.zeros(mi.SurfaceInteraction3f, dr.width(si))
    bare.t, bare.time, bare.wavelengths = si.t, si.time, si.wavelengths
    bare.p, bare.n, bare.sh_frame, bare.wi = si.p, si.n, si.sh_frame, si.wi
    bare.shape, bare.prim_index = si.shape, si.prim_index
    if own_normal:
        bare.dn_du, bare.dn_dv = si.dn_du, si.dn_dv
    return bare


def facing(
    scene: mi.Scene, shape: mi.Shape, si: mi.SurfaceInteraction3f, *, two_sided: bool
) -> mi.SurfaceInteraction3f:
    """Hits turned to the camera where back faces reflect, as a `two_sided` material's do without a wrapper."""
    if two_sided:
        return _face_camera(seen_side(scene, si))
    return _face_camera(si) if shape.bsdf().class_name() == "TwoSidedBRDF" else si


def _face_camera(si: mi.SurfaceInteraction3f) -> mi.SurfaceInteraction3f:
    """Turn shading frames towards the camera, as the `twosided` plugin does: (x, y, z) -> (x, y, -z)."""
    back = si.wi.z < 0.0
    si.sh_frame.n = dr.select(back, -si.sh_frame.n, si.sh_frame.n)
    si.wi.z = dr.abs(si.wi.z)
    return si


def turned(shape: mi.Shape, si: mi.SurfaceInteraction3f, *, bumped: bool) -> mi.SurfaceInteraction3f:
    """Shading frames turned to the normals of a bumped material's microfacets: light is sampled about them."""
    if not bumped:
        return si
    plugin: Any = shape.bsdf()
    frame, wi, _ = plugin.bumped_frame(si, mi.Bool(True))
    si.sh_frame, si.wi = frame, wi
    return si


def other_normals(
    shape: mi.Shape, si: mi.SurfaceInteraction3f, *, bumped: bool, coat: bool, smooth: bool
) -> tuple[mi.Vector3f | None, mi.Vector3f | None, mi.Vector3f | None]:
    """Of a bumped material the normal of its `coat`, if it has one of its own, the mesh's `smooth` one, and that of its
    diffuse lobes, all in the frame of its microfacets."""
    if not bumped:
        return None, None, None
    plugin: Any = shape.bsdf()
    normals = plugin.bumped_frame(si, mi.Bool(True))[2]
    return (
        normals["coat_normal"] if coat else None,
        normals["smooth_normal"] if smooth else None,
        normals["bumped_normal"],
    )
