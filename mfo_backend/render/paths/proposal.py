# SPDX-License-Identifier: Apache-2.0
"""A density of directions that stays usable while the material moves."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import drjit as dr
import mitsuba as mi


@dataclass(frozen=True)
class DefensiveProposal:
    """A mixture of the cosine lobe and GGX lobes of several roughnesses, all with visible normals.

    The default covers every opaque material a fit may try. Near a known material `around` narrows it, but keeps the
    cosine part and two wide lobes, so that no weight can explode. All proposals have equally many lobes, and their
    numbers are data, so that every one of them uses the same kernels.
    """

    roughness: tuple[float, float, float, float] = (0.1, 0.25, 0.5, 1.0)
    share: tuple[float, float, float, float] = (0.25, 0.25, 0.2, 0.0)

    @property
    def cosine_share(self) -> float:
        """The part of the samples that goes to the cosine lobe."""
        return 1.0 - sum(self.share)

    @staticmethod
    def around(roughness: float) -> DefensiveProposal:
        """A proposal for a material whose main lobe has this roughness."""
        narrow = min(max(roughness, 0.03), 1.0)
        return DefensiveProposal((narrow, min(2.0 * narrow, 1.0), 0.1, 0.5), (0.45, 0.15, 0.05, 0.1))

    @cached_property
    def _lobes(self) -> tuple[mi.Float, list[tuple[mi.Float, mi.Float]]]:
        """The share of the cosine lobe, then alpha and share of each lobe."""
        alpha_and_share = [(r**2, s) for r, s in zip(self.roughness, self.share, strict=True)]
        return dr.opaque(mi.Float, self.cosine_share), [
            (dr.opaque(mi.Float, alpha), dr.opaque(mi.Float, share)) for alpha, share in alpha_and_share
        ]

    def sample(self, wi: mi.Vector3f, lobe: mi.Float, u: mi.Point2f) -> mi.Vector3f:
        """A direction in the shading frame for the random numbers `lobe` and `u` in [0, 1)."""
        wo = mi.warp.square_to_cosine_hemisphere(u)
        cosine, lobes = self._lobes
        used = mi.Float(cosine)
        width = mi.Float(1.0)
        for alpha, share in lobes:
            width = dr.select(lobe >= used, alpha, width)
            used += share
        distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, width, True)
        normal, _ = distribution.sample(wi, u)
        return dr.select(lobe < cosine, wo, mi.reflect(wi, normal))

    def density(self, wi: mi.Vector3f, wo: mi.Vector3f) -> mi.Float:
        """Probability per solid angle of `sample`; 0 below the surface."""
        half = dr.normalize(wi + wo)
        cosine, lobes = self._lobes
        result = cosine * mi.warp.square_to_cosine_hemisphere_pdf(wo)
        for alpha, share in lobes:
            distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True)
            result += share * distribution.pdf(wi, half) / (4.0 * dr.dot(wo, half))
        return dr.select((wi.z > 0.0) & (wo.z > 0.0), result, 0.0)
