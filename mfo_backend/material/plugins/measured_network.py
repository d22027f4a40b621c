# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba plugin `measured_network`: an isotropic measured BRDF as a small network, for references of the bench.

Properties are `filename`, an .npz with the weights of several materials, and `material`, a name in it. Choose the
variant before importing this.

References
----------
Sztrajman et al., "Neural BRDF Representation and Importance Sampling", 2021: half and difference vector as six numbers,
two hidden layers of 21 with ReLU, exp(x) - 1 at the end. Rusinkiewicz, "A New Change of Variables for Efficient BRDF
Representation", 1998: the two vectors.
"""
# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..arrays.own_memory import own_memory

PLUGIN_NAME = "measured_network"


class MeasuredNetwork(mi.BSDF):
    """Reflection only, one-sided; sampled by the cosine."""

    def __init__(self, props: mi.Properties) -> None:
        mi.BSDF.__init__(self, props)
        with np.load(str(props["filename"]), allow_pickle=False) as tables:
            index = list(tables["names"]).index(str(props["material"]))
            layers = [(tables[f"fc{n}"][index], tables[f"b{n}"][index]) for n in (1, 2, 3)]
        self._shapes = [weight.shape for weight, _ in layers]
        # one buffer instead of literals, so that the next material needs no new kernel
        self._numbers = own_memory(np.concatenate([part.ravel() for layer in layers for part in layer]), mi.Float)
        self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
        self.m_flags = self.m_components[0]

    def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
        """See `mi.BSDF.sample`."""
        wo = mi.warp.square_to_cosine_hemisphere(sample2)
        result = mi.BSDFSample3f()
        result.wo, result.eta, result.sampled_component = wo, 1.0, 0
        result.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        result.pdf = self.pdf(ctx, si, wo, active)
        valid = active & (result.pdf > 0.0)
        return result, dr.select(valid, self._value(si.wi, wo) * dr.pi, 0.0)

    def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """See `mi.BSDF.eval`: the BRDF times the cosine."""
        lit = active & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (mi.Frame3f.cos_theta(wo) > 0.0)
        return dr.select(lit, self._value(si.wi, wo) * mi.Frame3f.cos_theta(wo), 0.0)

    def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """See `mi.BSDF.pdf`."""
        lit = active & (mi.Frame3f.cos_theta(si.wi) > 0.0) & (mi.Frame3f.cos_theta(wo) > 0.0)
        return dr.select(lit, mi.warp.square_to_cosine_hemisphere_pdf(wo), 0.0)

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
        """See `mi.BSDF.eval_pdf`."""
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def to_string(self) -> str:
        """A name for Mitsuba's descriptions."""
        return "MeasuredNetwork[]"

    def _value(self, wi: Any, wo: Any) -> Any:
        """The BRDF without the cosine, at least 0."""
        values = [*half_and_difference(wi, wo)]
        offset = 0
        for inputs, outputs in self._shapes:
            bias = offset + inputs * outputs
            sums = [self._number(bias + column) for column in range(outputs)]
            for row, value in enumerate(values):
                for column in range(outputs):
                    sums[column] = dr.fma(value, self._number(offset + row * outputs + column), sums[column])
            offset = bias + outputs
            values = [dr.maximum(total, 0.0) for total in sums]
        return mi.Color3f(*(dr.exp(value) - 1.0 for value in values))

    def _number(self, index: int) -> Any:
        return dr.gather(mi.Float, self._numbers, mi.UInt32(index))


def half_and_difference(wi: Any, wo: Any) -> tuple[Any, ...]:
    """Half vector turned to azimuth 0 and difference vector, six numbers."""
    half = dr.normalize(wi + wo)
    sine = dr.sqrt(dr.maximum(1.0 - half.z * half.z, 0.0))
    along = dr.select(sine > 1e-6, half.x / sine, 1.0)
    across = dr.select(sine > 1e-6, half.y / sine, 0.0)
    # wi turned by -azimuth of the half vector about z, then by its polar angle about y
    x, y = along * wi.x + across * wi.y, along * wi.y - across * wi.x
    return sine, mi.Float(0.0), half.z, half.z * x - sine * wi.z, y, sine * x + half.z * wi.z


def register() -> None:
    """Make the plugin known to Mitsuba's present variant; again for another variant."""
    mi.register_bsdf(PLUGIN_NAME, MeasuredNetwork)
