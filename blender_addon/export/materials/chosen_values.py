# SPDX-License-Identifier: GPL-3.0-or-later
"""The values of the target's graph that a fit is asked for, and what the job holds for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy

from ...graph_values.own_groups import shared_groups
from ...graph_values.place import read
from ...graph_values.table import GraphValue, GraphValueError, chosen_values, graph_values, plain_name
from ...probe.own_blender import save_copy
from ..findings import ExportError, Findings
from ..material_model import Material
from ..nodes.graph_findings import graph_problem
from ..nodes.shader_graph import plain_value
from ..nodes.target_shader import TargetShader, target_shader

COPY = "scene.blend"  # of the file, in the folder of the graph's pictures: the backend has it evaluated
OPAQUE = {"Alpha": 1.0, "Transmission Weight": 0.0}  # what a fit on recorded light asks of a material
ON_RECORDED_LIGHT = ("fast", "balanced", "best")


def chosen_graph_values(
    obj: bpy.types.Object | None, fit: dict[str, Any], findings: Findings, *, together: str = ""
) -> tuple[list[GraphValue], dict[str, Any]]:
    """The values inside the graph that `fit` asks for, and the fit of the sockets alone.

    `together` says what there are several of in the fit, pictures or materials.

    Raises
    ------
    ExportError
        If one is named that the graph does not have, or that this fit cannot change.
    """
    wanted = fit.get("parameters", "all")
    names = () if isinstance(wanted, str) else tuple(name for name in wanted if "/" in str(name))
    rest = fit if isinstance(wanted, str) else fit | {"parameters": [name for name in wanted if name not in names]}
    target = None if obj is None else target_shader(obj.active_material)
    if obj is None or target is None or (isinstance(wanted, str) and wanted != "all"):
        return [], rest
    values = graph_values(target)
    try:
        chosen = chosen_values(values, wanted if isinstance(wanted, str) else names)
    except GraphValueError as error:
        raise ExportError(str(error)) from error
    _check_not_nodes(rest.get("parameters", "all"), target, values)
    several = f"a fit of several {together} changes the values of sockets alone" if together else None
    reason = several or _not_fitted(target, fit)
    if reason is None:
        material = obj.active_material
        for name in shared_groups(material, [value.place for value in chosen]):
            findings.note(
                f"The group '{name}' of material '{material.name}' is used elsewhere too: an apply gives the material "
                "a copy of its own.",
                explains=False,
            )
    if not chosen or reason is None:
        return chosen, rest
    if names:
        raise ExportError(f"{', '.join(names)} cannot be fitted: {reason}.")
    findings.note(f"Values inside nodes ({', '.join(value.name for value in chosen)}) stay as they are: {reason}.")
    return [], rest


def _check_not_nodes(names: str | Sequence[str], target: TargetShader, values: Sequence[GraphValue]) -> None:
    """Refuse the name of a node where that of a value is asked for."""
    sockets = {plain_name(name) for place in (target.places, target.own_names) for name in place}
    for name in () if isinstance(names, str) else map(str, names):
        found = next((value.name for value in values if plain_name(value.label) == plain_name(name)), None)
        if found is not None and plain_name(name) not in sockets:
            raise ExportError(f"'{name}' is a node, not a value: name its values, as '{found}'.")


def _not_fitted(target: TargetShader, fit: dict[str, Any]) -> str | None:
    """Why no value of a graph is fitted, or None."""
    if fit.get("model", "blender_principled") not in ("auto", "blender_principled"):
        return "the model mitsuba_principled takes the averages of what nodes give"
    if fit.get("preset", "balanced") not in ON_RECORDED_LIGHT or fit.get("losses"):
        return "the preset paper fits the values of sockets alone"
    if target.is_mixed:
        return "the material mixes shaders, and nodes may feed several of them"
    for name, opaque in OPAQUE.items():
        socket = target.sockets.get(name)
        if socket is not None and (socket.is_linked or plain_value(socket) != opaque):
            return f"a fit of them needs an opaque material, and {name} is {'linked' if socket.is_linked else 'set'}"
    return None


def by_graph(material: Material, target: TargetShader, values: Sequence[GraphValue], findings: Findings) -> Material:
    """The material whose sockets that chosen values reach are evaluated by Cycles."""
    sockets = dict(material.sockets)
    for name in dict.fromkeys(name for value in values for name in value.sockets):
        if name not in sockets or sockets[name].by_graph:
            continue
        place = target.places[name]
        problem = graph_problem(place.socket, groups=place.groups, is_copied=True)
        if problem is not None:
            findings.error(f"{name} of material '{material.name}' is linked to {problem}: mend or unlink it.")
        sockets[name] = replace(sockets[name], by_graph=True, linked=True, texture=None)
    return replace(material, sockets=sockets)


def request_of(
    context: bpy.types.Context, obj: bpy.types.Object, target: TargetShader, values: Sequence[GraphValue]
) -> dict[str, Any]:
    """What the entry `graph` of request.json has besides for these values."""
    tree = obj.active_material.node_tree
    used = dict.fromkeys(name for value in values for name in value.sockets)
    return {
        "values": [value.request(read(tree, value.place)) for value in values],
        "evaluate": {
            "scene": context.scene.name, "layer": context.view_layer.name, "object": obj.name,
            "slot": obj.active_material_index, "node": target.path,
            "sockets": {name: target.own_name(name) for name in used},
        },
    }  # fmt: skip


def write_copy(folder: Path) -> None:
    """Write the copy of the file that the backend has evaluated into the folder of the graph's pictures.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    save_copy(folder / COPY)
