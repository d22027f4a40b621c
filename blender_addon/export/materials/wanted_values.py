# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit is to change of each material: the values inside its nodes, those of its mix, and its own sockets'."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

from ...graph_values.mix_values import inside_values
from ...graph_values.table import GraphValue, one_word, plain_name
from ..findings import ExportError, Findings
from ..fitted_slot import FittedSlot
from ..material_model import Material
from ..nodes.target_shader import target_shader
from .chosen_leaves import named_mix_values
from .chosen_values import chosen_graph_values, say_held

# as Principled, Metallic and the backend call them
_TURNING = ("anisotropic", "anisotropic_rotation", "anisotropy", "rotation")


@dataclass(frozen=True)
class WantedValues:
    """The values of a material's graph, the names of those of its mix beside the fitted leaf, and the fit without
    them."""

    values: list[GraphValue]
    of_mix: list[str]
    fit: dict[str, Any]

    @property
    def turns(self) -> bool:
        """Whether names of the fit turn highlights along a tangent."""
        asked = self.fit.get("parameters", "all")
        return not isinstance(asked, str) and any(plain_name(name) in _TURNING for name in map(str, asked))


def wanted_values(fitted: FittedSlot, fit: dict[str, Any], findings: Findings, leaf: str | None = None) -> WantedValues:
    """What `fit` asks of a material; `leaf` names the fitted shader of a mix.

    Raises
    ------
    ExportError
        If it names a value that there is not, or that cannot be fitted.
    """
    of_mix, rest = named_mix_values(fitted.material, fit)
    values, of_sockets = chosen_graph_values(fitted.material, rest, findings, leaf=leaf)
    return WantedValues(values, of_mix, of_sockets)


def through_glass(wanted: WantedValues, material: Material, glass: str, findings: Findings) -> WantedValues:
    """What is left of it where the camera sees a material through `glass` alone: the values of its sockets.

    Paths that are bent before they meet the target carry no slopes of values inside nodes.

    Raises
    ------
    ExportError
        If one of those was named.
    """
    if material.scattering:
        findings.note(f"Material '{material.name}': Subsurface is fitted as diffuse, for it is seen through '{glass}'.")
    inside = [*(value.name for value in wanted.values), *wanted.of_mix]
    if not inside:
        return wanted
    reason, asked = f"the camera sees it through '{glass}' alone", wanted.fit.get("parameters", "all")
    say_held(material.name, inside, reason, findings, named=not isinstance(asked, str))
    return replace(wanted, values=[], of_mix=[])


def fits_of_each(fitted: Sequence[FittedSlot], fit: dict[str, Any], *, several: bool) -> list[dict[str, Any]]:
    """What a fit asks of each material.

    Of `several` a name is for all that have such a value, or for the one whose name and a slash are before it, as in
    ``"Paint/Color Ramp/Stop 0"`` or ``"Paint/Roughness"``.

    Raises
    ------
    ExportError
        If none of them has a value of that name.
    """
    asked = fit.get("parameters", "all")
    if not several or isinstance(asked, str):
        return [fit for _ in fitted]
    inside = [_names_inside(each) for each in fitted]
    own: list[list[str]] = [[] for _ in fitted]
    for name in map(str, asked):
        of_one = {number: rest for number, each in enumerate(fitted) if (rest := _after_material(each, name))}
        having = [number for number, names in enumerate(inside) if plain_name(name) in names]
        if of_one:  # the longest name, where a material is called as another one and more
            number = min(of_one, key=lambda n: len(of_one[n]))
            own[number].append(of_one[number])
        elif "/" in name and not having:
            raise ExportError(_nowhere(name, inside))
        else:
            for number in having if "/" in name else range(len(fitted)):
                own[number].append(name)
    return [fit | {"parameters": list(dict.fromkeys(names))} for names in own]


def _after_material(fitted: FittedSlot, name: str) -> str:
    """What follows the material's name and a slash in a name, empty where that does not begin so."""
    material = "" if fitted.material is None else plain_name(fitted.material.name)
    slashes = [place for place, letter in enumerate(name) if letter == "/"]
    return next((name[place + 1 :].strip() for place in slashes if plain_name(name[:place]) == material), "")


def _names_inside(fitted: FittedSlot) -> dict[str, str]:
    """All that a name with a slash may mean of a material, by how it is compared: of a mix the fitted leaf's, too."""
    target = target_shader(fitted.material, fitted.leaf)
    if target is None:
        return {}
    label = one_word(target.node.label or target.node.name)
    of_leaf = [f"{label}/{target.own_name(name)}" for name in target.places] if target.is_mixed else []
    return {plain_name(name): name for name in (*(value.name for value in inside_values(target)), *of_leaf)}


def _nowhere(name: str, inside: Sequence[dict[str, str]]) -> str:
    known = {plain: shown for names in inside for plain, shown in names.items()}
    near = get_close_matches(plain_name(name), known, n=1, cutoff=0.3)
    guess = f" (the nearest is '{known[near[0]]}')" if near else ""
    return f"None of the materials has a value '{name}'{guess}: name a node and its value, or leave it out."
