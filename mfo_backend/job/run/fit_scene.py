# SPDX-License-Identifier: Apache-2.0
"""The fit that a job runs: the request's scene in Mitsuba against its reference."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from ...metrics.display.tone_mapping import View
from ...render.models.graph_pictures import GraphPictures
from ...render.sheet.contact_sheet import ContactSheet
from ...types.errors import BadInputError
from ...types.event import Event, Listener, Preview
from ...types.image import Image
from ...types.parameter_bounds import narrowed
from ...types.result import FitResult
from ..folder.job_folder import JobFolder
from ..folder.request import Request
from .class_trials import Fitted, with_other_classes, with_plainer_glow
from .fit_materials import fit_materials
from .graph_blender import evaluated_graph
from .job_outcome import JobOutcome
from .job_scene import graph_notes, load_native_code, named, request_materials
from .material_classes import (
    MaterialClass,
    brightest_glow,
    changed,
    is_rich,
    is_worth_another,
    other_classes,
    parameters_of,
)
from .more_pictures import JobPicture

if TYPE_CHECKING:
    from ...render.pictures.mitsuba_renderer import MitsubaRenderer
    from ...render.pictures.renderer import Renderer

# imported where they are needed, as `mfo --help` needs none of them
_OF_EVERY_FIT = (
    *("...fit.recover_material", "...render.pictures.renderer"),
    *("...render.paths.recorded_scene", "...render.paths.traced_paths"),
    *("scipy.ndimage", "scipy.optimize", "PIL.Image", "PIL.ImageDraw", "PIL.ImageFont"),
)
_WITHOUT_LIGHT_PATHS = (
    "Left out of the fit with the model 'mitsuba_principled': Cycles' Filter Glossy, clamping of indirect light and "
    "limits for one kind of bounce."
)


class Fitter(Protocol):
    """Fits what a request asks for; tests give one that needs no renderer."""

    def __call__(
        self,
        folder: JobFolder,
        request: Request,
        reference: Image,
        view: View,
        *,
        listener: Listener,
        should_stop: Callable[[], bool],
        more: Sequence[JobPicture] = (),
    ) -> JobOutcome:
        """Run the fit, to `more` pictures at once; errors are those of `recover_material`."""
        ...


def fit_scene(
    folder: JobFolder,
    request: Request,
    reference: Image,
    view: View,
    *,
    listener: Listener,
    should_stop: Callable[[], bool],
    more: Sequence[JobPicture] = (),
    blender: Sequence[str] = (),
) -> JobOutcome:
    """Fit the material of the request's target with Mitsuba, to `more` pictures of it at once where there are some.

    `blender` is the command line of the Blender that evaluates the target's nodes while values inside them are fitted.

    Raises
    ------
    BadInputError
        If the scene, the target or a parameter cannot be used, or values inside nodes are all that is to be fitted and
        there is no Blender.
    SetupError
        If Mitsuba or LLVM is missing.
    Interrupted
        If it was asked to stop before there was anything to keep.
    """
    if request.targets:
        return fit_materials(folder, request, reference, view, listener=listener, should_stop=should_stop)
    pictures = [JobPicture(folder, request, reference, view), *more]
    with evaluated_graph(folder, request, () if more else blender) as (graph, notes):
        return _fit_scene(pictures, graph, notes, listener, should_stop)


def _fit_scene(
    pictures: Sequence[JobPicture],
    graph: GraphPictures | None,
    notes: tuple[str, ...],
    listener: Listener,
    should_stop: Callable[[], bool],
) -> JobOutcome:
    request, reference, view = pictures[0].request, pictures[0].reference, pictures[0].view
    variant = load_native_code()
    from ...fit.pictures.one_sheet import SheetTask, one_sheet
    from ...fit.recover_material import recover_material
    from ...render.pictures.interruptible import InterruptibleRenderer, NativeThread
    from ...render.pictures.mitsuba_renderer import load_mitsuba_renderer

    target, fit_of = request.target.bsdf_id, request.fit
    all_materials = [request_materials(picture.folder, picture.request) for picture in pictures]
    first = all_materials[0]
    for others in all_materials[1:]:
        if target in others:
            others[target] = of_one_material(first.get(target), others[target])

    inside = () if graph is None else graph.table.names

    def load(
        change: Callable[[Any], Any], parameters: str | Sequence[str], graph: GraphPictures | None = graph
    ) -> list[MitsubaRenderer]:
        renderers = []
        for picture, materials in zip(pictures, all_materials, strict=True):
            asked = picture.request
            changed_ones = materials | {target: change(materials[target])} if target in materials else materials
            renderer = load_mitsuba_renderer(
                picture.folder.root / asked.scene,
                asked.target.shape_id,
                model=fit_of.model,
                parameters=parameters if isinstance(parameters, str) else [n for n in parameters if n not in inside],
                graph=graph,
                materials=changed_ones,
                light_paths=asked.light_paths,
            )
            renderer.table = narrowed(renderer.table, fit_of.bounds)
            renderer.start = renderer.table.clip(renderer.start)
            renderers.append(renderer)
        return renderers

    def task_of(renderers: Sequence[MitsubaRenderer]) -> SheetTask | None:
        if len(renderers) == 1:
            return None
        labels = [picture.label for picture in pictures]
        return one_sheet(renderers, [p.reference for p in pictures], [p.view for p in pictures], labels)

    def fit(
        renderer: Renderer, together: SheetTask | None, *, hand_over: bool = True, nearer_than: float | None = None
    ) -> Fitted:
        heard, shown, display = listener, reference, view
        if together is not None:
            shown, display = together.reference, together.display or view
            heard = partial(_of_first, listener, together.renderer.sheet)
        outcome = recover_material(
            renderer, shown, fit_of, display=display, listener=heard, should_stop=should_stop,
            hand_over=hand_over, noted=any(p.request.left_out for p in pictures), nearer_than=nearer_than,
        )  # fmt: skip
        result = outcome.result if together is None else with_notes(outcome.result, together.notes)
        sheet = None if together is None else together.renderer.sheet
        return Fitted(result, outcome.start_image, outcome.result_image, outcome.counted, sheet)

    def renderer_of(renderers: Sequence[MitsubaRenderer], together: SheetTask | None) -> Renderer:
        return renderers[0] if together is None else together.renderer

    if request.fit.preset == "paper":
        thread = NativeThread(should_stop)
        renderers = thread.call(lambda: load(lambda material: material, fit_of.parameters))
        together = thread.call(lambda: task_of(renderers))
        fitted = fit(InterruptibleRenderer(renderer_of(renderers, together), thread), together)
    else:  # the steps of the other presets are short, and they need Mitsuba's scene on their own thread
        renderers = load(lambda material: material, fit_of.parameters)
        if graph is not None and (refused := graph.refusal()) is not None:
            if not fit_of.parameters:
                raise BadInputError(refused)
            notes = (*notes, f"Values inside nodes stayed as they were. {refused}")
            renderers = load(lambda material: material, fit_of.parameters, None)
        together = task_of(renderers)
        fitted = fit(renderer_of(renderers, together), together)
        table = renderers[0].table
        del renderers, together

        def fit_from(other: MaterialClass) -> Fitted:
            # values inside nodes are those of the material in the scene
            loaded = load(lambda material: changed(material, other), parameters_of(other, table.names), None)
            again = task_of(loaded)
            judgement = fitted.result.judgement
            nearer_than = None if judgement is None else judgement.target.visible
            return fit(renderer_of(loaded, again), again, hand_over=False, nearer_than=nearer_than)

        def is_wanted(found: Fitted) -> bool:
            # no class of material makes up for a wrong light
            agree = found.result.contradiction is None
            return agree and not should_stop() and is_worth_another(found.result, request.fit.parameters)

        if target in first:
            counted = fitted.counted if fitted.sheet is None else fitted.sheet.cut(fitted.counted, 0)
            glow = brightest_glow(reference, view, counted) / request.film_exposure
            classes = other_classes(first[target], glow)
            fitted = with_other_classes(fitted, first[target], classes, fit_from, is_wanted)
            if is_rich(fitted.result, request.fit.parameters) and not should_stop():
                fitted = with_plainer_glow(fitted, first[target], classes, fit_from)
    result = fitted.result
    if request.light_paths is not None and result.model == "mitsuba_principled":
        result = replace(result, notes=(*result.notes, _WITHOUT_LIGHT_PATHS))
    result = replace(result, notes=(*notes, *result.notes, *graph_notes(request, result)), **named(request))
    return JobOutcome(result, fitted.start_image, fitted.result_image, fitted.counted, variant, fitted.sheet)


def with_notes(result: FitResult, notes: Sequence[str]) -> FitResult:
    """The result with further sentences."""
    return replace(result, notes=(*result.notes, *notes)) if notes else result


def _of_first(listener: Listener, sheet: ContactSheet, event: Event) -> None:
    """Tell an event; of a sheet's picture the first of its pictures."""
    listener(Preview(sheet.picture(event.image, 0)) if isinstance(event, Preview) else event)


def of_one_material(first: dict[str, Any] | None, here: dict[str, Any]) -> dict[str, Any]:
    """The target's material of the first picture, with what nodes give it as this one's camera sees it."""
    if first is None:
        return here
    own = {name: socket for name, socket in here["sockets"].items() if socket.get("graph") or socket.get("texture")}
    return first | {"sockets": first["sockets"] | own, "weight": here["weight"], "leaves": here["leaves"]}


def load_everything() -> None:
    """Load what every fit loads, before it is known which one is to come.

    Raises
    ------
    SetupError
        If Mitsuba or LLVM is missing.
    """
    load_native_code()
    from ...render.machine.variant import warm_up

    for module in _OF_EVERY_FIT:
        importlib.import_module(module, __package__)
    warm_up()
