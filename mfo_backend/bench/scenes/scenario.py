# SPDX-License-Identifier: Apache-2.0
"""The scenarios: what is unknown, under which light, how noisy the pictures are, and what the judge looks at.

`base` to `transparency_4spp` follow the paper's. Where it leaves something open, the choice is stated here. The others
are this project's: they ask what the paper's do not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

_DRAWN = ("base_color", "roughness", "metallic", "specular")  # the paper draws these at random, the others are 0
_RANGES = {"metallic": (0.001, 0.999)}  # metals of exactly 1 are hard cases (studies/recovery/hard_cases.py)
_GLASS = ("base_color", "roughness", "ior", "transmission_weight")


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
    closed_only
        Whether the object must have an inside.
    relights
        Lights no fit has seen, under which the result is judged too.
    neighbours
        Other objects around the target, with materials of their own and a floor; they light and hide it.
    measured
        The reference shows a material that the fitted model cannot reach exactly.
    model
        Material model of truth and fit. Transparency is Blender's, which all methods can fit; the paper's is Disney's.
    cycles
        Truth and reference are Cycles' pictures of the demo's scene.
    """

    name: str
    light: str
    fitted: str | tuple[str, ...]
    reference_spp: int
    fit_spp: int
    max_depth: int
    drawn: tuple[str, ...] = _DRAWN
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=lambda: _RANGES)
    constant: Mapping[str, float] = field(default_factory=dict)
    closed_only: bool = False
    relights: int = 1
    neighbours: int = 0
    measured: bool = False
    model: str = "mitsuba_principled"
    cycles: bool = False


_TRANSPARENCY = Scenario(
    "transparency",
    "probe",
    _GLASS,
    reference_spp=32,
    fit_spp=32,
    max_depth=8,
    drawn=_GLASS,
    ranges={"transmission_weight": (0.75, 1.0), "roughness": (0.0, 0.6), "ior": (1.2, 1.8)},
    closed_only=True,
    model="blender_principled",
)
PAPER_SCENARIOS = (
    Scenario("base", "point", "all", reference_spp=4096, fit_spp=16, max_depth=2),
    Scenario("noise", "probe", "all", reference_spp=4, fit_spp=4, max_depth=3),
    Scenario("parameters", "point", "reduced", reference_spp=4096, fit_spp=16, max_depth=2),
    _TRANSPARENCY,
    replace(_TRANSPARENCY, name="transparency_4spp", reference_spp=4, fit_spp=4),
)
OUR_SCENARIOS = (
    Scenario("relighting", "probe", "all", reference_spp=64, fit_spp=8, max_depth=3, relights=3),
    Scenario("objects", "probe", "all", reference_spp=64, fit_spp=8, max_depth=5, neighbours=3),
    Scenario("measured", "probe", "all", reference_spp=64, fit_spp=8, max_depth=3, measured=True, closed_only=True),
    Scenario(
        "cycles",
        "world",
        "all",
        reference_spp=64,
        fit_spp=8,
        max_depth=0,
        model="blender_principled",
        relights=0,
        cycles=True,
    ),
)
SCENARIOS = {scenario.name: scenario for scenario in (*PAPER_SCENARIOS, *OUR_SCENARIOS)}
