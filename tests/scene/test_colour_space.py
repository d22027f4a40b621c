# SPDX-License-Identifier: Apache-2.0
"""Colours of other spaces than linear Rec.709: matrices as published, and what Blender writes."""

from __future__ import annotations

import numpy as np
import OpenEXR
import pytest

from mfo_backend.scene.image_file import check_reference, read_image
from mfo_backend.types.errors import BadInputError

# ACEScg to linear Rec.709 with Bradford adaptation, as in the ACES configuration of OpenColorIO
AP1_TO_REC709 = np.array([[1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297]])
# ITU-R BT.2087, from BT.2020 to BT.709
REC2020_TO_REC709 = np.array([[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]])
AP1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
REC2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


def write(path, channels=None, **header):
    pixels = np.random.default_rng(0).uniform(0.05, 0.9, (4, 6, 3)).astype(np.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    OpenEXR.File(header, {"RGB": pixels} if channels is None else channels).write(str(path))
    return pixels


@pytest.mark.parametrize(
    ("header", "matrix"),
    [
        ({"chromaticities": AP1}, AP1_TO_REC709),
        ({"colorInteropID": "lin_ap1_scene"}, AP1_TO_REC709),
        ({"colorInteropID": "lin_ap1_scene", "chromaticities": AP1}, AP1_TO_REC709),
        ({"colorInteropID": "lin_rec2020_scene"}, REC2020_TO_REC709),
        ({"chromaticities": REC2020}, REC2020_TO_REC709),
    ],
)
def test_colours_are_converted_and_it_is_said(tmp_path, header, matrix):
    pixels = write(tmp_path / "a.exr", **header)
    image = read_image(tmp_path / "a.exr")
    np.testing.assert_allclose(image.pixels, pixels @ matrix.T, atol=2e-4)  # matrices of four digits
    said = header.get("colorInteropID", "the primaries in its header")
    assert image.notes == (f"a.exr: colours were converted from {said} to linear Rec.709.",)
    assert image.notes[0] in check_reference(image, 6, 4)[1]


@pytest.mark.parametrize(
    "header",
    [
        {},
        {"chromaticities": REC709},
        {"colorInteropID": "lin_rec709_scene"},
        {"colorInteropID": "unknown"},
        {"chromaticities": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.31271, 0.32902)},
    ],
)
def test_rec709_is_left_as_it_is(tmp_path, header):
    pixels = write(tmp_path / "a.exr", **header)
    image = read_image(tmp_path / "a.exr")
    np.testing.assert_array_equal(image.pixels, pixels)
    assert image.notes == ()


def test_the_container_of_aces_is_ap0(tmp_path):
    """A white of AP0 is one of Rec.709, and its red is far outside."""
    pixels = np.array([[[1, 1, 1], [1, 0, 0]]], np.float32)
    write(tmp_path / "a.exr", {"RGB": pixels}, acesImageContainerFlag=1)
    found = read_image(tmp_path / "a.exr").pixels
    np.testing.assert_allclose(found[0, 0], 1, atol=1e-4)
    np.testing.assert_allclose(found[0, 1], [2.52169, -0.27648, -0.01538], atol=2e-4)  # OpenColorIO's matrix


def test_a_grey_has_no_primaries(tmp_path):
    grey = np.full((2, 3), 0.5, np.float32)
    write(tmp_path / "a.exr", {"Y": grey}, chromaticities=AP1)
    image = read_image(tmp_path / "a.exr")
    np.testing.assert_array_equal(image.pixels, 0.5)
    assert image.notes == ()


def test_of_several_parts_the_first_may_say_it_for_all(tmp_path):
    pixels = np.full((2, 3, 3), 0.5, np.float32)
    kind = {"type": OpenEXR.scanlineimage}
    depth = OpenEXR.Part({**kind, "chromaticities": AP1}, {"Z": pixels[..., 0].copy()}, name="depth")
    OpenEXR.File([depth, OpenEXR.Part(dict(kind), {"RGB": pixels}, name="rgb")]).write(str(tmp_path / "a.exr"))
    assert read_image(tmp_path / "a.exr").notes


@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        (
            {"colorInteropID": "srgb_rec709_scene"},
            "its colour space is 'srgb_rec709_scene', which is none that is read",
        ),
        ({"colorInteropID": "data"}, "its colour space is 'data'"),
        ({"chromaticities": (0.3, 0.3, 0.4, 0.4, 0.5, 0.5, 0.3127, 0.329)}, "chromaticities that span no colours"),
        ({"chromaticities": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.9, 0.05)}, "chromaticities that span no colours"),
        ({"chromaticities": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.0)}, "chromaticities that span no colours"),
        ({"chromaticities": (float("nan"),) * 8}, "chromaticities that span no colours"),
        ({"chromaticities": (float("nan"), *REC709[1:])}, "chromaticities that span no colours"),
        ({"chromaticities": (0.0,) * 8}, "chromaticities that span no colours"),
        ({"chromaticities": REC709, "colorInteropID": "lin_ap1_scene"}, "says two colour spaces, lin_ap1_scene and"),
    ],
)
def test_unknown_and_impossible_spaces_are_refused(tmp_path, header, sentence):
    write(tmp_path / "a.exr", **header)
    with pytest.raises(BadInputError, match=rf"Image 'a\.exr' .*{sentence}.*: export it as linear Rec\.709"):
        read_image(tmp_path / "a.exr")
