# SPDX-License-Identifier: Apache-2.0
"""Which sampled directions leave on their own side of a facet with a bent normal. Oracle: the signs by hand."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant


@pytest.mark.parametrize("flipped", [False, True], ids=["seen from outside", "its back is seen"])
@pytest.mark.parametrize(
    ("degrees", "through", "leaves"),
    [(20.0, False, True), (70.0, False, False), (20.0, True, False), (70.0, True, True), (-85.0, False, True)],
)
def test_a_direction_leaves_on_the_side_of_the_facet(degrees, through, leaves, flipped):
    """The shading normal is turned by 30 degrees from the facet's, so a lobe about it reaches 30 degrees below that."""
    load_variant()
    import drjit as dr
    import mitsuba as mi

    from mfo_backend.render.transport.smooth_facets import leaves_on

    si = dr.zeros(mi.SurfaceInteraction3f)
    bend, angle = np.radians(30.0), np.radians(degrees)
    si.n = mi.Normal3f(0.0, 0.0, -1.0 if flipped else 1.0)
    si.sh_frame = mi.Frame3f(mi.Vector3f(float(np.sin(bend)), 0.0, float(np.cos(bend))))
    si.wi = si.to_local(mi.Vector3f(0.0, 0.0, 1.0))
    about_shading = mi.Vector3f(float(np.sin(angle + bend)), 0.0, float(np.cos(angle + bend)))  # in the world
    assert np.array(leaves_on(si, si.to_local(about_shading), through)).item() == leaves
