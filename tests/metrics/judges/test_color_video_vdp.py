# SPDX-License-Identifier: Apache-2.0
"""ColorVideoVDP through its package: scores, gradient, and the blur that stands in for torchvision's."""

from __future__ import annotations

import importlib.util
import logging
import os
import subprocess
import sys

import numpy as np
import pytest
import scipy.ndimage

from mfo_backend.metrics.judges.viewing import HDR_VIEWING, Viewing
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.scene.image_file import read_image
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

pytestmark = pytest.mark.judges
if not all(map(importlib.util.find_spec, ("torch", "pycvvdp"))):
    pytest.skip("the extra `judges` is not installed", allow_module_level=True)

from mfo_backend.metrics.judges.color_video_vdp import ColorVideoVdp, color_video_vdp_jod  # noqa: E402
from mfo_backend.metrics.judges.gaussian_blur import GaussianBlur  # noqa: E402
from mfo_backend.metrics.judges.packages import require_pycvvdp  # noqa: E402


def test_scores_of_a_generated_pair_stay(lit_ball):
    """Pinned with cvvdp 0.5.7 and torch 2.13; other builds add in another order, hence 1e-3."""
    reference = lit_ball()
    scores = [
        color_video_vdp_jod(reference, test, HDR_VIEWING)
        for test in (reference, lit_ball(hue=1.2), lit_ball(width=0.03), lit_ball(width=0.06))
    ]
    assert scores == pytest.approx([10, 9.9055, 9.1648, 8.0898], abs=1e-3)


@pytest.mark.skipif("MFO_CVVDP_EXAMPLE" not in os.environ, reason="MFO_CVVDP_EXAMPLE names no nancy_church.hdr")
def test_the_documented_example():
    """The blurred picture of the authors' examples/ex_hdr_images.py scores 8.696 (gfxdisp/ColorVideoVDP, 0.5.7)."""
    geometry = require_pycvvdp().vvdp_display_geometry.load("standard_hdr_linear")
    pixels = read_image(os.environ["MFO_CVVDP_EXAMPLE"]).pixels
    viewing = Viewing(peak_nits=4000, contrast=1e6, ambient_lux=100, pixels_per_degree=float(geometry.get_ppd()))
    reference = pixels / pixels.max() * 4 * 4000
    test = scipy.ndimage.gaussian_filter(reference, (2, 2, 0), mode="nearest", truncate=2.0)
    assert color_video_vdp_jod(reference, test, viewing) == pytest.approx(8.696, abs=5e-4)


def test_the_same_factor_on_all_pixels_is_not_seen(lit_ball):
    """A property of the metric that users must know of: contrast is relative to each picture's own surround."""
    reference = lit_ball()
    assert color_video_vdp_jod(reference, lit_ball(gain=3.0), HDR_VIEWING) == pytest.approx(10, abs=1e-3)
    half = np.where(np.arange(72)[:, None] < 36, reference, 1.1 * reference).astype(np.float32)
    assert color_video_vdp_jod(reference, half, HDR_VIEWING) < 9.95


def test_gradient_equals_finite_differences(lit_ball):
    reference, image = lit_ball(), lit_ball(width=0.03, hue=1.1)
    judge = ColorVideoVdp(reference, HDR_VIEWING)
    value, gradient = judge.value_and_gradient(image)
    assert value == pytest.approx(judge.value(image), abs=1e-5)
    direction = np.random.default_rng(0).normal(size=image.shape).astype(np.float32) * image
    step = 2e-3
    difference = (judge.value(image + step * direction) - judge.value(image - step * direction)) / (2 * step)
    # float32: the loss is known to 1e-6, so the difference to some 1e-3
    assert (gradient.astype(np.float64) * direction).sum() == pytest.approx(difference, rel=0.02, abs=2e-3)


@pytest.mark.parametrize("shape", [(2, 2, 3), (2, 40, 3), (9, 7, 3), (33, 64, 3)])
@pytest.mark.parametrize("level", [0.0, 1e-3, 100.0, 1e6])
def test_flat_and_equal_pictures_have_finite_gradients(shape, level):
    flat = np.full(shape, level, np.float32)
    value, gradient = ColorVideoVdp(flat, HDR_VIEWING).value_and_gradient(flat)
    assert value == 0
    assert np.isfinite(gradient).all()


def test_one_pixel_is_refused():
    with pytest.raises(BadInputError, match="at least 2x2 pixels, but the reference is 5x1"):
        ColorVideoVdp(np.ones((1, 5, 3), np.float32), HDR_VIEWING)


@pytest.mark.parametrize("name", ["cvvdp-hdr", "cvvdp-ldr"])
def test_as_a_loss(lit_ball, name):
    reference, image = lit_ball() / 300, lit_ball(width=0.04, hue=0.9) / 300
    loss = make_loss(name, Image(reference, Encoding.LINEAR))
    value, gradient = loss.value_and_gradient(image)
    assert loss.name == name
    assert loss.value(reference) == 0
    assert value == pytest.approx(loss.value(image), abs=1e-5)
    assert gradient.dtype == np.float32
    slope = -float(np.square(gradient, dtype=np.float64).sum())
    step = 0.01 * value / -slope
    # one percent of the loss: its curvature stays below a tenth of that
    assert loss.value(image - np.float32(step) * gradient) - value == pytest.approx(step * slope, rel=0.1)


def test_dark_pictures_say_nothing_on_the_log(lit_ball, caplog):
    with caplog.at_level(logging.WARNING):
        color_video_vdp_jod(lit_ball() / 1000, lit_ball() / 1000, HDR_VIEWING)
    assert not caplog.records


def test_blur_equals_scipy():
    import torch

    image = np.random.default_rng(0).uniform(size=(2, 3, 20, 17)).astype(np.float32)
    blurred = GaussianBlur(13, 3.0).forward(torch.from_numpy(image)).numpy()
    expected = scipy.ndimage.gaussian_filter(image.astype(np.float64), (0, 0, 3, 3), radius=(0, 0, 6, 6), mode="mirror")
    np.testing.assert_allclose(blurred, expected, atol=3e-7)  # float32, 26 taps


def test_torchvision_is_left_as_it_was_found():
    """In a process of its own: a torchvision that fails as a mismatched build does is neither used nor kept away."""
    code = (
        "import sys, types\n"
        "class Broken:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'torchvision': raise RuntimeError('operator torchvision::nms does not exist')\n"
        "sys.meta_path.insert(0, Broken())\n"
        "from mfo_backend.metrics.judges.packages import require_pycvvdp\n"
        "require_pycvvdp()\n"
        "print([name for name in sys.modules if name.startswith('torchvision')])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
