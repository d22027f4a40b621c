# SPDX-License-Identifier: Apache-2.0
"""The presets `fast`, `balanced` and `best`: a global start and bounded least squares on recorded light paths."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from ...metrics.baked_view import HALF_LEVEL, BakedView
from ...metrics.pixel_check import check_finite
from ...metrics.tone_mapping import DisplayView, View
from ...render.mitsuba_renderer import MitsubaRenderer
from ...types.event import Listener, Preview, Started
from ...types.image import Encoding, Image, Pixels
from ...types.status import Status
from ..alike.unneeded_lobes import box_holding
from ..certainty.weak_combinations import weak_combinations
from ..judge.checked_reference import check_reference, counted_pixels
from ..judge.picture_errors import picture_errors
from ..judge.picture_judge import NOISY, PictureJudge
from ..judge.verification import FIRST_SAMPLES, FIRST_SAMPLES_EXACT, Verification
from ..paper.fit import FitOutcome
from ..recorded_plan import RecordedPlan
from ..result.course import Course
from ..result.outcome import SQUARES_KEPT, final_result
from ..settings import FitSettings
from ..squares.displayed_residual import DisplayedResidual
from ..squares.problem import End, Problem
from ..squares.residuals import CensoredResidual, RelativeResidual, WeightedResidual, log_residual
from ..squares.stage_residuals import finishing_residuals
from .keep_user_values import keep_values
from .perceptual_stages import perceptual_ends
from .stages import MakeResidual, MakeWeighted, RecordedFit

STAGES = ("scan", "start", "refine")
# Root mean square residual, in standard deviations of the noise, from which on there is more than noise to explain
AT_NOISE = 1.5


def fit_recorded(
    renderer: MitsubaRenderer,
    reference: Image,
    settings: FitSettings,
    *,
    display: View | None = None,
    listener: Listener,
    should_stop: Callable[[], bool],
    plan: RecordedPlan | None = None,
) -> FitOutcome:
    """Recover the renderer's parameters from a picture of the same scene, with no use of their start but as one guess.

    Parameters and errors are those of `fit_material`; `plan` is that of the preset, unless it is given. The result is
    the best of the scene's own values and the end of every finishing stage, judged on path-traced pictures under random
    numbers no stage has seen: by the least-squares residual of tiles for `fast` and where the picture's noise is
    reached, by the last of the losses where the settings name them, else by FLIP (`fit.picture_judge`).

    Raises
    ------
    BadInputError
        As `fit_material`.
    UnrecordableError
        For materials that recorded paths cannot hold: textures, transmission.
    """
    from ...render.recorded_scene import RecordedScene

    began = time.monotonic()
    mask = renderer.target_mask()
    check_reference(reference, mask)
    check_finite(reference.pixels, "The reference")
    ldr = reference.encoding is Encoding.SRGB or settings.range == "ldr"
    view = (
        (display or DisplayView())
        if reference.encoding is Encoding.SRGB
        else DisplayView.for_scene(reference.pixels, mask)
    )
    named = None if settings.losses is None else settings.stage_names(reference.encoding)
    measure = named[-1] if named else "flip-ldr" if ldr else "flip-hdr"
    light = linear_pixels(reference, view)
    scene = RecordedScene(renderer, int(mask.sum()))  # refuses glass, so it comes first
    # the start's picture is rendered while the kernels of the fit are compiled
    counted = counted_pixels(mask, settings)
    verification = Verification(
        renderer,
        reference,
        counted,
        view,
        seed=settings.seed,
        first=FIRST_SAMPLES_EXACT if scene.lights_exact else FIRST_SAMPLES,
        most=settings.verify_spp,
        should_stop=should_stop,
    )
    start = verification.begin(renderer.start)
    finishing = finishing_residuals(settings, reference.encoding, light, mask, view)
    names = (*STAGES, *finishing, *(["flip"] if settings.preset == "best" else []))
    listener(Started(stages=names, parameters=renderer.table.names, seconds=time.monotonic() - began))
    course = Course(renderer, names, listener, should_stop, began)
    plan = plan or RecordedPlan.of(settings.preset)
    fit = RecordedFit(scene, light, mask, plan, settings.seed, course, clipped_pixels(reference, view))

    basins = fit.start_from_nothing(_censored(log_residual, reference, view))
    ends = [End("start", renderer.start)]
    kept = None
    notes = list(scene.needs.notes)
    counts: Callable[[Pixels], float] | None = None  # what the result is chosen by
    if should_stop():
        ends.append(End("start", basins[0].x))
    else:
        make = RelativeResidual if scene.needs.sampled else log_residual
        first, *others = (basin.x for basin in basins)
        refined = fit.refine(first, _censored(make, reference, view), _weighted(reference, view), others)
        weighted = scene.needs.sampled and not isinstance(view, BakedView)
        seen = None if weighted else PictureJudge(measure, reference, light, mask, settings, view, blurred=False).value
        kept = keep_values(fit, refined, weighted=weighted, seen=seen)
        fit.box = box_holding(fit.table, renderer.start, kept.held)
        ends.append(End("refine", kept.x))
        notes += kept.notes
        linear = reference.encoding is Encoding.LINEAR
        optional = finishing and settings.losses is None and linear
        # under lights with extent residuals are in deviations of the noise
        left = np.inf if scene.needs.sampled else float(np.sqrt(2.0 * refined.all.equations(kept.x).cost))
        nothing_left = optional and left < plan.seen_rms
        at_noise = optional and not nothing_left and fit.misfit(kept.x) < AT_NOISE
        noise = fit.noise.level if fit.noise else 0.0
        if nothing_left:
            notes.append(
                f"What is left of the picture ({100 * left:.1g} %) nobody sees: perceptual stages were left out."
            )
        elif at_noise:
            notes.append(
                f"The fit has reached the noise of the picture and of its own rays ({100 * noise:.2g} % a pixel): "
                "perceptual stages would fit that noise and were left out."
            )
        elif finishing:
            blurred = linear and settings.losses is None and (scene.needs.sampled or noise > NOISY)
            judge = PictureJudge(measure, reference, light, mask, settings, view, blurred=blurred)
            counts = judge.value
            tried = others if settings.preset == "best" else []
            ends += perceptual_ends(fit, refined.all, kept.x, tried, finishing, judge, settings, notes)
        if fit.fireflies:
            notes.append(f"{fit.fireflies} fireflies in the reference were left out of the search for a start.")
        if scene.needs.sampled and fit.recordings > 1:
            notes.append(f"The light was recorded {fit.recordings} times: the solution had moved away from the first.")
        if counts is None:
            counts = _misfit(fit, refined.all, _censored(log_residual, reference, view))

    pictures = verification.pictures(start, [end.x for end in ends[1:]])
    listener(Preview(pictures[-1].image))
    counts = counts or PictureJudge(measure, reference, light, mask, settings, view, blurred=False).value
    best = best_of([counts(p.image) if np.isfinite(p.image).all() else np.inf for p in pictures])
    pictures[best] = end = verification.finished(pictures[best])
    status = Status.CANCELLED if should_stop() else Status.CONVERGED
    if best == 1 and len(ends) > 2:
        notes.append(SQUARES_KEPT.format(stage="refine"))
    result = final_result(
        renderer,
        pictures,
        best,
        status=status,
        stages=course.reports,
        errors=picture_errors(reference, pictures[0].image, end.image, mask, counted, display),
        began=began,
        certainty=kept.certainty if kept else {},
        notes=notes,
        weak_combinations=weak_combinations(kept.spread, fit.table, kept.certainty, kept.held) if kept else (),
    )
    return FitOutcome(result, pictures[0].image, end.image, counted, end.halves)


def best_of(errors: Sequence[float]) -> int:
    """The number of the smallest error; one that is not finite never wins, and without any the start stays."""
    values = [error if np.isfinite(error) else np.inf for error in errors]
    return int(np.argmin(values))


def linear_pixels(reference: Image, view: View) -> Pixels:
    """Scene-linear values of a reference; those above a display's white are lost."""
    if reference.encoding is Encoding.LINEAR:
        return np.maximum(reference.pixels, 0.0)
    assert isinstance(view, DisplayView | BakedView)
    return view.linear(reference.pixels)


def clipped_pixels(reference: Image, view: View) -> Pixels | None:
    """1 where only a lower bound of the radiance is known, else 0; None for a linear reference."""
    if reference.encoding is Encoding.LINEAR:
        return None
    top = view.top if isinstance(view, BakedView) else 1 - HALF_LEVEL
    return (reference.pixels >= top).astype(np.float32)


def _censored(make: MakeResidual, reference: Image, view: View) -> MakeResidual:
    """Residuals that expect no more of clipped pixels than a display shows."""
    if reference.encoding is Encoding.LINEAR:
        return make
    if isinstance(view, BakedView):
        return lambda target: DisplayedResidual(view, target)
    assert isinstance(view, DisplayView)
    limit = 2.0**-view.exposure_ev
    return lambda target: CensoredResidual(make(target), target, limit)


def _weighted(reference: Image, view: View) -> MakeWeighted | None:
    """Residuals in standard deviations of the noise; None for a view that is no formula."""
    if isinstance(view, BakedView):
        return None
    return lambda target, weight: _censored(lambda t: WeightedResidual(t, weight), reference, view)(target)


def _misfit(fit: RecordedFit, problem: Problem, compressed: MakeResidual) -> Callable[[Pixels], float]:
    """The least-squares measure of a path-traced picture: of the last problem where it knows the noise, else in log."""
    residual, groups = problem.residual, problem.groups
    if not fit.scene.needs.sampled:
        groups = fit.paths.tile_groups()
        residual = compressed(groups.average(fit.reference))
    return lambda image: float(np.sqrt(np.mean(residual(groups.average(image))[0] ** 2)))
