# SPDX-License-Identifier: Apache-2.0
"""The presets for materials whose light passes through them: least squares on traced paths, then FLIP."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...metrics.pixel_check import check_finite
from ...metrics.tone_mapping import DisplayView, View
from ...render.mitsuba_renderer import MitsubaRenderer
from ...types.certainty import Certainty, Level
from ...types.event import Listener, Preview, Started
from ...types.image import Encoding, Image, Pixels
from ...types.parameter import ParameterTable
from ...types.status import Status
from ..certainty.covariance import WEAK_BELOW, certainties
from ..judge.checked_reference import VERIFY_STREAM, check_reference, counted_pixels
from ..judge.picture_errors import picture_errors
from ..judge.picture_judge import PictureJudge
from ..judge.verification import Verification
from ..paper.fit import FitOutcome
from ..recorded.fit import clipped_pixels, linear_pixels
from ..recorded.keep_user_values import VISIBLE, kept_note
from ..result.course import Course
from ..result.outcome import SQUARES_KEPT, final_result
from ..settings import FitSettings
from ..squares.stage_residuals import finishing_residuals
from ..transmission_plan import TransmissionPlan
from .linear_pictures import LinearPictures
from .perceptual_stages import FLIP, lower_seen_error
from .polished import CORE, Polished
from .stages import TransmissionFit

if TYPE_CHECKING:  # the module needs Mitsuba's variant to be set
    from ...render.traced_paths import TracedPaths

STAGES = ("scan", "race", "polish")
_PREVIEW_PATHS, _PREVIEW_SPP = 1 << 15, 2  # a quarter of a launch, whatever the size of the picture
Vector = NDArray[np.float64]


def fit_transmission(
    renderer: MitsubaRenderer,
    reference: Image,
    settings: FitSettings,
    *,
    display: View | None = None,
    listener: Listener,
    should_stop: Callable[[], bool],
    plan: TransmissionPlan = TransmissionPlan(),  # noqa: B008  frozen
) -> FitOutcome:
    """Recover the renderer's parameters from a picture of the same scene by whole light paths.

    Parameters and errors are those of `fit_material`. Ends of the stages are compared on paths no stage has seen, and
    the best of them with the scene's own values on path-traced pictures under yet another seed, by mean FLIP.

    Raises
    ------
    BadInputError
        As `fit_material`.
    UnrecordableError
        If the model has no traced version.
    """
    from ...render.traced_paths import TracedPaths

    began = time.monotonic()
    mask = renderer.target_mask()
    check_reference(reference, mask)
    check_finite(reference.pixels, "The reference")
    ldr = reference.encoding is Encoding.SRGB or settings.range == "ldr"
    scene_view = DisplayView.for_scene(reference.pixels, mask) if reference.encoding is Encoding.LINEAR else None
    view = scene_view or display or DisplayView()
    paths = TracedPaths(renderer)
    light, clipped = linear_pixels(reference, view), clipped_pixels(reference, view)
    seen_residuals = finishing_residuals(settings, reference.encoding, light, mask, view)
    stages = (*STAGES, *seen_residuals, *([FLIP] if settings.preset == "best" else []))
    listener(Started(stages=stages, parameters=renderer.table.names, seconds=time.monotonic() - began))
    course = Course(renderer, stages, listener, should_stop, began)
    course.picture = lambda x: _preview(paths, x, mask.shape, settings.seed ^ VERIFY_STREAM)
    fit = TransmissionFit(paths, renderer.start, light, mask, plan, settings.seed, course, clipped)

    certainty: dict[str, Certainty] = {}
    ends: list[Polished] = []
    notes: list[str] = []
    freest = 0
    nodes = fit.scan()
    found = [fit.race(nodes) if not should_stop() else nodes[0][1]]
    if not should_stop():
        ends = fit.polish(found[0])
        candidates = [end.x for end in reversed(ends)] + found
        chosen = fit.choose(candidates)
        raced = chosen == len(ends)
        found = [candidates[chosen]]
        ends = ends if raced else ends[: len(ends) - chosen]
        freest = int(np.argmin([end.kept.sum() for end in ends]))
        if raced or (chosen == 0 and freest < len(ends) - 1):
            # by the noisy squares values may go back to the user's, and a race look better, where no eye agrees
            found.append(ends[freest].x)
        if raced:
            ends = ends[: freest + 1]
    name = "flip-ldr" if ldr else "flip-hdr"
    judge, nearer = None, []
    if seen_residuals and ends and not should_stop():
        linear = LinearPictures(fit.pictures, settings.seed)
        if linear.are_worth_it(found[0], reference, view):
            blurred = reference.encoding is Encoding.LINEAR
            judge = PictureJudge(name, reference, light, mask, settings, view, blurred=blurred)
            end = lower_seen_error(linear, judge, seen_residuals, found[0], ends[-1].kept, course, flip=FLIP in stages)
            nearer = [] if np.array_equal(end, found[0]) else [end]
    stopped = should_stop()
    counted = counted_pixels(mask, settings)
    verification = Verification(
        renderer, reference, counted, view, seed=settings.seed, most=settings.verify_spp, should_stop=should_stop
    )
    pictures = verification.pictures(verification.begin(renderer.start), [*found, *nearer])
    plain = PictureJudge(name, reference, pictures[0].image, mask, settings, view, blurred=False)
    seen = [plain.value(picture.image) for picture in pictures]
    kept = len(found) == 2 and seen[1] <= seen[2] + VISIBLE
    best = 1 if kept else len(found)
    if judge and nearer and best == 1 and judge.value(pictures[-1].image) < judge.value(pictures[1].image):
        best = len(pictures) - 1
    best = best if seen[best] < seen[0] else 0
    pictures[best] = end = verification.finished(pictures[best])
    listener(Preview(end.image))
    if nearer and best == 1:
        notes.append(SQUARES_KEPT.format(stage="polish"))
    if ends:
        shown = ends if kept or len(found) == 1 else ends[: freest + 1]
        certainty = _certainty(shown, renderer.table)
        back = [name for name in certainty if shown[-1].kept[renderer.table.slice_of(name)].all()]
        unseen = [name for name in back if certainty[name].level is Level.NOT_VISIBLE]
        notes += [kept_note(unseen)] if unseen and best else []
    counts = fit.pictures.counts
    if counts is not None:
        notes.append(
            f"The picture is as noisy as one of {counts.count} samples a pixel: compressed pixels of as many "
            "samples were compared, so that no firefly decides."
        )
    status = Status.CANCELLED if stopped or should_stop() else Status.CONVERGED
    result = final_result(
        renderer,
        pictures,
        best,
        status=status,
        stages=course.reports,
        errors=picture_errors(reference, pictures[0].image, end.image, mask, counted, display),
        began=began,
        certainty=certainty,
        notes=notes,
    )
    return FitOutcome(result, pictures[0].image, end.image, counted, end.halves)


def _preview(paths: TracedPaths, x: Vector, shape: tuple[int, ...], seed: int) -> Pixels:
    """A coarse picture: few paths of one pixel in each block, so that its cost does not grow with the picture."""
    height, width = shape
    block = math.ceil(math.sqrt(height * width * _PREVIEW_SPP / _PREVIEW_PATHS))
    rows, columns = (np.arange(min(block // 2, n - 1), n, block) for n in shape)
    pixels = (rows[:, None] * width + columns).ravel()
    passes = paths.renderer.passes
    seen = paths.images(x[None], pixels, seed=seed, samples=_PREVIEW_SPP, jacobian=False)[0, :, :, 0]
    paths.renderer.passes = passes  # no part of the fit
    coarse = seen.reshape(len(rows), len(columns), 3)
    filled = np.repeat(np.repeat(coarse, block, axis=0), block, axis=1)
    short = ((0, max(0, height - len(filled))), (0, max(0, width - filled.shape[1])), (0, 0))
    return np.pad(filled, short, mode="edge")[:height, :width]


def _certainty(ends: list[Polished], table: ParameterTable) -> dict[str, Certainty]:
    """How sure each value is, given those that went back to the user's; these are as unsure as when they were free.

    A value of the glass itself that the picture does not determine is hardly the user's, so given it nothing is surer.
    """
    variance = np.zeros(table.length)
    doubted = np.any(ends[-1].kept & table.mask_of(CORE))
    for end in ends:
        found = np.maximum(variance, np.diag(end.covariance)) if doubted else np.diag(end.covariance)
        variance = np.where(end.kept, variance, found)
    least = np.where(ends[-1].unseen, WEAK_BELOW * (table.upper - table.lower), 0.0)
    return certainties(np.maximum(np.sqrt(variance), least), table)
