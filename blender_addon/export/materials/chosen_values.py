# SPDX-License-Identifier: GPL-3.0-or-later
"""The values of the target's graph that a fit is asked for, and what the job holds for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...graph_values.mix_values import default_values, inside_values
from ...graph_values.own_groups import shared_groups
from ...graph_values.place import read
from ...graph_values.table import WEIGHT, GraphValue, GraphValueError, named, plain_name
from ...process.saved_file import save_copy
from ..camera.camera_model import Region, edges_of
from ..camera.render_region import picture_size
from ..findings import ExportError, Findings
from ..fitted_slot import FittedSlot
from ..material_model import SHADING_NORMAL, Material
from ..nodes.graph_findings import graph_problem
from ..nodes.leaf_kinds import CLEAR_SHADERS, KINDS, OPAQUE, is_numbered
from ..nodes.shader_graph import plain_value
from ..nodes.target_shader import DIRECTIONS, TargetShader, fits_all_leaves, target_shader

COPY = "scene.blend"  # of the file, in the folder of the graph's pictures: the backend has it evaluated
ON_RECORDED_LIGHT = ("fast", "balanced", "best")


def chosen_graph_values(
    material: bpy.types.Material | None, fit: dict[str, Any], findings: Findings, *, leaf: str | None = None
) -> tuple[list[GraphValue], dict[str, Any]]:
    """The values inside the material's graph that `fit` asks for, and the fit of the sockets alone.

    `leaf` names the fitted one of a mix.

    Raises
    ------
    ExportError
        If one is named that the graph does not have, or that this fit cannot change.
    """
    wanted = fit.get("parameters", "all")
    names = () if isinstance(wanted, str) else tuple(name for name in wanted if "/" in str(name))
    rest = fit if isinstance(wanted, str) else fit | {"parameters": [name for name in wanted if name not in names]}
    target = target_shader(material, leaf)
    if material is None or target is None or (isinstance(wanted, str) and wanted != "all"):
        return [], rest
    values = [value for value in inside_values(target) if isinstance(value, GraphValue)]
    by_all = default_values(target, all_leaves=fits_all_leaves(material))
    try:
        chosen = named(values, names) if names else [v for v in by_all if v in values] if wanted == "all" else []
    except GraphValueError as error:
        raise ExportError(str(error)) from error
    _check_not_nodes(rest.get("parameters", "all"), target, values)
    reason = _not_fitted(target, fit)
    if reason is None:
        for name in shared_groups(material, [value.place for value in chosen]):
            findings.note(
                f"The group '{name}' of material '{material.name}' is used elsewhere too: an apply gives the material "
                "a copy of its own.",
                explains=False,
            )
    if not chosen or reason is None:
        return chosen, rest
    say_held(material.name, [value.name for value in chosen], reason, findings, named=bool(names))
    return [], rest


def say_held(material: str, values: Sequence[str], reason: str, findings: Findings, *, named: bool) -> None:
    """Say that these values inside the nodes of a material stay as they are, and why; an error if they were named."""
    held = ", ".join(values)
    if named:
        raise ExportError(f"{held} cannot be fitted: {reason}.")
    findings.note(f"Values inside nodes of material '{material}' ({held}) stay as they are: {reason}.")


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
    for name, opaque in OPAQUE.items():
        socket = target.sockets.get(name)
        if socket is None or (name == "Alpha" and socket.is_linked and not target.is_mixed):
            continue  # holes that stay as they are
        if socket.is_linked or plain_value(socket) != opaque:
            return f"a fit of them needs an opaque material, and {name} is {'linked' if socket.is_linked else 'set'}"
    if KINDS[target.leaf.node.bl_idname].shader in CLEAR_SHADERS:
        return f"a fit of them needs an opaque material, and '{target.name}' lets light through"
    if target.volume is not None:
        return "a fit of them needs an opaque material, and light goes through this one into a volume"
    return None


def by_graph(material: Material, target: TargetShader, values: Sequence[GraphValue], findings: Findings) -> Material:
    """The material whose sockets and weights that chosen values reach are evaluated by Cycles."""
    names = list(dict.fromkeys(name for value in values for name in value.sockets))
    numbers = _numbers_of_leaves(target)
    leaves = list(material.leaves)
    for number, position in enumerate(numbers):
        own = [name.partition("/")[2] for name in names if name.startswith(f"{number}/")]
        leaves[position] = _by_graph(leaves[position], TargetShader(target.others[position]), own, findings)
    own = [name for name in names if "/" not in name]
    return replace(_by_graph(material, target, own, findings), leaves=tuple(leaves))


def _by_graph(material: Material, target: TargetShader, names: Sequence[str], findings: Findings) -> Material:
    """A leaf, of which these are evaluated; what is linked to factors has been looked at."""
    if not names:
        return material
    sockets, weight = dict(material.sockets), material.weight
    for name in names:
        if name == WEIGHT:
            weight = replace(weight, by_graph=True, linked=True, texture=None)
        if name not in sockets or sockets[name].by_graph:
            continue
        place = target.places[name]
        problem = graph_problem(place.socket, groups=place.groups, is_copied=True)
        if problem is not None:
            findings.error(f"{name} of material '{material.name}' is linked to {problem}: mend or unlink it.")
        sockets[name] = replace(sockets[name], by_graph=True, linked=True, texture=None)
    return replace(material, sockets=sockets, weight=weight, varies=True)


def _numbers_of_leaves(target: TargetShader) -> list[int]:
    """Where in a mix's other shaders those are that the names of what values reach have numbers of."""
    return [position for position, leaf in enumerate(target.others) if is_numbered(leaf.node)]


def request_of(
    context: bpy.types.Context,
    fitted: FittedSlot,
    described: Material,
    values: Sequence[GraphValue],
    region: Region | None = None,
    origin: NDArray[np.float64] | None = None,
) -> dict[str, Any]:
    """What the entry `graph` of request.json has besides for these values, and the names of all others.

    `described` is the material as the job has it. The picture may show a `region` alone.
    """
    material, target = fitted.material, target_shader(fitted.material, fitted.leaf)
    if material is None or target is None:
        return {}
    held = {"held": [v.name for v in inside_values(target) if isinstance(v, GraphValue) and v not in values]}
    if not values:
        return held
    tree = material.node_tree
    used = dict.fromkeys(name for value in values for name in value.sockets)
    if not used.keys().isdisjoint(DIRECTIONS):  # one frame is made of all of them
        bent = [name for name in (SHADING_NORMAL, *DIRECTIONS) if name in described.sockets]
        used |= dict.fromkeys(name for name in bent if described.sockets[name].by_graph)
    numbers = _numbers_of_leaves(target)

    def path(name: str) -> list[str]:
        leaf, _, own = name.rpartition("/")
        shader = TargetShader(target.others[numbers[int(leaf)]]) if leaf else target
        return [*shader.path, "" if own == WEIGHT else shader.own_name(own)]

    return {
        "values": [value.request(read(tree, value.place)) for value in values],
        "evaluate": {
            "scene": context.scene.name, "layer": context.view_layer.name, "object": fitted.object.name,
            "slot": fitted.slot, "sockets": {name: path(name) for name in used},
            "view": _view(context.scene, region, origin),
        },
        **held,
    }  # fmt: skip


def _view(scene: bpy.types.Scene, region: Region | None, origin: NDArray[np.float64] | None) -> dict[str, Any]:
    """What the picture shows of the copy, which another picture's export may have made."""
    width, height = picture_size(scene.render)
    assert scene.camera is not None  # it was read
    view = {"camera": scene.camera.name, "frame": scene.frame_current_final, "width": width, "height": height}
    if region is not None:
        view["region"] = edges_of(region)
    if origin is not None and origin.any():
        view["origin"] = origin.tolist()
    return view


def write_copy(folder: Path) -> None:
    """Write the copy of the file that the backend has evaluated into the folder of the graph's pictures.

    Its relative paths are as from there: it cannot be moved.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    folder.mkdir(exist_ok=True)
    save_copy(folder / COPY)
