# SPDX-License-Identifier: Apache-2.0
"""What materials with an absorbing volume take of light on its way inside of their objects.

Cycles keeps a set of the volumes that a path is inside of, one of each object and material: light that crosses a
surface to its inner side enters, and leaves by any of its surfaces on the way back, so that shells within each other
count once, up to the first that is left (kernel/integrator/volume_stack.h). Here that is one of each material. A
segment of length d takes exp(-sigma d) of each channel, sigma = density (1 - color), negative parts 0
(kernel/svm/closure.h, svm_node_closure_volume). Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

DENSITY, COLOR = "absorption_density", "absorption_color"
Inside = list[Any]  # mi.Bool for each absorbing material


def coefficient(density: Any, color: Any) -> mi.Color3f:
    """Absorption per scene unit (RGB) of a Volume Absorption node's values."""
    return dr.maximum(density, 0) * dr.maximum(1 - mi.Color3f(color), 0)


class Absorption:
    """The absorbing materials of a scene, each a BSDF that has `absorbing`, a material with density and colour."""

    def __init__(self, scene: mi.Scene) -> None:
        materials = {id(s.bsdf()): s.bsdf() for s in scene.shapes() if _absorbs(s.bsdf())}
        self.materials = list(materials.values())

    def __bool__(self) -> bool:
        return bool(self.materials)

    def outside(self) -> Inside:
        """Of a path that begins outside of all."""
        return [mi.Bool(False) for _ in self.materials]

    def coefficients(self) -> list[mi.Color3f]:
        """Of each material, with derivatives where its values have some."""
        return [coefficient(getattr(b.absorbing, DENSITY), getattr(b.absorbing, COLOR)) for b in self.materials]

    def lengths(self, inside: Inside, distance: mi.Float) -> list[mi.Float]:
        """How far a segment goes through each material; nothing where it never ends."""
        finite = dr.isfinite(distance)
        return [dr.select(finite & within, distance, mi.Float(0)) for within in inside]

    def further(self, lengths: list[mi.Float], inside: Inside, distance: mi.Float) -> list[mi.Float]:
        """`lengths` with those of one more segment."""
        return [a + b for a, b in zip(lengths, self.lengths(inside, distance), strict=True)]

    def left(self, lengths: list[mi.Float]) -> mi.Color3f:
        """What so much way through each material leaves of light, RGB."""
        depth = mi.Color3f(0)
        for sigma, length in zip(self.coefficients(), lengths, strict=True):
            depth += sigma * length
        return dr.exp(-depth)

    def beyond(self, inside: Inside, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: mi.Bool) -> Inside:
        """Where light is that goes on from `si` in a direction `wo` of the shading frame."""
        seen, sent = dr.dot(si.n, si.to_world(si.wi)), dr.dot(si.n, si.to_world(wo))
        return self.crossed(inside, si, active & (seen * sent < 0))

    def crossed(self, inside: Inside, si: mi.SurfaceInteraction3f, active: mi.Bool) -> Inside:
        """Where light is that has gone through the surface at `si`, which it meets from `si.wi`."""
        enters = dr.dot(si.n, si.to_world(si.wi)) > 0
        bsdf = si.bsdf()
        after = []
        for within, material in zip(inside, self.materials, strict=True):
            own = active & (bsdf == mi.BSDFPtr(material))
            after.append(dr.select(own, enters, within))
        return after


def _absorbs(bsdf: Any) -> bool:
    return getattr(bsdf, "absorbing", None) is not None
