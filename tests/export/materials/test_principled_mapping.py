# SPDX-License-Identifier: Apache-2.0
"""The mapping between Principled v2 and Mitsuba's principled: inverse, exact parts, albedos of the design tables."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from blender_addon.export.materials.principled_mapping import (
    _ggx_albedos,
    effective_ior,
    fresnel,
    mitsuba_to_sockets,
    sockets_to_mitsuba,
)

DEFAULTS = {
    "Base Color": (0.8, 0.8, 0.8), "Metallic": 0.0, "Roughness": 0.5, "IOR": 1.5, "Specular IOR Level": 0.5,
    "Specular Tint": (1.0, 1.0, 1.0), "Anisotropic": 0.0, "Transmission Weight": 0.0, "Coat Weight": 0.0,
    "Coat Roughness": 0.05, "Sheen Weight": 0.0, "Sheen Tint": (1.0, 1.0, 1.0),
}  # fmt: skip
CASES = {
    "plastic": {"Base Color": (0.8, 0.3, 0.1), "Roughness": 0.3},
    "metal": {"Base Color": (0.9, 0.6, 0.3), "Metallic": 1.0, "Roughness": 0.4},
    "half metal": {"Base Color": (0.5, 0.6, 0.3), "Metallic": 0.4, "Roughness": 0.8},
    "glass": {"Base Color": (0.9, 0.95, 1.0), "Transmission Weight": 1.0, "IOR": 1.33},
    "coated": {"Coat Weight": 0.2, "Coat Roughness": 0.2, "Anisotropic": 0.5},
    "cloth": {"Base Color": (0.2, 0.1, 0.05), "Sheen Weight": 0.1},
}


@pytest.mark.parametrize("case", CASES)
def test_round_trip(case: str) -> None:
    start = {**DEFAULTS, **CASES[case]}
    back = mitsuba_to_sockets(sockets_to_mitsuba(start), start)
    for name, value in back.items():
        np.testing.assert_allclose(value, start[name], atol=1e-6, err_msg=name)
    assert set(back) == set(start)


def test_level_scales_f0() -> None:
    # principled_v2: F0 = 2 level F0(IOR); 0.08 at level 1 is an IOR of 1.7888 (Mitsuba: specular 1)
    assert effective_ior(1.5, 1.0) == pytest.approx(1.788789, abs=1e-6)
    assert effective_ior(1.5, 1.0, transmission=0.5) == 1.5
    assert fresnel(1.0, effective_ior(1.45, 0.8)) == pytest.approx(1.6 * fresnel(1.0, 1.45), rel=1e-9)
    assert mitsuba_to_sockets({"specular": 1.0}, DEFAULTS)["IOR"] == pytest.approx(1.788789, abs=1e-6)


def test_partial_values_drive_only_their_sockets() -> None:
    found = mitsuba_to_sockets({"base_color": (0.4, 0.2, 0.1), "roughness": 0.25}, DEFAULTS)
    assert set(found) == {"Base Color", "Roughness"}
    assert found["Roughness"] == 0.25
    np.testing.assert_allclose(found["Base Color"], np.array([0.4, 0.2, 0.1]) / (1 - fresnel(0.8, 1.5)))
    older = {name: value for name, value in DEFAULTS.items() if name != "Specular IOR Level"}
    assert "Specular IOR Level" not in mitsuba_to_sockets({"eta": 1.4}, older)


def test_everything_stays_in_range() -> None:
    generator = np.random.default_rng(5)
    for _ in range(200):
        values: dict = {name: generator.random() for name in (
            "metallic", "spec_trans", "clearcoat", "clearcoat_gloss", "sheen", "spec_tint", "sheen_tint", "anisotropic"
        )}  # fmt: skip
        values["base_color"] = generator.random(3)
        values["roughness"] = 0.04 + 0.96 * generator.random()
        values["eta"] = 1.01 + 1.5 * generator.random()
        for name, value in mitsuba_to_sockets(values, DEFAULTS).items():
            numbers = np.asarray(value)
            assert np.isfinite(numbers).all(), name
            assert numbers.min() >= 0.0, name
            assert numbers.max() <= (2.6 if name == "IOR" else 1.0), name


def test_energies_are_those_of_cycles_tables() -> None:
    # Cycles' ggx_E and ggx_Eavg at roughness 0.5, 0.75 and 1 (values of its shader.tables)
    for roughness, mean in ((0.5, 0.88204), (0.75, 0.65618), (1.0, 0.40914)):
        assert _ggx_albedos(roughness)[2] == pytest.approx(mean, abs=0.01)


def test_metal_albedo_factor() -> None:
    """Mitsuba reflects 0.70 to 0.88 of what Cycles does for a metal of 0.8, so its base colour must be larger."""
    rough = sockets_to_mitsuba({**DEFAULTS, "Metallic": 1.0, "Roughness": 0.8, "Base Color": (0.4, 0.4, 0.4)})
    assert 1.2 < rough["base_color"][0] / 0.4 < 1.6
    smooth = sockets_to_mitsuba({**DEFAULTS, "Metallic": 1.0, "Roughness": 0.1, "Base Color": (0.4, 0.4, 0.4)})
    assert smooth["base_color"][0] == pytest.approx(0.4, rel=0.02)


UNIT = st.floats(0.0, 1.0)
COLOUR = st.tuples(*[st.floats(0.02, 0.98)] * 3)


@given(
    start=st.fixed_dictionaries(
        {
            "Base Color": COLOUR, "Metallic": UNIT, "Roughness": st.floats(0.05, 1.0), "IOR": st.floats(1.05, 2.5),
            "Specular IOR Level": st.just(0.5), "Specular Tint": st.just((1.0, 1.0, 1.0)), "Anisotropic": UNIT,
            "Transmission Weight": UNIT, "Coat Weight": st.floats(0.0, 0.25), "Coat Roughness": st.floats(0.04, 0.3),
            "Sheen Weight": st.floats(0.0, 0.15), "Sheen Tint": st.just((1.0, 1.0, 1.0)),
        }
    )
)  # fmt: skip
def test_any_sockets_that_have_a_counterpart_come_back(start: dict) -> None:
    values = sockets_to_mitsuba(start)
    assume(max(values["base_color"]) < 1.0)  # Mitsuba's colour ends there
    for name, value in mitsuba_to_sockets(values, start).items():
        # the colour under a little metal is the root of a bisection, and roughness cancels in it twice
        np.testing.assert_allclose(value, start[name], atol=1e-5, err_msg=name)
