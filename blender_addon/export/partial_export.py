# SPDX-License-Identifier: GPL-3.0-or-later
"""What one picture needs of a job: scene, meshes, textures and what nodes give, written but for its requests."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import bpy

from ..graph_values.place import holder_of, is_there
from ..result.animated_sockets import VALUE, animation_notes
from ..result.local_copy import unwritable
from ..versions import PRINCIPLED
from .camera.render_region import pictured_region, region_parts
from .files.job_folder import TARGETS, link_files
from .findings import ExportError, Findings, NotShownError
from .fitted_slot import FittedSlot, check_slots
from .material_model import Material
from .materials.chosen_leaves import chosen_mix_values, name_shares, with_mix_values
from .materials.chosen_values import by_graph, request_of, write_copy
from .materials.node_graph import FOLDER as GRAPH_FOLDER
from .materials.node_graph import NodeGraph, evaluate_graph, largest_leaf, probe_for
from .materials.read_material import with_default_tangent
from .materials.wanted_values import WantedValues, fits_of_each, through_glass, wanted_values
from .meshes.known_meshes import KnownMeshes
from .nodes.leaf_kinds import default_names
from .nodes.target_shader import TargetShader, target_shader
from .reference.picture_setup import size_of
from .reference.reference import Picture, read_reference
from .request import WholeRequest, parameter_of
from .scene.candidates import candidates
from .scene.read_scene import finish_scene, read_scene
from .scene.scene_bakes import SceneBakes
from .scene.scene_data import SceneData, target_bsdf
from .scene.scene_file import scene_files
from .scene.visibility import OUTSIDE
from .steps import Pause, Steps

MITSUBA = "mitsuba_principled"


@dataclass(frozen=True)
class PartialExport:
    """One picture's part of a job, all written but its requests: its own, and those of further materials by folder."""

    request: dict[str, Any]
    findings: Findings
    more: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    leaves: tuple[str | None, ...] = ()  # of a mix the one that each fitted material's plain names are of
    unseen: frozenset[int] = frozenset()  # numbers of fitted materials that the picture does not show

    @property
    def values(self) -> dict[tuple[str, str], Any]:
        """The values of what is fitted by material and socket or name, without what is linked.

        Those inside the nodes of a material are there where the picture shows it.
        """
        each = list(self.more.values()) or [self.request]
        found = {}
        for request in each:
            bsdf = request["target"]["bsdf_id"]
            sockets = self.request["materials"].get(bsdf, {"sockets": {}})["sockets"]
            found |= {(bsdf, name): socket["value"] for name, socket in sockets.items() if not socket["linked"]}
            inside = request.get("graph", {}).get("values", ())
            found |= {(bsdf, value["name"]): value["value"] for value in inside}
        return found

    def write_request(self, folder: Path) -> None:
        """Write request.json, and those of further materials into their folders."""
        for path, request in {"": self.request, **self.more}.items():
            text = json.dumps(request, indent=2, ensure_ascii=False)
            (folder / path / "request.json").write_text(text + "\n", encoding="utf-8")


def partial_export(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    folder: Path,
    reference: Picture | None,
    fit: dict[str, Any],
    reference_view: str,
    upright: bool,
    tell: Callable[[float], None] = lambda _share: None,
    *,
    several: bool = False,
    is_first: bool = True,
    leaves: Sequence[str | None] | None = None,
    targets: Sequence[FittedSlot] = (),
    known: KnownMeshes | None = None,
) -> Steps[PartialExport]:
    """Write what one picture needs, as the context shows it, into an existing folder; all but request.json.

    `several` says that it is one of several pictures, and `is_first` that it is the first of them; `leaves` are the
    fitted ones of mixes where they are known, and `targets` slots whose materials are fitted together.
    `known` has the meshes of earlier exports.

    Raises
    ------
    NotShownError
        If it is one of several pictures and shows nothing of what is fitted.
    ExportError
        If the scene or the reference cannot be used.
    """
    findings = Findings(of_mitsuba=fit.get("model") == MITSUBA)
    fitted = list(targets) or ([FittedSlot.active(obj)] if obj is not None else [])
    check_slots(fitted)
    asked = fits_of_each(fitted, fit, several=bool(targets))
    wanted = [wanted_values(each, own, findings) for each, own in zip(fitted, asked, strict=True)]
    size = size_of(reference, upright=upright)
    region = pictured_region(context.scene.render, size)
    with probe_for(fitted, always=any(each.values or each.turns for each in wanted)) as probe:
        # names that the user chose are those of the leaf that the panel shows
        by_share = isinstance(fit.get("parameters", "all"), str)
        if leaves is None:
            found: list[str | None] = []
            for each in fitted:
                if probe is not None and by_share:
                    found.append((yield from largest_leaf(probe, context, each, may_miss=several, region=region)))
                else:
                    found.append(each.leaf)
            leaves = found
        for number, leaf in enumerate(leaves):
            if leaf is not None:  # whose numbers and values are others
                wanted[number] = wanted_values(fitted[number], asked[number], Findings(), leaf)
        with SceneBakes(context, probe) as bakes:
            fitted = [replace(each, leaf=own) for each, own in zip(fitted, leaves, strict=True)]
            leaf = leaves[0] if leaves else None
            together = fitted if targets else ()
            data = yield from read_scene(
                context, obj, findings, bakes, leaf, together, may_miss=several, picture=size, known=known
            )
            findings.raise_first()
            assert data is not None
            assert obj is not None
            if len(data.unseen) == len(fitted):
                raise NotShownError(data.unseen[0])
            for number, glass in data.behind.items():
                if glass:
                    described = data.materials[target_bsdf(number)]
                    wanted[number] = through_glass(wanted[number], described, glass, findings)
            fits = []
            for number, each in enumerate(fitted):
                fits.append(_read_values(data, context, each, number, wanted[number], findings))
            tell(0.4)
            picture = read_reference(reference, context.scene, data.camera.size, made=reference_view, upright=upright)
            if picture is not None and region is None:
                picture = replace(picture, region=region_parts(context.scene.render))
            for said in picture.notes if picture is not None else ():
                findings.note(said, explains=False)  # a wrong view shows around the target, too
            inside = [
                {}
                if data.behind.get(k)  # no value inside its nodes can be fitted
                else request_of(context, each, data.materials[target_bsdf(k)], own.values, region, data.origin)
                for k, (each, own) in enumerate(zip(fitted, wanted, strict=True))
            ]
            # all pictures are evaluated in the first one's copy, as it was read
            if any("values" in own for own in inside) and is_first:
                write_copy(folder / GRAPH_FOLDER)
            yield Pause(bakes.is_ready)
            finish_scene(data, findings, bakes)
        findings.raise_first()
        yield Pause()
        graphs: list[NodeGraph | None] = [None for _ in fitted]
        unseen = set(data.unseen)
        for number, each in enumerate(fitted):
            described = data.materials[target_bsdf(number)]
            if probe is not None and (described.asks_graph or wanted[number].values):
                described, graphs[number] = yield from evaluate_graph(
                    probe, context, each, described, number, may_miss=several, region=region, origin=data.origin
                )
                data.materials[target_bsdf(number)] = described
                (unseen.add if graphs[number] is None else unseen.discard)(number)  # Cycles knows better than rays
            if number not in unseen:
                name_shares(described, findings)
        if len(unseen) == len(fitted):
            raise NotShownError(OUTSIDE.format(obj=fitted[0].object.name))
        files = scene_files(data, findings)
        findings.raise_first()
        yield Pause()
        tell(0.5)
        paths = [f"{TARGETS}/{number}" for number in range(1, len(fitted) + 1)] if targets else [""]
        whole = WholeRequest(context.scene, data, files, picture, findings)
        requests = {p: whole.of(f, n, fits[n]) for n, (p, f) in enumerate(zip(paths, fitted, strict=True))}
        if targets:
            requests[""] = whole.of(fitted[0], 0, fits[0], seen=False) | {"targets": paths}
        else:
            requests[""] |= candidates(context.scene, data)
        files.write(folder)
        yield Pause()
        tell(0.9)
        if picture is not None and reference is not None:
            reference_entry = picture.write(folder)
            for each in requests.values():
                each["reference"] = reference_entry
                each["generator"]["reference"] = reference.name  # what the user calls it
        for path, graph, own in zip(paths, graphs, inside, strict=True):
            if path:
                link_files(folder, folder / path)
            if graph is not None:
                requests[path]["graph"] = graph.request() | own
                graph.write(folder / path)
    return PartialExport(requests.pop(""), findings, requests, tuple(leaves), frozenset(unseen))


def _read_values(
    data: SceneData,
    context: bpy.types.Context,
    fitted: FittedSlot,
    number: int,
    wanted: WantedValues,
    findings: Findings,
) -> dict[str, Any]:
    """Let the wanted values of its graph be evaluated and those of its mix be free, say what an apply cannot do.

    Returns the fit of this material.
    """
    material, bsdf = fitted.material, target_bsdf(number)
    target = target_shader(material, fitted.leaf)
    assert material is not None
    assert target is not None  # it was read
    if unwritable(material):
        findings.note(f"The values cannot be applied as it is. {unwritable(material)}", explains=False)
    described = with_default_tangent(data.materials[bsdf], is_fitted=wanted.turns)
    data.materials[bsdf] = by_graph(described, target, wanted.values, findings)
    findings.raise_first()
    chosen = chosen_mix_values(material, target, wanted.of_mix, wanted.fit, findings)
    data.materials[bsdf] = with_mix_values(data.materials[bsdf], target, chosen)
    fit = _fit_of(target, data.materials[bsdf], wanted.fit, alone=not (wanted.values or chosen))
    unlinked = {n: s for n, s in target.sockets.items() if hasattr(s, VALUE) and not s.is_linked}
    named = {target.own_name(name): (socket, VALUE) for name, socket in unlinked.items()}
    tree = material.node_tree
    named |= {v.name: holder_of(tree, v.place) for v in (*wanted.values, *chosen) if is_there(tree, v.place)}
    for said in animation_notes(named, context.scene.frame_current):
        findings.note(said, explains=False)
    return fit


def _fit_of(target: TargetShader, material: Material, fit: dict[str, Any], *, alone: bool) -> dict[str, Any]:
    """The fit of what the target's node has, `alone` or with its graph's values.

    Values are called as the node or as the Principled BSDF calls them.
    """
    if not material.is_mixed and target.node.bl_idname == PRINCIPLED:
        return fit
    label = target.node.bl_label
    if fit.get("model", "blender_principled") != "blender_principled":
        said = f"A {label}" if target.node.bl_idname != PRINCIPLED else "A mix of shaders"
        raise ExportError(f"{said} is fitted with the model blender_principled alone: choose that.")
    if target.node.bl_idname == PRINCIPLED:
        return fit
    free = {name: socket for name, socket in material.sockets.items() if name in target.places and not socket.linked}
    known = {parameter_of(name): parameter_of(name) for name in target.places}
    known |= {parameter_of(target.own_name(name)): parameter_of(name) for name in target.places}
    wanted = fit.get("parameters", "all")
    if isinstance(wanted, str):
        values = {name: socket.value for name, socket in free.items()}
        chosen = [parameter_of(name) for name in default_names(values)]
    else:
        chosen = list(dict.fromkeys(known[parameter_of(name)] for name in wanted if parameter_of(name) in known))
    if not chosen and alone:
        names = [f"{target.own_name(name)} ({parameter_of(name)})" for name in target.places]
        listed = ", ".join(names[:-1]) + f" and {names[-1]}" if len(names) > 1 else names[0]
        raise ExportError(
            f"A {label} has {listed} alone, and none of them is left to fit: choose one that has no link."
        )
    return fit | {"parameters": chosen}
