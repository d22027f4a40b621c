# SPDX-License-Identifier: Apache-2.0
"""The scenarios: what is unknown, under which light, and how noisy the pictures are.

They follow the paper's, at 32 samples for Transparency. Where it leaves something open, the choice is stated here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

_DRAWN = ("base_color", "roughness", "metallic", "specular")  # the paper draws these at random, the others are 0


@dataclass(frozen=True)
class Scenario:
    """One kind of scene.

    Attributes
    ----------
    light
        ``"point"`` or ``"probe"`` (an environment map).
    fitted
        What the methods look for: ``"all"``, ``"reduced"`` or names.
    drawn
        Parameters with random values, uniform in the box of the fit unless `ranges` narrows it. Truth and start are
        drawn independently.
    constant
        Values that truth and start share.
    reference_spp, fit_spp
        Samples per pixel of the reference, and of an iteration of the methods that render one each.
    max_depth
        Mitsuba's path length: 2 is direct light, which a point light gives without noise but for the pixel filter.
    """

    name: str
    light: str
    fitted: str | tuple[str, ...]
    reference_spp: int
    fit_spp: int
    max_depth: int
    drawn: tuple[str, ...] = _DRAWN
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    constant: Mapping[str, float] = field(default_factory=dict)
    closed_only: bool = False  # whether the object must have an inside


SCENARIOS = {
    scenario.name: scenario
    for scenario in (
        Scenario("base", "point", "all", reference_spp=4096, fit_spp=16, max_depth=2),
        Scenario("parameters", "point", "reduced", reference_spp=4096, fit_spp=16, max_depth=2),
        Scenario("noise", "probe", "all", reference_spp=4, fit_spp=4, max_depth=3),
        Scenario(
            "transparency",
            "probe",
            ("base_color", "roughness", "eta", "spec_trans"),
            reference_spp=32,
            fit_spp=32,
            max_depth=8,
            drawn=("base_color", "roughness", "eta", "spec_trans"),
            ranges={"spec_trans": (0.75, 1.0), "roughness": (0.0, 0.6), "eta": (1.2, 1.8)},
            closed_only=True,
        ),
    )
}
