# SPDX-License-Identifier: Apache-2.0
"""Indices and reflectances at normal incidence, which determine each other."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from mfo_backend.material.lobes.fresnel import index_from_normal_incidence, normal_incidence


def test_an_index_has_the_reflectance_that_it_was_made_from():
    f0 = np.array([0.0, 0.04, 0.25, 0.9, 0.98])
    index = index_from_normal_incidence(mi.Float(f0))
    assert (np.array(index) >= 1.0).all()
    np.testing.assert_allclose(normal_incidence(index), f0, atol=1e-5)


def test_a_reflectance_near_or_above_one_has_the_index_of_the_largest():
    """Specular levels and tints may ask for more than any dielectric reflects."""
    index = np.array(index_from_normal_incidence(mi.Float([0.99, 1.0, 1.5])))
    assert np.isfinite(index).all()
    np.testing.assert_array_equal(index, index[0])
