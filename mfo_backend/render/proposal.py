# SPDX-License-Identifier: Apache-2.0
"""A density of directions that stays usable while the material moves."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi


@dataclass(frozen=True)
class DefensiveProposal:
    """A mixture of the cosine lobe and GGX lobes of several roughnesses, all with visible normals.

    The default covers every opaque material a fit may try. Near a known material `around` narrows it, but keeps the
    cosine part and two wide lobes, so that no weight can explode.
    """

    roughness: tuple[float, ...] = (0.1, 0.25, 0.5)
    share: tuple[float, ...] = (0.25, 0.25, 0.2)

    @property
    def cosine_share(self) -> float:
        """The part of the samples that goes to the cosine lobe."""
        return 1.0 - sum(self.share)

    @staticmethod
    def around(roughness: float) -> DefensiveProposal:
        """A proposal for a material whose main lobe has this roughness."""
        narrow = min(max(roughness, 0.03), 1.0)
        return DefensiveProposal((narrow, min(2.0 * narrow, 1.0), 0.1, 0.5), (0.45, 0.15, 0.05, 0.1))

    def sample(self, wi: mi.Vector3f, lobe: mi.Float, u: mi.Point2f) -> mi.Vector3f:
        """A direction in the shading frame for the random numbers `lobe` and `u` in [0, 1)."""
        wo = mi.warp.square_to_cosine_hemisphere(u)
        used = mi.Float(self.cosine_share)
        width = mi.Float(1.0)
        for roughness, share in zip(self.roughness, self.share, strict=True):
            width = dr.select((lobe >= used), roughness, width)
            used += share
        distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, dr.square(width), True)
        normal, _ = distribution.sample(wi, u)
        return dr.select(lobe < self.cosine_share, wo, mi.reflect(wi, normal))

    def density(self, wi: mi.Vector3f, wo: mi.Vector3f) -> mi.Float:
        """Probability per solid angle of `sample`; 0 below the surface."""
        half = dr.normalize(wi + wo)
        result = self.cosine_share * mi.warp.square_to_cosine_hemisphere_pdf(wo)
        for roughness, share in zip(self.roughness, self.share, strict=True):
            distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, mi.Float(roughness**2), True)
            result += share * distribution.pdf(wi, half) / (4.0 * dr.dot(wo, half))
        return dr.select((wi.z > 0.0) & (wo.z > 0.0), result, 0.0)
