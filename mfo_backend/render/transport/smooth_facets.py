# SPDX-License-Identifier: Apache-2.0
"""Smooth-shaded triangles as Cycles sees them: where shadow rays start, and normals that turn away from the view.

A facet of a smooth mesh would shadow itself where light grazes it. Cycles 4.2 to 5.2 lets a shadow ray start above the
facet (kernel/light/sample.h, shadow_ray_offset; Blender's Geometry Offset, 0.1 by default) and may bend the cosine of
the light (kernel/closure/bsdf.h, shift_cos_in; Shading Offset). An object's two numbers are the attributes
`GEOMETRY_OFFSET` and `SHADING_OFFSET` of its shapes. Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...material.arrays.own_memory import own_memory
from ...material.plugins.own_normal import keep_own_normal

GEOMETRY_OFFSET, SHADING_OFFSET = "shadow_geometry_offset", "shadow_shading_offset"
# Cosine between the normals of a triangle's corners above which its own shadow lies in the last 0.6 degrees of the
# light, where the cosine is below 0.01
FLAT = 0.99995
TRANSMITS = mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.DeltaTransmission | mi.BSDFFlags.DiffuseTransmission


class ShadowTerminator:
    """The triangles of a scene whose shadow rays do not start where they are hit."""

    def __init__(self, scene: mi.Scene) -> None:
        lifted = [s for s in scene.shapes() if s.is_mesh() and shape_number(s, GEOMETRY_OFFSET) > 0.0 and _is_bent(s)]
        bent = [s for s in scene.shapes() if shape_number(s, SHADING_OFFSET) > 0.0]
        self.lifts, self.bends = bool(lifted), bool(bent)
        if self.lifts:
            sizes = np.array([(s.face_count(), s.vertex_count()) for s in lifted])
            faces, vertices = np.vstack([[0, 0], np.cumsum(sizes, axis=0)[:-1]]).T
            corners = [np.array(s.faces_buffer()) + first for s, first in zip(lifted, vertices, strict=True)]
            self._corners = own_memory(np.concatenate(corners), mi.UInt32)
            self._positions, self._normals = (
                own_memory(np.concatenate([np.array(getattr(s, f"vertex_{name}_buffer")()) for s in lifted]), mi.Float)
                for name in ("positions", "normals")
            )
            self._first = shape_table(lifted, faces, mi.UInt32)
            self._cutoff = shape_table(lifted, [shape_number(s, GEOMETRY_OFFSET) for s in lifted], mi.Float)
        # Cycles asks the normal that a displacement by bump has bent how far light grazes
        self._displaced, self._bumped = (
            [(s, s.bsdf()) for s in some if "shading_normal" in getattr(s.bsdf(), "directions", ())]
            for some in (lifted, bent)
        )
        if self.bends:
            self._frequency = shape_table(
                bent, [1.0 / (1.0 - 0.5 * shape_number(s, SHADING_OFFSET)) for s in bent], mi.Float
            )

    @staticmethod
    def of(scene: mi.Scene) -> ShadowTerminator:
        """That of a scene, which its integrator keeps if it is one in Python: large meshes take a while to read."""
        kept: dict[str, Any] = getattr(scene.integrator(), "__dict__", {})
        found = kept.get("shadow_terminator")
        if found is None:
            found = kept["shadow_terminator"] = ShadowTerminator(scene)
        return found

    def bend(self, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: mi.Bool) -> mi.Float | float:
        """The factor of light from `wo`, in the shading frame, whose side of the surface `si.wi` is on."""
        if not self.bends:
            return 1.0
        shape, known = _index(si, self._frequency)
        frequency = dr.gather(mi.Float, self._frequency, shape, active & known)
        signed = dr.mulsign(wo.z, si.wi.z)
        for each, material in self._bumped:
            along = dr.dot(material.shading_normal(si, active), si.to_world(wo))
            signed = dr.select(si.shape == mi.ShapePtr(each), along, signed)
        cosine = dr.clip(signed, 0.0, 1.0)
        bent = dr.maximum(dr.cos(dr.safe_acos(cosine) * frequency), 0.0) / dr.maximum(cosine, 1e-6)
        reflected = active & known & (signed > 0.0) & (frequency > 1.0)
        return dr.select(reflected, bent, 1.0)

    def lift(self, si: mi.SurfaceInteraction3f, towards: mi.Vector3f, active: mi.Bool) -> mi.Vector3f | float:
        """How far from `si` the ray starts whose obstacles say whether light from a direction reaches it."""
        if not self.lifts:
            return 0.0
        shape, known = _index(si, self._cutoff)
        cutoff = dr.gather(mi.Float, self._cutoff, shape, active & known)
        on = active & known & (cutoff > 0.0)
        face = dr.gather(mi.UInt32, self._first, shape, on) + si.prim_index
        corner = [dr.gather(mi.UInt32, self._corners, 3 * face + k, on) for k in range(3)]
        v = [dr.gather(mi.Vector3f, self._positions, c, on) for c in corner]
        n = [dr.gather(mi.Vector3f, self._normals, c, on) for c in corner]
        weights = _barycentric(v, mi.Vector3f(si.p))
        normal = sum((w * a for w, a in zip(weights[1:], n[1:], strict=True)), weights[0] * n[0])
        # as Cycles has them: both turned to the side from which the triangle is seen
        back = dr.dot(si.n, si.to_world(si.wi)) < 0.0
        geometric, shading = (dr.select(back, -a, a) for a in (mi.Vector3f(si.n), dr.normalize(normal)))
        for each, material in self._displaced:
            shading = dr.select(si.shape == mi.ShapePtr(each), material.shading_normal(si, on), shading)
        cosine = dr.dot(shading, towards)
        geometric = dr.select(cosine < 0.0, -geometric, geometric)
        cosine, true_cosine = dr.abs(cosine), dr.dot(geometric, towards)
        span = dr.maximum(cutoff, 1e-6)
        near = dr.select(cosine < cutoff, 2.0 - (true_cosine + cosine) / span, 1.0 - true_cosine / span)
        amount = dr.clip(near, 0.0, 1.0)
        height = _height(v, n, weights, dr.dot(normal, geometric) > 0.0)
        return dr.select(on, normal * (height * amount), 0.0)


def follows_cycles(scene: mi.Scene) -> bool:
    """Whether pictures of a scene are as Cycles makes them, and not as Mitsuba's own integrators do."""
    return hasattr(scene.integrator(), "transparent_bounces")


def seen_side(scene: mi.Scene, si: mi.SurfaceInteraction3f) -> mi.SurfaceInteraction3f:
    """Bend shading normals towards the triangle's own where a mirror would reflect the view into the surface.

    That is Cycles' rule for glossy lobes (kernel/closure/bsdf_util.h, ensure_valid_specular_reflection): the mirrored
    view is lifted to a cosine of 0.01, or 0.9 of the view's own. It matters near the outline of a coarse mesh and for
    custom normals. Cycles leaves diffuse lobes at the normal they had: materials with `own_normals` ask the surface
    point for that, and of all others the frame is that of all lobes. Mitsuba's integrators bend nothing: the light that
    a smooth metal of 9,500 triangles sends to itself is an eighth less.
    """
    if not follows_cycles(scene):
        return si
    view = si.to_world(si.wi)
    side = dr.select(dr.dot(si.n, view) < 0.0, mi.Float(-1.0), mi.Float(1.0))
    facet, normal = side * mi.Vector3f(si.n), side * mi.Vector3f(si.sh_frame.n)
    height = dr.dot(facet, view)
    least = dr.minimum(0.9 * height, 0.01)
    below = dr.dot(facet, 2.0 * dr.dot(normal, view) * normal - view) < least
    across = normal - dr.dot(normal, facet) * facet
    length = dr.norm(across)
    below &= (length > 1e-5) & (height > 0.0)
    across /= dr.maximum(length, 1e-5)
    # the cosine z of the new normal with the facet's solves 4 a z^4 - 2 b z^2 + c = 0
    along = dr.dot(across, view)
    a = dr.square(along) + dr.square(height)
    b, c = 2.0 * (a + height * least), dr.square(height + least)
    root = dr.safe_sqrt(b * b - 4.0 * a * c)
    z = dr.minimum(0.25 * (b + dr.select(along < 0.0, root, -root)) / dr.maximum(a, 1e-20), 1.0)
    bent = dr.normalize(dr.safe_sqrt(1.0 - z) * across + dr.safe_sqrt(z) * facet)
    if getattr(scene.integrator(), "own_normals", False):
        keep_own_normal(si, normal)
    n = mi.Normal3f(dr.select(below, side * bent, mi.Vector3f(si.sh_frame.n)))
    s = dr.select(below, dr.normalize(dr.fma(-n, dr.dot(n, si.sh_frame.s), si.sh_frame.s)), si.sh_frame.s)
    t = dr.select(below, dr.cross(n, s), si.sh_frame.t)
    si.sh_frame.n, si.sh_frame.s, si.sh_frame.t = n, s, t
    si.wi = dr.select(below, si.to_local(view), si.wi)
    return si


def met_light(scene: mi.Scene, si: mi.SurfaceInteraction3f, it: mi.Interaction3f) -> mi.DirectionSample3f:
    """What emitters are asked with for the density of a ray from `it` that has met `si`; its normal is the facet's."""
    ds = mi.DirectionSample3f(scene, si, it)
    ds.n = si.n  # not the bent one, which is no facet's area
    return ds


def leaves_on(scene: mi.Scene, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, through: mi.Bool | bool) -> mi.Bool:
    """Whether a sampled direction `wo` (shading frame) is on the side of the facet that its lobe sends light to.

    Cycles drops samples that bent normals send to the other side, and evaluates light samples there all the same
    (kernel/closure/bsdf_microfacet.h). Mitsuba's integrators follow them.
    """
    if not follows_cycles(scene):
        return mi.Bool(True)
    seen, sent = dr.dot(si.n, si.to_world(si.wi)), dr.dot(si.n, si.to_world(wo))
    return ((seen * sent) < 0.0) == through


def _barycentric(v: list[mi.Vector3f], p: mi.Vector3f) -> tuple[mi.Float, mi.Float, mi.Float]:
    """Weights of the corners `v` at the point `p` of their triangle."""
    a, b, c = v[1] - v[0], v[2] - v[0], p - v[0]
    aa, ab, bb, ac, bc = dr.dot(a, a), dr.dot(a, b), dr.dot(b, b), dr.dot(a, c), dr.dot(b, c)
    inverse = 1.0 / dr.maximum(aa * bb - ab * ab, 1e-38)
    second, third = (bb * ac - ab * bc) * inverse, (aa * bc - ab * ac) * inverse
    return 1.0 - second - third, second, third


def _height(
    v: list[mi.Vector3f], n: list[mi.Vector3f], weights: tuple[mi.Float, mi.Float, mi.Float], outwards: mi.Bool
) -> mi.Float:
    """How far, in lengths of the interpolated normal, the curved surface lies above the triangle; below it if not
    `outwards`.

    At least half a parabola through the corners, and where all tangent planes of the corners lie outside, up to those.
    """
    u, w = weights[0], weights[1]
    a, b, c = dr.dot(n[2] - n[0], v[0] - v[2]), dr.dot(n[2] - n[1], v[1] - v[2]), dr.dot(n[1] - n[0], v[1] - v[0])
    parabola = a * u * (u - 1.0) + (a + b + c) * u * w + b * w * (w - 1.0)
    sign = dr.select(outwards, 1.0, -1.0)
    planes = []
    for k in range(3):
        # signed distances of the other corners and of the point from the tangent plane of corner k
        first, second = (dr.dot(v[(k + step) % 3] - v[k], n[k]) for step in (1, 2))
        point = weights[(k + 1) % 3] * first + weights[(k + 2) % 3] * second
        highest = dr.maximum(dr.maximum(sign * first, sign * second), 0.0)
        planes.append(dr.maximum(highest - sign * point, 0.0))
    envelope = dr.minimum(dr.minimum(planes[0], planes[1]), planes[2])
    return sign * dr.maximum(envelope, 0.5 * sign * parabola)


def shape_number(shape: mi.Shape, name: str) -> float:
    """A shape's attribute of one number, 0 where it has none."""
    if not np.any(shape.has_attribute(name)):
        return 0.0
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.shape = mi.ShapePtr(shape)
    return float(np.array(shape.eval_attribute_1(name, si))[0])


def _is_bent(mesh: Any) -> bool:
    """Whether some triangle's corners have clearly different normals."""
    if not mesh.has_vertex_normals():
        return False
    faces = np.array(mesh.faces_buffer()).reshape(-1, 3)
    n = np.array(mesh.vertex_normals_buffer()).reshape(-1, 3)
    return bool(any((np.einsum("ij,ij->i", n[faces[:, k]], n[faces[:, k - 1]]) < FLAT).any() for k in range(3)))


def shape_table(shapes: list[Any], values: Any, kind: type) -> Any:
    """A table of one value a shape by its number in this process, 0 where it has none."""
    numbers = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(s))[0]) for s in shapes]
    table = np.zeros(max(numbers) + 1, np.float32 if kind is mi.Float else np.uint32)
    table[numbers] = values
    return own_memory(table, kind)


def _index(si: mi.SurfaceInteraction3f, table: Any) -> tuple[mi.UInt32, mi.Bool]:
    """The number of each shape in `table`, and whether it is in there."""
    number = dr.reinterpret_array(mi.UInt32, si.shape)
    return number, number < dr.opaque(mi.UInt32, dr.width(table))
