# SPDX-License-Identifier: Apache-2.0
"""The presets `fast` and `balanced`: a global start and bounded least squares on recorded light paths."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..metrics.baked_view import HALF_LEVEL, BakedView
from ..metrics.pixel_check import check_finite
from ..metrics.tone_mapping import DisplayView, View
from ..render.mitsuba_renderer import MitsubaRenderer
from ..types.certainty import Certainty, Level
from ..types.event import Listener, Preview, Started
from ..types.image import Encoding, Image, Pixels
from ..types.result import FitResult
from ..types.status import Status
from .course import Course
from .displayed_residual import DisplayedResidual
from .finishing import finishing_residuals
from .fit_material import FitOutcome
from .recorded_stages import MakeResidual, Problem, RecordedFit, RecordedPlan, Vector
from .residuals import CensoredResidual, RelativeResidual, log_residual, residual_rows
from .settings import FitSettings
from .stages import Candidate
from .uncertainty import certainties, standard_deviations
from .verification import VERIFY_STREAM, check_reference, picture_errors, stage_losses

STAGES = ("scan", "start", "refine")
CANCELLED_SPP = 4  # a cancelled fit shows its pictures at once
# Values the picture does not determine go back to the user's if that costs no more than this share of the residual
KEEP_TOLERANCE = 1.01


def fit_recorded(
    renderer: MitsubaRenderer,
    reference: Image,
    settings: FitSettings,
    *,
    display: View | None = None,
    listener: Listener,
    should_stop: Callable[[], bool],
    plan: RecordedPlan = RecordedPlan(),  # noqa: B008  frozen
) -> FitOutcome:
    """Recover the renderer's parameters from a picture of the same scene, with no use of their start but as one guess.

    Parameters and errors are those of `fit_material`. The result is the best of the scene's own values and the end of
    every finishing stage, judged on path-traced pictures under random numbers no stage has seen: by the log difference
    of tiles for `fast`, by true FLIP for `balanced`, by the last of the losses where the settings name them.

    Raises
    ------
    BadInputError
        As `fit_material`.
    UnrecordableError
        For materials that recorded paths cannot hold: textures, transmission.
    """
    from ..render.recorded_scene import RecordedScene

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
    light = linear_pixels(reference, view)
    scene = RecordedScene(renderer, int(mask.sum()))
    finishing = finishing_residuals(settings, reference.encoding, light, mask, view)
    names = (*STAGES, *finishing)
    listener(Started(stages=names, parameters=renderer.table.names, seconds=time.monotonic() - began))
    course = Course(renderer, names, listener, should_stop, began)
    clipped = clipped_pixels(reference, view)
    fit = RecordedFit(scene, light, mask, plan, settings.seed, course, clipped)

    compressed = _censored(log_residual, reference, view)
    found = fit.start_from_nothing(compressed).x
    candidates: list[Vector] = [renderer.start]
    certainty: dict[str, Certainty] = {}
    notes = list(scene.needs.notes)
    if not should_stop():
        make = RelativeResidual if scene.needs.sampled else log_residual
        solution, last = fit.refine(found, _censored(make, reference, view))
        found, certainty = _keep_unseen(fit, last, solution.x, notes)
        candidates.append(found)
        for name, finish in finishing.items():
            # named losses are a ladder, each from the one before; the preset's own are alternatives
            begin = found if settings.losses is None else candidates[-1]
            candidates.append(fit.polish(name, last.groups, finish, begin).x)
    else:
        candidates.append(found)

    seed = settings.seed ^ VERIFY_STREAM
    spp = min(CANCELLED_SPP, settings.verify_spp) if should_stop() else settings.verify_spp
    pictures = [Candidate(x, renderer.image(x, seed=seed, spp=spp)) for x in candidates]
    listener(Preview(pictures[-1].image))
    best = int(np.argmin(_judge(pictures, fit, reference, mask, settings, view, bool(finishing), ldr, compressed)))
    status = Status.CANCELLED if should_stop() else Status.CONVERGED
    message = status.sentence
    if best == 0:
        message += " Nothing was better than the start, so the start was kept."
    result = FitResult(
        status=status,
        message=message,
        model=renderer.model,
        initial=renderer.table.unpack(renderer.start),
        recovered=renderer.table.unpack(candidates[best]),
        bounds={p.name: (p.lower, p.upper) for p in renderer.table},
        stages=tuple(course.reports),
        errors=picture_errors(reference, pictures[0].image, pictures[best].image, mask, display),
        seconds=time.monotonic() - began,
        passes=renderer.passes,
        certainty=certainty,
        notes=tuple(notes),
    )
    return FitOutcome(result, pictures[0].image, pictures[best].image)


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


def _keep_unseen(
    fit: RecordedFit, problem: Problem, found: Vector, notes: list[str]
) -> tuple[Vector, dict[str, Certainty]]:
    """Give values that the picture does not determine back to the user, if the rest can make up for it."""
    table, user = fit.table, fit.scene.renderer.start

    def judge(x: Vector) -> tuple[float, dict[str, Certainty]]:
        image = problem.evaluate(x)
        rows = residual_rows(image, problem.residual)
        relative = residual_rows(image, RelativeResidual(problem.groups.average(fit.reference)))
        sd = standard_deviations(relative[:, :, 1:], relative[:, :, 0], table)
        return float(np.mean(rows[:, :, 0] ** 2)), certainties(sd, table)

    cost, certainty = judge(found)
    unseen = [name for name, c in certainty.items() if c.level is Level.NOT_VISIBLE]
    if not unseen or len(unseen) == len(table):
        return found, certainty
    kept = found.copy()
    lower, upper = table.lower, table.upper
    for name in unseen:
        part = table.slice_of(name)
        kept[part] = lower[part] = upper[part] = user[part]
    kept = fit.solve_within(problem, kept, lower, upper)
    if judge(kept)[0] > KEEP_TOLERANCE * cost + 1e-8:
        return found, certainty
    notes.append(f"The picture does not determine {', '.join(unseen)}: kept as in the scene.")
    return kept, certainty


def _judge(
    pictures: Sequence[Candidate],
    fit: RecordedFit,
    reference: Image,
    mask: NDArray[np.bool_],
    settings: FitSettings,
    view: View,
    perceptual: bool,
    ldr: bool,
    compressed: MakeResidual,
) -> list[float]:
    """An error for each picture."""
    if perceptual:
        names = None if settings.losses is None else settings.stage_names(reference.encoding)
        name = names[-1] if names else "flip-ldr" if ldr else "flip-hdr"
        loss = stage_losses([name], reference, pictures[0].image, mask, settings, view)[0]
        return [loss.value(picture.image) for picture in pictures]
    groups = fit.paths.tile_groups()
    residual = compressed(groups.average(fit.reference))
    return [float(np.sqrt(np.mean(residual(groups.average(p.image))[0] ** 2))) for p in pictures]
