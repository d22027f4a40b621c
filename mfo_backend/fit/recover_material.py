# SPDX-License-Identifier: Apache-2.0
"""A fit by the preset the settings name, and the way out where that preset cannot do it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..metrics.tone_mapping import View
from ..render.mitsuba_renderer import MitsubaRenderer
from ..render.renderer import Renderer
from ..types.errors import UnrecordableError
from ..types.event import Listener
from ..types.image import Image
from .paper.fit import FitOutcome, fit_material
from .recorded.fit import fit_recorded
from .settings import FitSettings
from .traced.fit import fit_transmission


def recover_material(
    renderer: Renderer,
    reference: Image,
    settings: FitSettings,
    *,
    display: View | None = None,
    listener: Listener,
    should_stop: Callable[[], bool],
) -> FitOutcome:
    """See `fit_material` (preset `paper`) and `fit_recorded` (`fast`, `balanced`, `best`).

    A material that recorded paths cannot hold, such as glass, is fitted by `fit_transmission`; where that cannot do it
    either, by `fit_material` whatever the preset. The last of the result's notes says which and why.
    """
    reason = ""
    if settings.preset != "paper" and isinstance(renderer, MitsubaRenderer):
        try:
            return fit_recorded(
                renderer, reference, settings, display=display, listener=listener, should_stop=should_stop
            )
        except UnrecordableError as error:
            reason = str(error)
        if settings.losses is None:
            try:
                outcome = fit_transmission(
                    renderer, reference, settings, display=display, listener=listener, should_stop=should_stop
                )
            except UnrecordableError as error:
                reason = f"{reason} {error}"
            else:
                stages = ", ".join(repr(stage.name) for stage in outcome.result.stages)
                return _noted(outcome, f"{reason} So whole light paths were traced, by the stages {stages}.")
        else:
            reason += " The stages on whole light paths know no losses of the user's choice."
        reason += f" So the preset 'paper' was used instead of {settings.preset!r}."
    settings = replace(settings, preset="paper")
    outcome = fit_material(renderer, reference, settings, display=display, listener=listener, should_stop=should_stop)
    return _noted(outcome, reason) if reason else outcome


def _noted(outcome: FitOutcome, note: str) -> FitOutcome:
    """The outcome with one more note."""
    return replace(outcome, result=replace(outcome.result, notes=(*outcome.result.notes, note)))
