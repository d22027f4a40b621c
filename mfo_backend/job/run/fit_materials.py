# SPDX-License-Identifier: Apache-2.0
"""The fit of a job that has several materials: one loaded scene, one result for each and one for all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ...render.sheet.contact_sheet import ContactSheet
from ...types.errors import BadInputError
from ...types.event import Listener
from ...types.image import Encoding
from ...types.parameter_bounds import narrowed
from ...types.result import Contradiction, FitResult, PictureResult
from ...types.status import Status
from ...types.verdict import Verdict, worst
from ..folder.job_folder import JobFolder, clear_outputs
from ..folder.request import Request
from .as_in_scene import as_in_scene
from .graph_blender import HELD, GraphsOfMaterial, evaluated_graphs, refusal_of
from .job_outcome import JobOutcome
from .job_scene import load_native_code, material_notes, named, of_one_material, request_materials
from .more_pictures import JobPicture, told_of_first

if TYPE_CHECKING:
    from ...render.pictures.mitsuba_renderer import MitsubaRenderer
    from ...render.sheet.sheet_renderer import SheetRenderer

_MODEL = "blender_principled"
_SAID = {  # of one, of several
    Verdict.SAME: ("looks the same as the reference", "look the same as the reference"),
    Verdict.CLOSE: ("is close to the reference", "are close to the reference"),
    Verdict.DIFFERENT: ("does not match the reference", "do not match the reference"),
    None: ("has no verdict", "have no verdict"),
}
ONE_CLASS = (
    "Other kinds of material (of glass, cut out, glowing) are tried where a material is fitted alone: if this one does "
    "not match, fit it so."
)


def fit_materials(
    pictures: Sequence[JobPicture],
    *,
    blender: Sequence[str] = (),
    listener: Listener,
    should_stop: Callable[[], bool],
) -> JobOutcome:
    """Fit the materials of the first request's `targets` together, to all pictures; the outcome has one for each.

    `blender` is the command line of the Blender that evaluates their nodes while values inside them are fitted.

    Raises
    ------
    BadInputError
        If one of them cannot be used, or they are too many.
    SetupError
        If Mitsuba or LLVM is missing.
    Interrupted
        If it was asked to stop before there was anything to keep.
    """
    request = pictures[0].request
    if request.fit.model not in ("auto", _MODEL):
        raise BadInputError(f"Several materials are fitted with the model {_MODEL!r} alone: choose that.")
    with evaluated_graphs(pictures, blender) as inside:
        return _fit(pictures, _without_refused(request, inside), listener=listener, should_stop=should_stop)


def _without_refused(request: Request, inside: Sequence[GraphsOfMaterial]) -> list[GraphsOfMaterial]:
    """Those that Blender can evaluate; of the others it is said why not."""
    found = []
    for (_, each), of_one in zip(request.targets, inside, strict=True):
        try:
            # pictures that do not show it have those of one that does
            refused = refusal_of(list(dict.fromkeys(of_one.graphs)), each.fit.parameters)
        except BadInputError as error:
            raise BadInputError(f"Material '{each.target.material}': {error}") from error
        found.append(of_one if refused is None else GraphsOfMaterial(notes=(HELD.format(why=refused),)))
    return found


def _fit(
    pictures: Sequence[JobPicture],
    inside: Sequence[GraphsOfMaterial],
    *,
    listener: Listener,
    should_stop: Callable[[], bool],
) -> JobOutcome:
    """The fit with what nodes give each of the materials."""
    request = pictures[0].request
    variant = load_native_code()
    from ...fit.materials.judged_materials import fit_together
    from ...fit.materials.rounds import Member
    from ...fit.pictures.one_sheet import one_sheet

    inner = [(JobFolder.open(pictures[0].folder.root / path), each) for path, each in request.targets]
    renderers = _load(pictures, inside)
    shown, display, notes = pictures[0].reference, pictures[0].view, ()
    of_materials: Sequence[MitsubaRenderer | SheetRenderer] = renderers[0]
    sheet = None
    if len(pictures) > 1:
        task = one_sheet(renderers, *zip(*((p.reference, p.view, p.label) for p in pictures), strict=True))
        shown, display, notes, of_materials = task.reference, task.display or display, task.notes, task.renderers
        sheet = of_materials[0].sheet
        listener = partial(told_of_first, listener, sheet)
    members = [
        Member(each.target.material, renderer, replace(request.fit, parameters=each.fit.parameters))
        for renderer, (_, each) in zip(of_materials, inner, strict=True)
    ]
    together = fit_together(
        members, shown, display=display if shown.encoding is Encoding.SRGB else None, listener=listener,
        should_stop=should_stop, noted=any(p.request.left_out for p in pictures),
        begin=lambda: [clear_outputs(place) for place, _ in inner],
    )  # fmt: skip
    found = []
    for (_, each), outcome, of_graph in zip(inner, together.outcomes, inside, strict=True):
        result = as_in_scene(each, outcome.result)
        alone = () if result.judgement is None or result.judgement.verdict is Verdict.SAME else (ONE_CLASS,)
        result = replace(
            result, notes=(*notes, *of_graph.notes, *result.notes, *material_notes(each, result), *alone), **named(each)
        )
        found.append(JobOutcome(result, outcome.start_image, outcome.result_image, outcome.counted, variant, sheet))
    whole = _whole([(each.target.material, one.result) for (_, each), one in zip(inner, found, strict=True)],
                   [int(one.counted.sum()) for one in found])  # fmt: skip
    whole = replace(whole, pictures=_each_picture(found, sheet), contradiction=_contradiction(request, found))
    if whole.contradiction is not None:
        whole = replace(whole, message=f"{whole.message} {whole.contradiction.sentence}")
    counted = np.any([one.counted for one in found], axis=0)
    return JobOutcome(whole, found[0].start_image, found[0].result_image, counted, variant, sheet, tuple(found))


def _load(pictures: Sequence[JobPicture], inside: Sequence[GraphsOfMaterial]) -> list[list[MitsubaRenderer]]:
    """Each picture's renderers of all materials; values are those of the first, nodes as each camera sees them."""
    from ...render.pictures.mitsuba_renderer import load_renderers_together

    own = [_own_materials(picture) for picture in pictures]
    # what nodes give a material that a picture does not show lights it as the first one that shows it has it
    seen = {bsdf: found for here in reversed(own) for bsdf, (found, is_seen) in here.items() if is_seen}
    found = []
    for number, (picture, here) in enumerate(zip(pictures, own, strict=True)):
        request = picture.request
        materials = request_materials(picture.folder, request)
        for bsdf, (material, is_seen) in here.items():
            first, _ = own[0].get(bsdf, (None, False))
            materials[bsdf] = of_one_material(first, material if is_seen else seen.get(bsdf, material))
        parameters = [each.fit.parameters for _, each in pictures[0].request.targets]
        renderers = load_renderers_together(
            picture.folder.root / request.scene,
            [(each.target.shape_id, free) for (_, each), free in zip(request.targets, parameters, strict=True)],
            materials=materials,
            light_paths=request.light_paths,
            graphs=[each.graphs[number] if each.graphs else None for each in inside],
        )
        for renderer in renderers:
            renderer.table = narrowed(renderer.table, pictures[0].request.fit.bounds)
            renderer.start = renderer.table.clip(renderer.start)
        found.append(renderers)
    return found


def _own_materials(picture: JobPicture) -> dict[str, tuple[dict[str, Any], bool]]:
    """The picture's fitted materials by BSDF, and whether it has what nodes give them: that is in their own folders."""
    found = {}
    for path, each in picture.request.targets:
        bsdf = each.target.bsdf_id
        if bsdf in each.materials:
            alone = replace(each, materials={bsdf: each.materials[bsdf]})
            materials = request_materials(JobFolder.open(picture.folder.root / path), alone)
            found[bsdf] = materials[bsdf], each.graph is not None
    return found


def _each_picture(found: Sequence[JobOutcome], sheet: ContactSheet | None) -> tuple[PictureResult, ...]:
    """What all materials are in each picture: mean errors over their pixels there, and the worst verdict."""
    results = []
    for number, label in enumerate(() if sheet is None else sheet.labels):
        own = [(one, each) for one in found for each in one.result.pictures if each.label == label]
        if not own:  # the fit was stopped before there was one
            return ()
        assert sheet is not None
        pixels = [int(sheet.cut(one.counted, number).sum()) for one, _ in own]
        errors = {
            name: tuple(float(np.average([each.errors[name][k] for _, each in own], weights=pixels)) for k in (0, 1))
            for name in own[0][1].errors
        }
        results.append(PictureResult(label, errors, worst(each.judgement for _, each in own)))  # type: ignore[arg-type]
    return tuple(results)


def _contradiction(request: Request, found: Sequence[JobOutcome]) -> Contradiction | None:
    """The pictures that do not go with the others as most of the pixels say whose materials name some."""
    named: dict[tuple[str, ...], list[int]] = {}
    for number, one in enumerate(found):
        if one.result.contradiction is not None:
            named.setdefault(one.result.contradiction.pictures, []).append(number)
    if not named:
        return None
    of = max(named.values(), key=lambda numbers: sum(int(found[n].counted.sum()) for n in numbers))
    said = found[of[0]].result.contradiction
    assert said is not None
    names = ", ".join(request.targets[number][1].target.material for number in of)
    return replace(said, sentence=f"{names}: {said.sentence}")


def _whole(results: Sequence[tuple[str, FitResult]], pixels: Sequence[int]) -> FitResult:
    """What is said of all materials by their names: the worst status and verdict, mean errors over their `pixels`."""
    statuses = [result.status for _, result in results]
    status = next((s for s in (Status.CANCELLED, Status.DIFFERENT) if s in statuses), statuses[0])
    names = results[0][1].errors
    message = f"{len(results)} materials: {_counts(results)}."
    return FitResult(
        status=status,
        message=f"{message} {status.sentence}" if status is Status.CANCELLED else message,
        model=_MODEL,
        initial={},
        recovered={},
        bounds={},
        stages=(),
        errors={
            name: tuple(
                float(np.average([result.errors[name][k] for _, result in results], weights=pixels)) for k in (0, 1)
            )
            for name in names
        },  # type: ignore[arg-type]  # of two numbers
        seconds=sum(result.seconds for _, result in results),
        passes=sum(result.passes for _, result in results),
        judgement=worst(result.judgement for _, result in results),
    )


def _counts(results: Sequence[tuple[str, FitResult]]) -> str:
    """How many have each verdict, and which ones where that is not the best."""
    parts = []
    for verdict, words in _SAID.items():
        having = [name for name, r in results if (r.judgement.verdict if r.judgement is not None else None) is verdict]
        which = "" if verdict is Verdict.SAME else f" ({', '.join(having)})"
        if having:
            parts.append(f"{len(having)} {words[len(having) > 1]}{which}")
    return ", ".join(parts)
