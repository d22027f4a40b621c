# SPDX-License-Identifier: Apache-2.0
"""What looks like a lobe that is nearly as wide as can be; the pictures are lines of pixels with its two widths."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.alike.width_rivals import width_rivals
from mfo_backend.types.parameter import Parameter, ParameterTable

from .test_exchanges import PIXELS, Line

BRUSHED = ParameterTable([Parameter("roughness", 1, 0.02, 1.0, 0.5), Parameter("anisotropic", 1, 0.0, 1.0, 0.5)])


def widths(x):
    """Of Blender's anisotropic lobe (`material/layers.py`)."""
    roughness, stretch = x[0], np.sqrt(1.0 - 0.9 * x[1])
    return min(roughness**2 / stretch, 1.0), roughness**2 * stretch


def brushed(x):
    wide, narrow = (np.exp(-0.5 * (PIXELS / width) ** 2) for width in widths(x))
    return np.repeat((0.1 + wide + narrow)[:, None], 3, 1)


@pytest.mark.parametrize(
    "truth",
    [[0.85, 0.9], [0.8, 0.99], [0.95, 0.3]],  # the far end has the least stretch, or the largest roughness
)
def test_a_fit_short_of_the_widest_lobe_has_the_far_end_of_what_looks_alike_as_its_rival(truth):
    line = Line(brushed, BRUSHED, np.array(truth), 1e-3)
    wide, narrow = widths(truth)
    assert wide == 1.0
    short = np.sqrt(narrow / 0.995)  # of the stretch with which the larger width is 0.995
    x = np.array([np.sqrt(narrow / short), (1.0 - short**2) / 0.9])
    (rival,) = width_rivals(line, x, BRUSHED)
    assert rival.last
    assert widths(rival.x) == pytest.approx((1.0, narrow), rel=1e-6)
    least = max(narrow, np.sqrt(0.1))
    assert rival.x == pytest.approx([np.sqrt(narrow / least), (1.0 - least**2) / 0.9])
    # a value that is as likely anywhere between them
    steps = np.linspace(0.0, 1.0, 1001)
    assert rival.share == pytest.approx(np.mean(steps**2), rel=0.01)


@pytest.mark.parametrize("truth", [[0.5, 0.5], [0.8, 0.55]])
def test_widths_below_the_widest_are_told_apart(truth):
    assert widths(truth)[0] < 0.95
    line = Line(brushed, BRUSHED, np.array(truth), 1e-3)
    assert width_rivals(line, np.array(truth), BRUSHED) == ()


def test_one_of_the_two_values_alone_has_no_rival():
    table = ParameterTable([BRUSHED["roughness"]])
    line = Line(lambda x: brushed([x[0], 0.9]), table, np.array([0.85]))
    assert width_rivals(line, np.array([0.85]), table) == ()
