# SPDX-License-Identifier: Apache-2.0
"""The mesh's normal at a surface point whose frame is bent towards the view.

Mitsuba's surface interaction has no place for a second normal. `dn_du` and `dn_dv`, which nothing here reads, are both
that normal where it is known; as derivatives of normals they are equal where both are zero alone. Choose the variant
before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportReturnType=false, reportAttributeAccessIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi


def keep_own_normal(si: mi.SurfaceInteraction3f, normal: mi.Vector3f) -> None:
    """Let the surface point know the mesh's normal, on the side of the facet that is seen."""
    si.dn_du = si.dn_dv = normal


def own_normal(si: mi.SurfaceInteraction3f, instead: mi.Vector3f) -> Any:
    """The mesh's normal, or another where the point does not know it."""
    known = dr.all(si.dn_du == si.dn_dv) & (dr.squared_norm(si.dn_du) > 0.25)
    return dr.select(known, mi.Vector3f(si.dn_du), instead)
