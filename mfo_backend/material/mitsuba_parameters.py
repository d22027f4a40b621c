# SPDX-License-Identifier: Apache-2.0
"""The parameters of Mitsuba's `principled` and the box in which its gradient is defined (Mitsuba 3.9.1).

The box stays clear of the places where the plugin's derivative vanishes or overflows: weights of 0 and 1 (masked
lobes), black base colour under transmission (infinite slope), roughness below 0.0316 (alpha is clamped at 0.001), a
specular level of 0 (infinite slope) and an IOR of 1 (refraction half vector of length 0). Metals of exactly 1 are what
most metals are, and a thousandth of a dielectric is much of their dark parts: they are in the box, and the plugin's
slope there is that beside it. A clearcoat of 1 masks nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from ..types.errors import BadInputError
from ..types.parameter import Parameter, ParameterTable

_EDGE = 1e-3  # distance of weights from 0 and 1, where `principled` masks lobes out of the derivative


def _weight(name: str, upper: float = 1.0 - _EDGE, slope_upper: float = math.inf) -> Parameter:
    return Parameter(name, 1, _EDGE, upper, 0.0, slope_upper)


MITSUBA_PRINCIPLED = ParameterTable(
    [
        Parameter("base_color", 3, _EDGE, 1.0 - _EDGE, (0.5, 0.5, 0.5)),
        Parameter("roughness", 1, 0.04, 1.0, 0.5),
        _weight("metallic", upper=1.0, slope_upper=1.0 - _EDGE),
        Parameter("specular", 1, 0.02, 1.0, 0.5),
        Parameter("eta", 1, 1.01, 2.5, 1.5),
        _weight("spec_tint"),
        Parameter("anisotropic", 1, _EDGE, 0.95, 0.0),
        _weight("sheen"),
        _weight("sheen_tint"),
        _weight("clearcoat", upper=1.0),
        _weight("clearcoat_gloss"),
        _weight("flatness"),
        _weight("spec_trans"),
    ]
)
REDUCED = ("base_color", "roughness", "metallic", "specular")  # the paper's scenario "Parameters"
_NEEDS = {"sheen_tint": "sheen", "clearcoat_gloss": "clearcoat"}


def specular_to_eta(specular: float) -> float:
    """IOR of a specular level: F0 = 0.08 specular (Mitsuba 3.9.1, `principled`)."""
    return 2.0 / (1.0 - (0.08 * specular) ** 0.5) - 1.0


def eta_to_specular(eta: float) -> float:
    """Specular level of an IOR; the inverse of `specular_to_eta`."""
    return ((eta - 1.0) / (eta + 1.0)) ** 2 / 0.08


def select_parameters(
    selection: str | Sequence[str],
    *,
    present: Collection[str] = (),
    linked: Collection[str] = (),
) -> ParameterTable:
    """The parameters to fit, in the table's order.

    Parameters
    ----------
    selection
        ``"all"``, ``"reduced"`` (base colour, roughness, metallic, specular) or names. ``"all"`` holds `spec_trans`
        only where the material transmits already: others could turn into glass on the way to a local minimum.
    present
        Names that the scene's material sets to something other than 0. With `eta` or `spec_trans` among them the
        fit works on `eta`, else on `specular`; the plugin takes one of the two.
    linked
        Names that a texture feeds; they stay fixed.

    Raises
    ------
    BadInputError
        Unknown, linked or contradictory names, names without effect, nothing left to fit.
    """
    named = [] if isinstance(selection, str) else list(selection)
    transmissive = "spec_trans" in {*present, *linked, *named}
    by_eta = "eta" in {*present, *named} or (transmissive and "specular" not in named)
    if isinstance(selection, str):
        if selection not in ("all", "reduced"):
            raise BadInputError(
                f'Unknown parameter set {selection!r}: give "all", "reduced" or names of {_names(MITSUBA_PRINCIPLED)}.'
            )
        wanted = MITSUBA_PRINCIPLED.names if selection == "all" else (*REDUCED, "eta")
        unused = {"specular" if by_eta else "eta", *linked, *(() if transmissive else ("spec_trans",))}
        return MITSUBA_PRINCIPLED.select(name for name in wanted if name not in unused)

    table = MITSUBA_PRINCIPLED.select(named)
    if "eta" in named and "specular" in named:
        raise BadInputError("Both 'eta' and 'specular' are selected: they set the same reflectance, choose one.")
    for name in named:
        if name in linked:
            raise BadInputError(f"Parameter {name!r} is linked to a texture: unlink it or leave it out.")
        if name in _NEEDS and _NEEDS[name] not in {*present, *linked, *named}:
            raise BadInputError(f"Parameter {name!r} has no effect while {_NEEDS[name]!r} is 0: add {_NEEDS[name]!r}.")
    return table


def _names(table: ParameterTable) -> str:
    return ", ".join(table.names)
