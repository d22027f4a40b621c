# SPDX-License-Identifier: Apache-2.0
"""The fit that a job runs: the request's scene in Mitsuba against its reference."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ...metrics.display.tone_mapping import View
from ...render.models.graph_pictures import GraphPictures
from ...types.event import Listener
from ...types.image import Image
from ...types.parameter_bounds import narrowed
from ...types.result import FitResult
from ..folder.job_folder import JobFolder
from ..folder.request import Request
from .as_in_scene import as_in_scene
from .class_trials import Fitted, with_other_classes, with_plainer, with_plainer_glow
from .fit_materials import fit_materials
from .graph_blender import HELD, evaluated_graphs, refusal_of
from .job_outcome import JobOutcome
from .job_scene import load_native_code, material_notes, named, of_one_material, request_materials
from .material_classes import (
    MaterialClass,
    brightest_glow,
    changed,
    is_rich,
    is_worth_another,
    new_layers,
    other_classes,
    parameters_of,
    values_of_classes,
    without_layers,
)
from .more_pictures import JobPicture, told_of_first

if TYPE_CHECKING:
    from ...fit.pictures.one_sheet import SheetTask
    from ...render.pictures.mitsuba_renderer import MitsubaRenderer
    from ...render.pictures.renderer import Renderer

# imported where they are needed, as `mfo --help` needs none of them
_OF_EVERY_FIT = (
    *("...fit.recover_material", "...render.pictures.renderer"),
    *("...fit.pictures.one_sheet", "...render.pictures.pixel_pictures", "...render.transport.direct_light"),
    *("...render.paths.recorded_scene", "...render.traced.traced_paths"),
    *("...render.lamps.lamp_plugins", "...render.lamps.changed_light"),
    "...material.plugins.projective_texture",
    *("...material.plugins.mapped_normal", "...material.plugins.by_ray", "...render.camera.seen_through"),
    *("scipy.ndimage", "scipy.optimize", "PIL.Image", "PIL.ImageDraw", "PIL.ImageFont", "OpenEXR"),
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
    pictures = (JobPicture(folder, request, reference, view), *more)
    if request.targets:
        return fit_materials(pictures, blender=blender, listener=listener, should_stop=should_stop)
    with evaluated_graphs(pictures, blender) as (inside,):
        variant, notes, tried = load_native_code(), inside.notes, frozenset[str]()
        job = _OneMaterial(pictures, _materials_of(pictures), inside.graphs, listener, should_stop)
        if request.fit.preset == "paper":
            fitted = job.fit_on_own_thread()
        else:
            fitted, said = _fit_and_other_classes(job)
            notes, tried = (*notes, *said), values_of_classes(job.start)
    result = as_in_scene(request, fitted.result)
    if request.light_paths is not None and result.model == "mitsuba_principled":
        result = with_notes(result, (_WITHOUT_LIGHT_PATHS,))
    result = replace(result, notes=(*notes, *result.notes, *material_notes(request, result, tried)), **named(request))
    return JobOutcome(result, fitted.start_image, fitted.result_image, fitted.counted, variant, fitted.sheet)


def _materials_of(pictures: Sequence[JobPicture]) -> tuple[dict[str, dict[str, Any]], ...]:
    """The materials of each picture's scene; the target's is the first picture's."""
    target = pictures[0].request.target.bsdf_id
    first, *others = (request_materials(picture.folder, picture.request) for picture in pictures)
    own = ({target: of_one_material(first.get(target), here[target])} if target in here else {} for here in others)
    return (first, *(here | target_there for here, target_there in zip(others, own, strict=True)))


@dataclass(frozen=True)
class _OneMaterial:
    """The fit of one material to all pictures of a job, which may begin from several starts.

    `materials` are those of each picture's scene, and `graphs` the values inside nodes as each picture shows them, none
    where these are not fitted. The steps of presets other than `paper` are short, and need Mitsuba's
    scene on their own thread.
    """

    pictures: Sequence[JobPicture]
    materials: Sequence[dict[str, dict[str, Any]]]
    graphs: tuple[GraphPictures, ...]
    listener: Listener
    should_stop: Callable[[], bool]

    @property
    def request(self) -> Request:
        """What the first picture's job asks for."""
        return self.pictures[0].request

    @property
    def start(self) -> dict[str, Any] | None:
        """The target's material in the first picture's scene."""
        return self.materials[0].get(self.request.target.bsdf_id)

    def load(
        self,
        parameters: str | Sequence[str],
        graphs: Sequence[GraphPictures],
        change: Callable[[Any], Any] = lambda material: material,
    ) -> list[MitsubaRenderer]:
        """A renderer of each picture, with the target's material changed."""
        from ...render.pictures.mitsuba_renderer import load_mitsuba_renderer

        inside = self.graphs[0].table.names if self.graphs else ()
        target, renderers = self.request.target.bsdf_id, []
        of_each = graphs or [None] * len(self.pictures)
        for picture, materials, graph in zip(self.pictures, self.materials, of_each, strict=True):
            asked = picture.request
            renderer = load_mitsuba_renderer(
                picture.folder.root / asked.scene,
                asked.target.shape_id,
                model=self.request.fit.model,
                parameters=parameters if isinstance(parameters, str) else [n for n in parameters if n not in inside],
                graph=graph,
                materials=materials | ({target: change(materials[target])} if target in materials else {}),
                light_paths=asked.light_paths,
            )
            renderer.table = narrowed(renderer.table, self.request.fit.bounds)
            renderer.start = renderer.table.clip(renderer.start)
            renderers.append(renderer)
        return renderers

    def together(self, renderers: Sequence[MitsubaRenderer]) -> SheetTask | None:
        """All pictures as one; None of a single one."""
        from ...fit.pictures.one_sheet import one_sheet

        if len(renderers) == 1:
            return None
        of = self.pictures
        each = [[renderer] for renderer in renderers]
        return one_sheet(each, [p.reference for p in of], [p.view for p in of], [p.label for p in of])

    def fit(self, renderers: Sequence[MitsubaRenderer], *, nearer_than: float | None = None) -> Fitted:
        """The fit from the renderers' material; one that has to come `nearer_than` another is no hand-over to `paper`.

        Raises
        ------
        NoNearerError
            If it does not.
        """
        together = self.together(renderers)
        return self._fit(renderers[0] if together is None else together.renderer, together, nearer_than)

    def fit_on_own_thread(self) -> Fitted:
        """The same, stopped within one of its long steps."""
        from ...render.pictures.interruptible import InterruptibleRenderer, NativeThread

        thread = NativeThread(self.should_stop)
        renderers = thread.call(lambda: self.load(self.request.fit.parameters, self.graphs))
        together = thread.call(lambda: self.together(renderers))
        renderer = renderers[0] if together is None else together.renderer
        return self._fit(InterruptibleRenderer(renderer, thread), together, None)

    def _fit(self, renderer: Renderer, together: SheetTask | None, nearer_than: float | None) -> Fitted:
        from ...fit.recover_material import recover_material

        heard, shown, display = self.listener, self.pictures[0].reference, self.pictures[0].view
        if together is not None:
            shown, display = together.reference, together.display or display
            heard = partial(told_of_first, heard, together.renderer.sheet)
        outcome = recover_material(
            renderer, shown, self.request.fit, display=display, listener=heard, should_stop=self.should_stop,
            hand_over=nearer_than is None, noted=any(p.request.left_out for p in self.pictures),
            nearer_than=nearer_than, candidates=self.request.candidates,
        )  # fmt: skip
        result = outcome.result if together is None else with_notes(outcome.result, together.notes)
        sheet = None if together is None else together.renderer.sheet
        return Fitted(result, outcome.start_image, outcome.result_image, outcome.counted, sheet)


def _fit_and_other_classes(job: _OneMaterial) -> tuple[Fitted, tuple[str, ...]]:
    """The fit from the scene's material, or a better one from another class of material; and what else is to be said.

    Raises
    ------
    BadInputError
        If values inside nodes are all that is to be fitted, and Blender refuses them.
    """
    request, notes = job.request, ()
    renderers = job.load(request.fit.parameters, job.graphs)
    if (refused := refusal_of(job.graphs, request.fit.parameters)) is not None:
        notes = (HELD.format(why=refused),)
        renderers = job.load(request.fit.parameters, ())
    fitted, names = job.fit(renderers), renderers[0].table.names
    own = fitted.result.recovered
    del renderers  # their scenes are large
    if job.start is None:
        return fitted, notes
    before = fitted.result.judgement
    visible = np.inf if before is None else before.target.visible

    def fit_from(other: MaterialClass, nearer_than: float) -> Fitted:
        graphs = job.graphs if other.further and refused is None else ()
        again = job.load(parameters_of(other, names), graphs, lambda material: changed(material, other))
        return job.fit(again, nearer_than=nearer_than)

    def is_wanted(found: Fitted) -> bool:
        # pictures that contradict each other count, too: those of glass do so beside an opaque material
        return not job.should_stop() and is_worth_another(found.result, request.fit.parameters)

    first = job.pictures[0]
    counted = fitted.counted if fitted.sheet is None else fitted.sheet.cut(fitted.counted, 0)
    glow = brightest_glow(first.reference, first.view, counted) / request.film_exposure
    classes = other_classes(job.start, glow)
    nearer = partial(fit_from, nearer_than=visible)
    fitted = with_other_classes(fitted, job.start, classes, nearer, is_wanted)
    if is_rich(fitted.result, request.fit.parameters) and not job.should_stop():
        any_distance = partial(fit_from, nearer_than=np.inf)  # what is plainer need not be nearer
        fitted = with_plainer_glow(fitted, job.start, classes, any_distance)
    layers = new_layers(fitted.result, request.fit.parameters)
    if layers and fitted.result.recovered is own and not job.should_stop():
        plain = without_layers(names, layers)
        fitted = with_plainer(fitted, job.start, lambda: job.fit(job.load(plain, ()), nearer_than=np.inf))
    return fitted, notes


def with_notes(result: FitResult, notes: Sequence[str]) -> FitResult:
    """The result with further sentences."""
    return replace(result, notes=(*result.notes, *notes)) if notes else result


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
