# SPDX-License-Identifier: Apache-2.0
"""The light of a surface as Blender's have it: from both sides of every face.

Mitsuba's `area` shines on one side. A second mesh for the other would be a surface of its own, at which glass refracts
the wrong way. Densities of light samples go by the faces' own normals, so what asks for one has to give it those.
Choose the variant before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# pyright: reportIncompatibleMethodOverride=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi

from .face_points import FacePoints


class Glow(mi.Emitter):
    """Properties: `radiance`, linear Rec.709, a colour or a texture over the shape it belongs to.

    `layered` (false) is whether what the shape's BSDF has above takes its part of that: by what it has `emitted` of 1,
    if it can say, else by alpha. What is `of_surface` (false) has no radiance of its own: it is what the BSDF says that
    it has `emitted`, times `scale` (1), so that whoever changes the BSDF changes the light.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        self.radiance = props.get_emissive_texture("radiance", 1.0)
        self.scale = dr.opaque(mi.Float, float(props.get("scale", 1.0)))
        self.of_surface = bool(props.get("of_surface", False))
        self.layered = self.of_surface or bool(props.get("layered", False))
        self.m_flags = +mi.EmitterFlags.Surface
        if self.radiance.is_spatially_varying():
            self.m_flags |= +mi.EmitterFlags.SpatiallyVarying

    def traverse(self, callback: Any) -> None:
        """See `mi.Object`."""
        callback.put("radiance", self.radiance, mi.ParamFlags.Differentiable)

    def eval(self, si: mi.SurfaceInteraction3f, active: Any = True) -> mi.Color3f:
        """See `mi.Emitter`."""
        return dr.select(active, self._sent(si, active, sampled=False), 0.0)

    def _sent(self, si: mi.SurfaceInteraction3f, active: Any, *, sampled: bool) -> mi.Color3f:
        """The radiance towards `si.wi`, perhaps to a point that has `sampled` the light."""
        if self.of_surface:
            return dr.maximum(self.get_shape().bsdf().emitted(si, active, sampled=sampled), 0) * self.scale
        return self.radiance.eval(si, active) * self._share(si, active, sampled=sampled)

    def _share(self, si: mi.SurfaceInteraction3f, active: Any = True, *, sampled: bool) -> mi.Color3f:
        """What layers above leave of the radiance towards the view, or towards a point that has `sampled` the light."""
        if not self.layered:
            return mi.Color3f(1.0)
        bsdf: Any = self.get_shape().bsdf()
        if hasattr(bsdf, "emitted"):
            one = {"emission_color": mi.Color3f(1.0), "emission_strength": mi.Float(1.0)}
            return bsdf.emitted(si, active, sampled=sampled, **one)
        return 1.0 - mi.Color3f(bsdf.eval_null_transmission(si, active))

    def unlayered(self, si: mi.SurfaceInteraction3f, active: Any = True) -> mi.Color3f:
        """What is sent out below all layers, of an emission of the BSDF of 1 where it is that."""
        return mi.Color3f(self.scale if self.of_surface else self.radiance.eval(si, active))

    def sample_direction(
        self, it: mi.Interaction3f, sample: mi.Point2f, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Color3f]:
        """See `mi.Emitter`."""
        points = self._points
        aim = self.get_shape().sample_direction if points is None else points.sample
        ds = aim(it, sample, active)
        ds.emitter = mi.EmitterPtr(self)
        active = active & (ds.pdf > 0.0)
        return ds, dr.select(active, self.eval_direction(it, ds, active) / ds.pdf, 0.0)

    def pdf_direction(self, it: mi.Interaction3f, ds: mi.DirectionSample3f, active: Any = True) -> mi.Float:
        """See `mi.Emitter`."""
        return dr.select(active, self.get_shape().pdf_direction(it, ds, active), 0.0)

    def eval_direction(self, it: mi.Interaction3f, ds: mi.DirectionSample3f, active: Any = True) -> mi.Color3f:
        """See `mi.Emitter`."""
        si = mi.SurfaceInteraction3f(ds, it.wavelengths)
        si.wi = si.to_local(-ds.d)
        return dr.select(active, self._sent(si, active, sampled=True), 0.0)

    @cached_property
    def _points(self) -> FacePoints | None:
        """Points of a mesh with bent normals; Mitsuba has those of all other shapes."""
        shape: Any = self.get_shape()
        return FacePoints.of(shape) if isinstance(shape, mi.Mesh) and shape.has_vertex_normals() else None

    def to_string(self) -> str:
        """See `mi.Object`."""
        return f"Glow[radiance = {self.radiance}]"
