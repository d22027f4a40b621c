# SPDX-License-Identifier: Apache-2.0
"""Lights as elements of a scene: what a lamp's place and direction become."""

from __future__ import annotations

import numpy as np
import pytest

from blender_addon.export.lights.light_elements import light_element
from blender_addon.export.lights.light_model import Light

ALONG = np.array([(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.3, -0.5, 0.8), (-0.6, 0.7, -0.2)])


@pytest.mark.parametrize("angle", [0.0, 0.1])
@pytest.mark.parametrize("along", ALONG, ids=str)
def test_a_suns_frame_is_a_rotation_that_shines_where_it_shines(along: np.ndarray, angle: float) -> None:
    """A frame that is sheared as well would stretch the disc of a sun."""
    world = np.eye(4)
    world[:3, 2] = 2.0 * along  # Blender's sun shines along -Z, whatever its scale
    sun = Light("SUN", "Sun", world, np.ones(3), 1.0, sun_angle=angle)
    element = light_element(sun, "sun", lambda pixels: "")
    (matrix,) = (part.get("value") for part in element.iter("matrix"))
    frame = np.array(matrix.split(), float).reshape(4, 4)[:3, :3]
    np.testing.assert_allclose(frame.T @ frame, np.eye(3), atol=1e-6)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    np.testing.assert_allclose(frame @ [0.0, 0.0, 1.0], -along / np.linalg.norm(along), atol=1e-6)
