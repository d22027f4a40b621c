# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit of a mix changes beside the chosen leaf: values of other leaves and Mix factors, by name or all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import bpy

from ...graph_values.mix_values import MixValue, inside_values, ways_of, why_no_mix_values
from ...graph_values.place import read
from ...graph_values.table import GraphValueError, named, one_word, plain_name
from ..findings import ExportError, Findings
from ..material_model import Material
from ..nodes.target_shader import TargetShader, fits_all_leaves, target_shader

MOST_UNKNOWN = 0.5  # share of a mix that a shader without an exact model may have


def named_mix_values(material: bpy.types.Material | None, fit: dict[str, Any]) -> tuple[list[str], dict[str, Any]]:
    """The values of a mix that `fit` names beside its fitted leaf, and the fit without them.

    Those inside nodes stay in it. The fitted leaf's own values may be named after its node, too.

    Raises
    ------
    ExportError
        If one is named that the mix does not have, or that no fit can change.
    """
    asked = fit.get("parameters", "all")
    target = target_shader(material)
    if target is None or not target.is_mixed or isinstance(asked, str):
        return [], fit
    label = one_word(target.node.label or target.node.name)
    own = {plain_name(f"{label}/{target.own_name(name)}"): name for name in target.places}
    wanted: list[str] = [own.get(plain_name(name), str(name)) for name in asked]
    inside = [name for name in wanted if "/" in name]
    problem, known = why_no_mix_values(target), inside_values(target)
    if inside and not known and problem is not None:
        raise ExportError(f"{', '.join(inside)} cannot be fitted: {problem}.")
    try:
        found = named(known, inside)
    except GraphValueError as error:
        raise ExportError(str(error)) from error
    of_mix = [value.name for value in found if isinstance(value, MixValue)]
    in_nodes = [value.name for value in found if value.name not in of_mix]
    return of_mix, fit | {"parameters": [*(name for name in wanted if "/" not in name), *in_nodes]}


def chosen_mix_values(
    material: bpy.types.Material, target: TargetShader, names: Sequence[str], fit: dict[str, Any], findings: Findings
) -> list[MixValue]:
    """The values of the target's mix of these names, or those that *All* takes of all its shaders."""
    by_all = fit.get("parameters", "all") == "all" and fits_all_leaves(material) and target.is_mixed
    if not names and not by_all:
        return []
    problem = why_no_mix_values(target)
    if problem is not None:
        findings.note(f"Of the mix '{target.name}' alone is fitted: {problem}.")
        return []
    values = [value for value in inside_values(target) if isinstance(value, MixValue)]
    left = [value.name for value in values if by_all and value.factor is not None and not value.by_default]
    if left:
        findings.note(
            f"{', '.join(left)} stays as it is: the colours of its shaders make up for it, up to white. Name "
            "it among the values to have it fitted, with those colours held.",
            explains=False,
        )
    return [value for value in values if (value.by_default if by_all else value.name in names)]


def with_mix_values(material: Material, target: TargetShader, chosen: Sequence[MixValue]) -> Material:
    """The material with what is free of its mix."""
    if not chosen:
        return material
    tree = (target.groups[0] if target.groups else target.node).id_data
    free = [value for value in chosen if value.factor is not None]
    factors = [value.factor for value in free if value.factor is not None]
    leaves = [
        replace(
            leaf,
            free={value.socket: value.name for value in chosen if value.leaf == number},
            ways=tuple(ways_of(target.others[number], factors)),
        )
        for number, leaf in enumerate(material.leaves)
    ]
    return replace(
        material,
        factors=tuple({"name": value.name, "value": read(tree, value.place)} for value in free),
        ways=tuple(ways_of(target.leaf, factors)),
        leaves=tuple(leaves),
    )


def name_shares(material: Material, findings: Findings) -> None:
    """Say how much of a mix each leaf is.

    Raises
    ------
    ExportError
        If what has no model is most of it.
    """
    leaves = (material, *material.leaves)
    if len(leaves) < 2:
        return
    listed = ", ".join(f"'{'/'.join(leaf.node)}' {100.0 * float(leaf.weight.value):.0f} %" for leaf in leaves)
    findings.note(f"Shares of the target's shaders: {listed}; {_said_of(material)}.", explains=False)
    for leaf in material.leaves:
        if leaf.is_nearest and float(leaf.weight.value) > MOST_UNKNOWN:
            raise ExportError(
                f"'{leaf.name}' is {100.0 * float(leaf.weight.value):.0f} % of material '{material.name}', and the fit "
                "has no model of it: its values cannot be told from the others'. Unlink it, or fit another material."
            )


def _said_of(material: Material) -> str:
    """What is fitted of a mix."""
    others = sum(bool(leaf.free) for leaf in material.leaves)
    if not (others or material.factors):
        return "the first is fitted"
    of = [f"{others} more"] if others else []
    of += ["Mix factors"] if material.factors else []
    return f"the first is fitted, and {' and '.join(of)}"
