# SPDX-License-Identifier: Apache-2.0
"""The fit that a job runs: the request's scene in Mitsuba against its reference."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.tone_mapping import View
from ...render.models.graph_pictures import GraphPictures
from ...render.sheet.contact_sheet import ContactSheet
from ...types.errors import BadInputError
from ...types.event import Event, Listener, Preview
from ...types.image import Image, Pixels
from ...types.parameter_bounds import narrowed
from ...types.result import FitResult
from ..folder.graph_files import locate_files
from ..folder.job_folder import JobFolder
from ..folder.request import Request, request_to_json
from .class_trials import Fitted, with_other_classes, with_plainer_glow
from .graph_blender import evaluated_graph
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
_GRAPH_AVERAGES = (
    "The model 'mitsuba_principled' takes the averages of what nodes give ({names}), and leaves their normals out."
)
_GRAPH_UNSEEN = (
    "What nodes give ({names}) is known where a ray of the camera meets the target, behind each other up to {depths} "
    "times: what other things hide has the averages."
)
_GRAPH_FLAT = "The fit on whole light paths leaves out the normals that nodes give; pictures and errors have them."


@dataclass(frozen=True)
class SeenPicture:
    """What a fit has made of one picture: scene-linear at start and end, and which pixels count."""

    start: Pixels
    result: Pixels
    counted: NDArray[np.bool_]


@dataclass(frozen=True)
class JobOutcome:
    """The result of a fit, its pictures at start and end (scene-linear) and the Mitsuba variant that made them.

    Errors are those of the `counted` pixels, True (height, width). With a `sheet` all of them are over that.
    """

    result: FitResult
    start_image: Pixels
    result_image: Pixels
    counted: NDArray[np.bool_]
    variant: str = ""
    sheet: ContactSheet | None = None

    @property
    def seen(self) -> tuple[SeenPicture, ...]:
        """What the fit has made of each of its pictures."""
        sheet = self.sheet
        if sheet is None:
            return (SeenPicture(self.start_image, self.result_image, self.counted),)
        return tuple(
            SeenPicture(
                sheet.picture(self.start_image, n), sheet.picture(self.result_image, n), sheet.cut(self.counted, n)
            )
            for n in range(len(sheet))
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

    def fit(renderer: Renderer, together: SheetTask | None, *, hand_over: bool = True) -> Fitted:
        heard, shown, display = listener, reference, view
        if together is not None:
            shown, display = together.reference, together.display or view
            heard = partial(_of_first, listener, together.renderer.sheet)
        outcome = recover_material(
            renderer, shown, fit_of, display=display, listener=heard, should_stop=should_stop,
            hand_over=hand_over, noted=any(p.request.left_out for p in pictures),
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
            return fit(renderer_of(loaded, again), again, hand_over=False)

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
    result = replace(result, notes=(*notes, *result.notes, *_graph_notes(request, result)), **_named(request))
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


def _named(request: Request) -> dict[str, Any]:
    """What the fitted shader and its values are called, where they are not those of a plain Principled BSDF."""
    material = request.materials.get(request.target.bsdf_id)
    if material is None or not (request.target.labels or material.leaves):
        return {}
    return {"shader": "/".join(request.target.node), "labels": dict(request.target.labels)}


def _graph_notes(request: Request, result: FitResult) -> tuple[str, ...]:
    """What is not held of the values that nodes give the target, in sentences."""
    material = request.materials.get(request.target.bsdf_id)
    held = [name for name, socket in material.all_sockets if socket.graph] if material is not None else []
    if not held:
        return ()
    names = ", ".join(held)
    if result.model == "mitsuba_principled":
        return (_GRAPH_AVERAGES.format(names=names),)
    if not any("whole light paths" in note for note in result.notes):
        return ()
    flat = (_GRAPH_FLAT,) if {"Normal", "Coat Normal", "Tangent"} & set(held) else ()
    return (_GRAPH_UNSEEN.format(names=names, depths=1 if request.graph is None else request.graph.depths), *flat)


def request_materials(folder: JobFolder, request: Request) -> dict[str, dict[str, Any]]:
    """The request's materials with textures by absolute path, the Blender version and the film's exposure."""
    materials = request_to_json(request)["materials"]
    for material in materials.values():
        material["blender_version"] = tuple(request.generator.get("blender", (5, 0)))
        material["film_exposure"] = request.film_exposure
        for leaf in (material, *material["leaves"]):
            for name, socket in (*leaf["sockets"].items(), ("weight", leaf["weight"])):
                locate_files(folder, request.graph, name, socket)
    return materials
