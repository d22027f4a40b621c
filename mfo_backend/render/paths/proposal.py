# SPDX-License-Identifier: Apache-2.0
"""A density of directions that stays usable while the material moves."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import drjit as dr
import mitsuba as mi

# Of the samples, about the normal of a coat. A coat's bump was 0.79 % too dark without and 0.36 % with it (96 x 96,
# docs/notebook/graph_values.md); other shares were not tried. Larger: what is below the coat has more noise.
COAT_SHARE = 0.2
# Of the samples, to the other side of a surface whose light comes through. A leaf before a sun and a lamp has 14 and
# 5 % of noise in a pixel with 0.25 and with 0.4, a tenth more with 0.6. Larger: what reflects has more noise.
THROUGH_SHARE = 0.4
LEAST_ROUGHNESS, ROUGH_COAT = 0.03, 0.1  # the least of a narrow lobe, and a coat's where nodes give it. No measurement


@dataclass(frozen=True)
class DefensiveProposal:
    """A mixture of the cosine lobe and GGX lobes of several roughnesses, all with visible normals.

    The default covers every opaque material a fit may try. Near a known material `around` narrows it, but keeps the
    cosine part and two wide lobes, so that no weight can explode. All proposals have equally many lobes, and their
    numbers are data, so that every one of them uses the same kernels. A coat with a normal of its own, of a
    `coat_roughness`, has a lobe besides, about what callers give as `coat`: other lobes hardly ever meet its mirrored
    view, and the mean of a few recordings was 0.8 % too dark. The cosine lobe is about the normal of diffuse lobes
    where callers give that as `diffuse`: part of its side may be below the microfacets'. A material that light comes
    `through` has a cosine lobe on the other side, too.
    """

    roughness: tuple[float, float, float, float] = (0.1, 0.25, 0.5, 1.0)
    share: tuple[float, float, float, float] = (0.25, 0.25, 0.2, 0.0)
    coat_roughness: float | None = None
    through: bool = False

    @property
    def cosine_share(self) -> float:
        """The part of the samples that goes to the cosine lobe."""
        return 1.0 - sum(self.share)

    @staticmethod
    def around(roughness: float) -> DefensiveProposal:
        """A proposal for a material whose main lobe has this roughness."""
        narrow = min(max(roughness, LEAST_ROUGHNESS), 1.0)
        return DefensiveProposal((narrow, min(2.0 * narrow, 1.0), 0.1, 0.5), (0.45, 0.15, 0.05, 0.1))

    def with_coat(self, roughness: object) -> DefensiveProposal:
        """The same with a lobe for a coat of this roughness, a number unless nodes give it."""
        return replace(self, coat_roughness=roughness if isinstance(roughness, float) else ROUGH_COAT)

    @cached_property
    def _lobes(self) -> tuple[mi.Float, list[tuple[mi.Float, mi.Float]]]:
        """The share of the cosine lobe, then alpha and share of each lobe."""
        alpha_and_share = [(r**2, s) for r, s in zip(self.roughness, self.share, strict=True)]
        return dr.opaque(mi.Float, self.cosine_share), [
            (dr.opaque(mi.Float, alpha), dr.opaque(mi.Float, share)) for alpha, share in alpha_and_share
        ]

    @property
    def _of_coat(self) -> mi.MicrofacetDistribution:
        assert self.coat_roughness is not None
        alpha = dr.opaque(mi.Float, max(self.coat_roughness, LEAST_ROUGHNESS) ** 2)
        return mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True)

    def sample(
        self,
        wi: mi.Vector3f,
        lobe: mi.Float,
        u: mi.Point2f,
        coat: mi.Vector3f | None = None,
        diffuse: mi.Vector3f | None = None,
    ) -> mi.Vector3f:
        """A direction in the shading frame for the random numbers `lobe` and `u` in [0, 1)."""
        if not self.through:
            return self._reflected(wi, lobe, u, coat, diffuse)
        cosine = mi.warp.square_to_cosine_hemisphere(u)
        beyond = -(cosine if diffuse is None else mi.Frame3f(diffuse).to_world(cosine))
        others = self._reflected(wi, (lobe - THROUGH_SHARE) / (1.0 - THROUGH_SHARE), u, coat, diffuse)
        if diffuse is None:  # of these `density` knows none below the surface
            others = dr.select(others.z > 0.0, others, 0.0)
        return dr.select(lobe < THROUGH_SHARE, beyond, others)

    def _reflected(
        self,
        wi: mi.Vector3f,
        lobe: mi.Float,
        u: mi.Point2f,
        coat: mi.Vector3f | None,
        diffuse: mi.Vector3f | None,
    ) -> mi.Vector3f:
        """`sample` of the lobes that reflect."""
        if coat is not None:
            frame = mi.Frame3f(coat)
            local = frame.to_local(wi)
            mirrored = mi.reflect(local, self._of_coat.sample(local, u)[0])
            others = self._reflected(wi, (lobe - COAT_SHARE) / (1.0 - COAT_SHARE), u, None, diffuse)
            return dr.select(lobe < COAT_SHARE, frame.to_world(mirrored), others)
        wo = mi.warp.square_to_cosine_hemisphere(u)
        if diffuse is not None:
            wo = mi.Frame3f(diffuse).to_world(wo)
        cosine, lobes = self._lobes
        used = mi.Float(cosine)
        width = mi.Float(1.0)
        for alpha, share in lobes:
            width = dr.select(lobe >= used, alpha, width)
            used += share
        distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, width, True)
        normal, _ = distribution.sample(wi, u)
        return dr.select(lobe < cosine, wo, mi.reflect(wi, normal))

    def density(
        self,
        wi: mi.Vector3f,
        wo: mi.Vector3f,
        coat: mi.Vector3f | None = None,
        diffuse: mi.Vector3f | None = None,
    ) -> mi.Float:
        """Probability per solid angle of `sample`; of what only reflects, without `diffuse`, 0 below the surface."""
        if not self.through:
            return self._reflected_density(wi, wo, coat, diffuse)
        cosine = dr.maximum(-wo.z if diffuse is None else -dr.dot(diffuse, wo), 0.0) / dr.pi
        beyond = dr.select(wi.z > 0.0, cosine, 0.0)
        return THROUGH_SHARE * beyond + (1.0 - THROUGH_SHARE) * self._reflected_density(wi, wo, coat, diffuse)

    def _reflected_density(
        self, wi: mi.Vector3f, wo: mi.Vector3f, coat: mi.Vector3f | None, diffuse: mi.Vector3f | None
    ) -> mi.Float:
        """`density` of the lobes that reflect."""
        if coat is not None:
            frame = mi.Frame3f(coat)
            from_coat, to_coat = frame.to_local(wi), frame.to_local(wo)
            middle = dr.normalize(from_coat + to_coat)
            own = self._of_coat.pdf(from_coat, middle) / (4.0 * dr.dot(to_coat, middle))
            kept = (to_coat.z > 0.0) & (wo.z > 0.0) if diffuse is None else middle.z > 0.0
            own = dr.select((from_coat.z > 0.0) & kept, own, 0.0)
            return COAT_SHARE * own + (1.0 - COAT_SHARE) * self._reflected_density(wi, wo, None, diffuse)
        half = dr.normalize(wi + wo)
        cosine, lobes = self._lobes
        result = cosine * mi.warp.square_to_cosine_hemisphere_pdf(wo) if diffuse is None else mi.Float(0.0)
        for alpha, share in lobes:
            distribution = mi.MicrofacetDistribution(mi.MicrofacetType.GGX, alpha, True)
            result += share * distribution.pdf(wi, half) / (4.0 * dr.dot(wo, half))
        if diffuse is None:
            return dr.select((wi.z > 0.0) & (wo.z > 0.0), result, 0.0)
        # what is seen of microfacets mirrors to below their plane, too
        result = dr.select(half.z > 0.0, result, 0.0) + cosine * dr.maximum(dr.dot(diffuse, wo), 0.0) / dr.pi
        return dr.select(wi.z > 0.0, result, 0.0)
