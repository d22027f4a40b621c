# SPDX-License-Identifier: Apache-2.0
"""What light below a surface stays inside of: its own shape, or all shapes whose attribute `BODY` is its own's.

Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from .smooth_facets import shape_number, shape_table

BODY = "body"


def bodies_of(scene: mi.Scene) -> mi.UInt32 | None:
    """The body of each shape by its number in this process, 0 of one by itself; None where all are."""
    numbered = [(shape, int(shape_number(shape, BODY))) for shape in scene.shapes()]
    numbered = [(shape, number) for shape, number in numbered if number]
    return shape_table(*map(list, zip(*numbered, strict=True)), mi.UInt32) if numbered else None


def _body_of(shape: mi.ShapePtr, bodies: mi.UInt32) -> mi.UInt32:
    number = dr.reinterpret_array(mi.UInt32, shape)
    known = number < dr.opaque(mi.UInt32, dr.width(bodies))
    return dr.select(known, dr.gather(mi.UInt32, bodies, number, known), 0)


def met_inside(
    scene: mi.Scene,
    bodies: mi.UInt32 | None,
    ray: mi.Ray3f,
    shape: mi.ShapePtr,
    prim: mi.UInt32,
    first: mi.Bool,
    active: mi.Bool,
) -> mi.PreliminaryIntersection3f:
    """The first hit of a body on a ray from within; where a walk enters, `first`, not the triangle `prim`."""
    found = scene.ray_intersect_preliminary(ray, active=active)

    def is_other(found, active):
        entered = (found.shape == shape) & first & (found.prim_index == prim)
        own = found.shape == shape
        if bodies is not None:
            body = _body_of(shape, bodies)
            own |= (body > 0) & (_body_of(found.shape, bodies) == body)
        return active & found.is_valid() & (entered | ~own)

    def onward(found, passed, passing):
        start = passed + found.t * (1.0 + 1e-6) + 1e-7
        rest = mi.Ray3f(ray.o + start * ray.d, ray.d, ray.maxt - start, 0.0, mi.Color0f())
        further = scene.ray_intersect_preliminary(rest, active=passing)
        found = dr.select(passing, further, found)
        passed = dr.select(passing, start, passed)
        return found, passed, is_other(found, passing)

    found, passed, _ = dr.while_loop(
        (found, dr.zeros(mi.Float, dr.width(ray.o)), is_other(found, active)), lambda f, p, passing: passing, onward,
        label="other shapes",
    )  # fmt: skip
    found.t = found.t + passed
    return found
