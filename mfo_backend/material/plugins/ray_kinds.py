# SPDX-License-Identifier: Apache-2.0
"""The kinds of rays that surfaces of `by_ray` tell apart. Can be imported before a variant is chosen."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

# By number: from the camera, after a diffuse bounce, after a glossy one, bent through a surface, and towards a light
RAYS = ("camera", "scattered", "glossy", "transmission", "shadow")
CAMERA, SCATTERED, GLOSSY, TRANSMISSION, SHADOW = range(len(RAYS))
DIFFUSE = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.DiffuseTransmission
THROUGH = mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.DeltaTransmission


def kind_of_ray(sampled_type: Any) -> mi.Float:
    """The number of a ray's kind that left a surface by lobes of this type, in place of a straight passage's."""
    through = dr.select((sampled_type & THROUGH) != 0, mi.Float(TRANSMISSION), GLOSSY)
    return dr.select((sampled_type & DIFFUSE) != 0, SCATTERED, through)


def is_by_ray(scene: mi.Scene) -> bool:
    """Whether some surface of a scene asks for the kind of a ray."""
    return any(getattr(shape.bsdf(), "tells_rays", False) for shape in scene.shapes())
