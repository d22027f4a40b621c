# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import pytest

from mfo_backend.material.mitsuba_parameters import (
    MITSUBA_PRINCIPLED,
    eta_to_specular,
    select_parameters,
    specular_to_eta,
)


@pytest.mark.parametrize(("specular", "eta"), [(0.5, 1.5), (1.0, 1.7887885), (0.0, 1.0)])
def test_specular_and_eta_convert_both_ways(specular: float, eta: float) -> None:
    # 0.04 and 0.08 reflect at normal incidence: ((eta - 1) / (eta + 1))^2
    assert specular_to_eta(specular) == pytest.approx(eta, abs=1e-7)
    assert eta_to_specular(specular_to_eta(specular)) == pytest.approx(specular, abs=1e-12)


@pytest.mark.parametrize(
    ("selection", "present", "linked", "has", "lacks"),
    [
        ("all", (), (), {"specular", "sheen", "flatness"}, {"eta", "spec_trans"}),
        ("all", ("eta",), (), {"eta"}, {"specular", "spec_trans"}),
        ("all", ("spec_trans",), (), {"eta", "spec_trans"}, {"specular"}),
        ("all", (), ("roughness",), {"base_color"}, {"roughness"}),
        ("reduced", (), (), {"base_color", "roughness", "metallic", "specular"}, {"eta", "sheen"}),
        ("reduced", ("spec_trans",), (), {"eta"}, {"specular", "spec_trans"}),
        (("specular", "spec_trans"), (), (), {"specular", "spec_trans"}, {"eta"}),
    ],
)
def test_selections(selection, present, linked, has: set, lacks: set) -> None:
    names = set(select_parameters(selection, present=present, linked=linked).names)
    assert has <= names
    assert not lacks & names


def test_the_box_stays_clear_of_masked_lobes_and_clamped_roughness() -> None:
    for parameter in MITSUBA_PRINCIPLED:
        assert parameter.lower > 0.0
        if parameter.name not in ("eta", "roughness", "specular", "clearcoat"):
            assert min(parameter.upper, parameter.slope_upper) < 1.0
    assert MITSUBA_PRINCIPLED["roughness"].lower ** 2 > 0.001  # alpha is clamped there (principled.cpp, 3.9.1)
