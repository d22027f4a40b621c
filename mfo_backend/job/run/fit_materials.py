# SPDX-License-Identifier: Apache-2.0
"""The fit of a job that has several materials: one loaded scene, one result for each and one for all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...metrics.display.tone_mapping import View
from ...types.errors import BadInputError
from ...types.event import Listener
from ...types.image import Encoding, Image
from ...types.parameter_bounds import narrowed
from ...types.result import FitResult
from ...types.status import Status
from ...types.verdict import Verdict, worst
from ..folder.job_folder import JobFolder, clear_outputs
from ..folder.request import Request
from .job_outcome import JobOutcome
from .job_scene import graph_notes, load_native_code, named, request_materials

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
    folder: JobFolder,
    request: Request,
    reference: Image,
    view: View,
    *,
    listener: Listener,
    should_stop: Callable[[], bool],
) -> JobOutcome:
    """Fit the materials of the request's `targets` together; the outcome has one for each of them.

    Raises
    ------
    BadInputError
        If one of them cannot be used, or they are too many.
    SetupError
        If Mitsuba or LLVM is missing.
    Interrupted
        If it was asked to stop before there was anything to keep.
    """
    if request.fit.model not in ("auto", _MODEL):
        raise BadInputError(f"Several materials are fitted with the model {_MODEL!r} alone: choose that.")
    variant = load_native_code()
    from ...fit.materials.judged_materials import fit_together
    from ...fit.materials.rounds import Member
    from ...render.pictures.mitsuba_renderer import load_renderers_together

    inner = [(JobFolder.open(folder.root / path), each) for path, each in request.targets]
    materials = request_materials(folder, request)
    for place, each in inner:  # what nodes give a material is in its own folder
        own = request_materials(place, each)
        if each.target.bsdf_id in own:
            materials[each.target.bsdf_id] = own[each.target.bsdf_id]
    renderers = load_renderers_together(
        folder.root / request.scene,
        [(each.target.shape_id, each.fit.parameters) for _, each in inner],
        materials=materials,
        light_paths=request.light_paths,
    )
    members = []
    for renderer, (_, each) in zip(renderers, inner, strict=True):
        renderer.table = narrowed(renderer.table, request.fit.bounds)
        renderer.start = renderer.table.clip(renderer.start)
        members.append(Member(each.target.material, renderer, replace(request.fit, parameters=each.fit.parameters)))
    display = view if reference.encoding is Encoding.SRGB else None
    together = fit_together(
        members, reference, display=display, listener=listener, should_stop=should_stop, noted=bool(request.left_out),
        begin=lambda: [clear_outputs(place) for place, _ in inner],
    )  # fmt: skip
    found = []
    for (_, each), outcome in zip(inner, together.outcomes, strict=True):
        result = outcome.result
        alone = () if result.judgement is None or result.judgement.verdict is Verdict.SAME else (ONE_CLASS,)
        result = replace(result, notes=(*result.notes, *graph_notes(each, result), *alone), **named(each))
        found.append(JobOutcome(result, outcome.start_image, outcome.result_image, outcome.counted, variant))
    whole = _whole([(each.target.material, one.result) for (_, each), one in zip(inner, found, strict=True)],
                   [int(one.counted.sum()) for one in found])  # fmt: skip
    counted = np.any([one.counted for one in found], axis=0)
    return JobOutcome(whole, found[0].start_image, found[0].result_image, counted, variant, materials=tuple(found))


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
