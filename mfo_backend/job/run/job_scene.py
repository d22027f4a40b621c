# SPDX-License-Identifier: Apache-2.0
"""What the scene of a job is loaded with: native code and materials, and what is said of these."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from ...material.principled.blender_selection import ASKED_FOR, LAYERS_OF_ONE
from ...material.principled.principled_dict import DIRECTIONS
from ...material.principled.principled_parameters import SOCKET_OF_PARAMETER
from ...types.result import FitResult
from ...types.verdict import Cause, Verdict
from ..folder.graph_files import locate_files
from ..folder.job_folder import JobFolder
from ..folder.request import Request, request_to_json

_GRAPH_AVERAGES = (
    "The model 'mitsuba_principled' takes the averages of what nodes give ({names}), and leaves their normals out."
)
_GRAPH_UNSEEN = (
    "What nodes give ({names}) is known where a ray of the camera meets the target, behind each other up to {depths} "
    "times: what other things hide has the averages."
)
_GRAPH_FLAT = "The fit on whole light paths leaves out the normals that nodes give; pictures and errors have them."
_GRAPH_STAYED = "The nodes have values that were not fitted ({names}): if the reference shows others, choose them, too."
MOST_NAMED = 6  # of these values
_NONE_OF_IT = (
    "What is 0 in the material was not fitted ({names}): if the reference shows it, give it a value and fit again."
)
_GLOW_HELD = (
    "Nodes give the glow of the material, so it was not fitted: if the reference glows more or less, change Emission "
    "Strength by hand."
)
_LEAVES_HELD = (
    "Other shaders of the mix kept their values ({names}): if the reference shows others, choose them where they are "
    "offered, or change them by hand."
)


def load_native_code() -> str:
    """Import Mitsuba and choose its variant; returns the variant's name.

    Raises
    ------
    SetupError
        If Mitsuba or LLVM is missing.
    """
    from ...render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()  # before the first import of drjit, so the imports below stay here
    from ...render.machine.variant import load_variant

    return load_variant()


def named(request: Request) -> dict[str, Any]:
    """What the fitted shader and its values are called, where they are not those of a plain Principled BSDF."""
    material = request.materials.get(request.target.bsdf_id)
    if material is None or not (request.target.labels or material.leaves):
        return {}
    return {"shader": "/".join(request.target.node), "labels": dict(request.target.labels)}


def material_notes(request: Request, result: FitResult, tried: Collection[str] = ()) -> tuple[str, ...]:
    """What of the target's material the fit does not hold or left as it was, in sentences.

    `tried` are names of values that fits from other classes of material have.
    """
    return (*graph_notes(request, result), *absent_notes(request, result, tried), *held_notes(request, result))


def graph_notes(request: Request, result: FitResult) -> tuple[str, ...]:
    """What is not held of the values that nodes give the target, and which of them stayed where the result is not the
    same as the reference, in sentences."""
    material = request.materials.get(request.target.bsdf_id)
    held = [name for name, socket in material.all_sockets if socket.graph] if material is not None else []
    if not held:
        return ()
    names = ", ".join(held)
    if result.model == "mitsuba_principled":
        return (_GRAPH_AVERAGES.format(names=names),)
    notes = []
    if any("whole light paths" in note for note in result.notes):
        notes.append(_GRAPH_UNSEEN.format(names=names, depths=1 if request.graph is None else request.graph.depths))
        notes += [_GRAPH_FLAT] if set(DIRECTIONS) & set(held) else []
    stayed = () if request.graph is None else request.graph.held
    if stayed and result.judgement is not None and result.judgement.verdict is not Verdict.SAME:
        more = () if len(stayed) <= MOST_NAMED else ("...",)
        notes.append(_GRAPH_STAYED.format(names=", ".join((*stayed[:MOST_NAMED], *more))))
    return tuple(notes)


def absent_notes(request: Request, result: FitResult, tried: Collection[str] = ()) -> tuple[str, ...]:
    """What a fit of `all` leaves out because the material has none of it, where the material alone does not match.

    Not what was `tried` from another class of material.
    """
    material, judgement = request.materials.get(request.target.bsdf_id), result.judgement
    if material is None or request.target.labels or request.fit.parameters != "all":
        return ()
    if judgement is None or judgement.verdict is Verdict.SAME or judgement.cause is not Cause.MATERIAL:
        return ()
    names = [SOCKET_OF_PARAMETER[name] for name in ASKED_FOR if name not in {*result.recovered, *tried}]
    own = {name: material.sockets[name] for name in names if name in material.sockets}
    for leaf in material.leaves:  # a fit of `all` gives these to the fitted one alone
        layers = [SOCKET_OF_PARAMETER[name] for name in LAYERS_OF_ONE if leaf.free]
        own |= {f"{leaf.name}/{name}": leaf.sockets[name] for name in layers if name in leaf.sockets}
    absent = [name for name, socket in own.items() if socket.value == 0.0 and not socket.linked]
    return (_NONE_OF_IT.format(names=", ".join(absent)),) if absent else ()


def held_notes(request: Request, result: FitResult) -> tuple[str, ...]:
    """What was held and may light other things, where the result is not the same: they seem to be lit by other lamps.

    That is a glow that nodes give, and other shaders of a mix.
    """
    material, judgement = request.materials.get(request.target.bsdf_id), result.judgement
    if material is None or judgement is None or judgement.verdict is Verdict.SAME:
        return ()
    leaves = ", ".join(leaf.name for leaf in material.leaves if not (leaf.free or leaf.varies))
    notes = [_LEAVES_HELD.format(names=leaves)] if leaves else []
    names = [SOCKET_OF_PARAMETER[name] for name in ("emission_color", "emission_strength")]
    color, strength = map(material.sockets.get, names)
    values = () if request.graph is None else request.graph.values
    fitted = {name for value in values if value.name in result.recovered for name in value.sockets}
    is_fitted = "emission_strength" in result.recovered or not fitted.isdisjoint(names)
    if color is not None and strength is not None and not is_fitted:
        glows = strength.linked or (color.linked and strength.value != 0.0)
        notes += [_GLOW_HELD] if glows else []
    return tuple(notes)


def request_materials(folder: JobFolder, request: Request) -> dict[str, dict[str, Any]]:
    """The request's materials with textures by absolute path, the Blender version and the film's exposure."""
    materials = request_to_json(request)["materials"]
    if request.target.bsdf_id in materials:
        labels = {"labels": dict(request.target.labels), "node": "/".join(request.target.node)}
        materials[request.target.bsdf_id] |= labels
    for material in materials.values():
        material["blender_version"] = tuple(request.generator.get("blender", (5, 0)))
        material["film_exposure"] = request.film_exposure
        for leaf in (material, *material["leaves"]):
            for name, socket in (*leaf["sockets"].items(), ("weight", leaf["weight"])):
                locate_files(folder, request.graph, name, socket)
    return materials


def of_one_material(first: dict[str, Any] | None, here: dict[str, Any]) -> dict[str, Any]:
    """The target's material of the first picture, with what nodes give it as this one's camera sees it."""
    if first is None:
        return here
    own = {name: socket for name, socket in here["sockets"].items() if socket.get("graph") or socket.get("texture")}
    return first | {"sockets": first["sockets"] | own, "weight": here["weight"], "leaves": here["leaves"]}
