# SPDX-License-Identifier: Apache-2.0
"""A density must integrate to one and be the density of its own samples."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

load_variant()

from mfo_backend.render.paths.proposal import DefensiveProposal  # noqa: E402  after the variant is set

PROPOSALS = {"any": DefensiveProposal(), "sharp": DefensiveProposal.around(0.1), "rough": DefensiveProposal.around(0.9)}


@pytest.mark.parametrize("name", PROPOSALS)
@pytest.mark.parametrize("cosine", [0.95, 0.4])
def test_samples_follow_the_density(name, cosine):
    proposal = PROPOSALS[name]
    n = 400_000
    wi = dr.normalize(mi.Vector3f(float(np.sqrt(1 - cosine**2)), 0.0, cosine))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, n)
    wo = proposal.sample(wi, sampler.next_1d(), sampler.next_2d())
    density = np.array(proposal.density(wi, wo))
    above = np.array(wo.z) > 0
    # E[cos / density] is the integral of the cosine over the hemisphere
    valid = above & (density > 0)
    ratio = np.where(valid, 1.0 / np.maximum(density, 1e-9), 0.0)
    assert np.mean(ratio * np.array(wo.z)) == pytest.approx(np.pi, rel=0.01)  # 400 000 samples of weight at most 2 pi


@pytest.mark.parametrize("diffuse", [None, (0.4, 0.0, 0.917)], ids=["plain", "bumped"])
def test_light_from_behind_has_a_lobe_on_the_other_side(diffuse):
    """The integral of 1 + cos over all directions, which samples of a wrong density miss on either side."""
    proposal, n = replace(DefensiveProposal.around(0.3), through=True), 400_000
    normal = None if diffuse is None else mi.Vector3f(*diffuse)
    wi = mi.Vector3f(0.6, 0.0, 0.8)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, n)
    wo = proposal.sample(wi, sampler.next_1d(), sampler.next_2d(), None, normal)
    density, z = np.array(proposal.density(wi, wo, None, normal)), np.array(wo.z)
    for side in (z > 0.0, z < 0.0):
        valid = side & (density > 0.0)
        ratio = np.where(valid, np.abs(z) / np.maximum(density, 1e-9), 0.0)
        assert np.mean(ratio) == pytest.approx(np.pi, rel=0.015)


def test_no_weight_explodes():
    cosines = np.linspace(0.01, 1.0, 50)
    wo = mi.Vector3f(mi.Float(np.sqrt(1 - cosines**2)), 0.0, mi.Float(cosines))
    for proposal in PROPOSALS.values():
        density = np.array(proposal.density(mi.Vector3f(0.0, 0.0, 1.0), wo))
        assert (cosines / density).max() < np.pi / proposal.cosine_share * 1.001


def test_a_coat_with_a_normal_of_its_own_has_a_lobe_there():
    proposal, coat = DefensiveProposal.around(0.5).with_coat(0.05), mi.Vector3f(0.3, 0.0, 0.954)
    n = 400_000
    wi = mi.Vector3f(0.0, 0.6, 0.8)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, n)
    wo = proposal.sample(wi, sampler.next_1d(), sampler.next_2d(), coat)
    density = np.array(proposal.density(wi, wo, coat))
    valid = (np.array(wo.z) > 0) & (density > 0)
    ratio = np.where(valid, 1.0 / np.maximum(density, 1e-9), 0.0)
    assert np.mean(ratio * np.array(wo.z)) == pytest.approx(np.pi, rel=0.015)
    mirrored = 2.0 * dr.dot(wi, coat) * coat - wi
    assert proposal.density(wi, mirrored, coat)[0] > 100.0 * proposal.density(wi, mirrored)[0]


def test_the_cosine_lobe_follows_the_normal_of_diffuse_lobes():
    proposal, diffuse = DefensiveProposal.around(0.5), mi.Vector3f(0.8, 0.0, 0.6)
    n = 400_000
    wi = mi.Vector3f(0.0, 0.6, 0.8)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, n)
    wo = proposal.sample(wi, sampler.next_1d(), sampler.next_2d(), None, diffuse)
    density, along = (np.array(a) for a in (proposal.density(wi, wo, None, diffuse), dr.dot(wo, diffuse)))
    valid = (along > 0) & (density > 0)
    ratio = np.where(valid, 1.0 / np.maximum(density, 1e-9), 0.0)
    # all light about that normal, a fifth of which comes from below the microfacets' plane
    assert np.mean(ratio * np.maximum(along, 0.0)) == pytest.approx(np.pi, rel=0.01)
    below = np.array(wo.z) < 0
    assert np.mean(ratio * np.maximum(along, 0.0) * below) == pytest.approx(np.pi * 0.2, rel=0.03)
