# SPDX-License-Identifier: Apache-2.0
"""What camera rays see beside the target."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.mark.parametrize("nothing", [np.nan, np.inf])
def test_a_path_whose_radiance_is_no_number_adds_nothing(nothing):
    """One in a pixel at the silhouette made the noise of all tiles no number, and the fit an error."""
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    import mitsuba as mi

    from mfo_backend.render.paths.recorded_background import add_radiance

    radiance = mi.Color3f([1.0, nothing, 2.0, 0.5], [1.0, 3.0, 2.0, 0.5], [1.0, 3.0, 2.0, 0.5])
    image = add_radiance(np.ones((1, 3, 3), np.float32), np.array([0, 0, 2, 2]), radiance)
    np.testing.assert_allclose(image[0, :, 0], [2.0, 1.0, 3.5])
    np.testing.assert_allclose(image[0, :, 1], [2.0, 1.0, 3.5])
