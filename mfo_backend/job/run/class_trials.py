# SPDX-License-Identifier: Apache-2.0
"""Fits that begin again from other classes of material, and which of them is the result."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...render.sheet.contact_sheet import ContactSheet
from ...types.errors import NoNearerError, UnrecordableError
from ...types.image import Pixels
from ...types.result import FitResult
from ...types.status import Status
from ...types.verdict import Verdict
from .material_classes import (
    PLAINER,
    PLAINER_GLOW,
    MaterialClass,
    doubted,
    either,
    is_better,
    is_plainer,
    look_alike,
    tried_notes,
    with_values_of,
)


@dataclass(frozen=True)
class Fitted:
    """A judged result and the pictures of `JobOutcome`."""

    result: FitResult
    start_image: Pixels
    result_image: Pixels
    counted: NDArray[np.bool_]
    sheet: ContactSheet | None = None


def with_other_classes(
    fitted: Fitted,
    material: Mapping[str, Any],
    classes: Sequence[MaterialClass],
    fit_from: Callable[[MaterialClass], Fitted],
    is_wanted: Callable[[Fitted], bool],
) -> Fitted:
    """The fit or a better one of other `classes`, tried while one is wanted; where none is better, the notes say so.

    A trial that fails costs no more than its time.
    """
    first, no_nearer, refused, failed = fitted.result.recovered, [], [], []
    for other in classes:
        if not is_wanted(fitted):
            break
        if not other.may_explain(fitted.result.judgement):
            continue
        try:
            again = fit_from(other)
        except UnrecordableError:
            refused.append(other)
            continue
        except NoNearerError as ended:
            no_nearer.append(other)
            fitted = replace(fitted, result=_with_cost(fitted.result, ended.seconds, ended.passes))
            continue
        except Exception:
            traceback.print_exc(file=sys.stderr)
            failed.append(other)
            continue
        if again.result.status is not Status.CANCELLED:
            no_nearer.append(other)
        fitted = better(fitted, again, other, material)
    if fitted.result.recovered is not first:  # the note of the class that was better says enough
        return fitted
    notes = (*fitted.result.notes, *tried_notes(no_nearer, refused, failed))
    return replace(fitted, result=replace(fitted.result, notes=notes))


def _with_cost(result: FitResult, seconds: float, passes: float) -> FitResult:
    return replace(result, seconds=result.seconds + seconds, passes=result.passes + passes)


def better(first: Fitted, again: Fitted, other: MaterialClass, material: Mapping[str, Any]) -> Fitted:
    """The first fit, or that of another class where it is clearly better."""
    before, after = first.result, again.result
    if before.judgement is None or not is_better(after.judgement, before.judgement, other):
        return replace(first, result=_with_cost(before, after.seconds, after.passes))
    if before.judgement.verdict is Verdict.CLOSE:
        after = doubted(after, before, material)
    return _taken(first, replace(again, result=after), other, material, other.note)


def with_plainer_glow(
    fitted: Fitted,
    material: Mapping[str, Any],
    classes: Sequence[MaterialClass],
    fit_from: Callable[[MaterialClass], Fitted],
) -> Fitted:
    """A result of many layers, or a plainer one that glows and looks the same; neither is sure if they look alike."""
    glowing = next((other for other in classes if other.glows), None)
    if glowing is None:
        return fitted
    again = _tried(lambda: fit_from(glowing))
    if again is None:
        return fitted
    before, after = fitted.result, again.result
    if before.judgement is None or after.judgement is None:
        return fitted
    same = after.judgement.verdict is Verdict.SAME
    alike = same and look_alike(before.judgement, after.judgement)
    if same and is_plainer(after, before, material):
        after = doubted(after, before, material) if alike else after
        return _taken(fitted, replace(again, result=after), glowing, material, PLAINER_GLOW)
    before = doubted(before, after, material) if alike else before
    return replace(fitted, result=_with_cost(before, after.seconds, after.passes))


def with_plainer(fitted: Fitted, material: Mapping[str, Any], fit_plain: Callable[[], Fitted]) -> Fitted:
    """A result, or a plainer one that looks no worse; if they look alike it is as unsure as the two are apart."""
    again = _tried(fit_plain)
    if again is None:
        return fitted
    before, after = fitted.result, again.result
    if before.judgement is None or after.judgement is None:
        return fitted
    alike = look_alike(before.judgement, after.judgement)
    is_nearer = after.judgement.target.visible < before.judgement.target.visible
    if after.judgement.verdict is not Verdict.SAME or not (alike or is_nearer):
        return replace(fitted, result=_with_cost(before, after.seconds, after.passes))
    plainer = doubted(after, before, material) if alike else after
    result = _with_cost(replace(plainer, notes=(*after.notes, PLAINER)), before.seconds, before.passes)
    return replace(again, result=result, start_image=fitted.start_image)


def _tried(fit: Callable[[], Fitted]) -> Fitted | None:
    """A further fit; None where none holds the material, or it fails, which the log says."""
    try:
        return fit()
    except UnrecordableError:
        return None
    except Exception:
        traceback.print_exc(file=sys.stderr)
        return None


def _taken(first: Fitted, again: Fitted, other: MaterialClass, material: Mapping[str, Any], note: str) -> Fitted:
    """A fit of another class in the place of the first; the user's values are its start, too."""
    before, after = first.result, with_values_of(other, again.result, material)
    result = replace(
        after,
        initial={**before.initial, **{name: either(before.initial, material, name) for name in after.recovered}},
        errors={name: (before.errors[name][0], error) for name, (_, error) in after.errors.items()},
        notes=(*after.notes, note),
        seconds=before.seconds + after.seconds,
        passes=before.passes + after.passes,
    )
    return replace(again, result=result, start_image=first.start_image)
