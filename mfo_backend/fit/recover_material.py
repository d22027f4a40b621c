# SPDX-License-Identifier: Apache-2.0
"""A fit by the preset the settings name."""

from __future__ import annotations

from collections.abc import Callable

from ..metrics.tone_mapping import View
from ..render.renderer import Renderer
from ..types.event import Listener
from ..types.image import Image
from .fit_material import FitOutcome, fit_material
from .fit_recorded import fit_recorded
from .settings import FitSettings


def recover_material(
    renderer: Renderer,
    reference: Image,
    settings: FitSettings,
    *,
    display: View | None = None,
    listener: Listener,
    should_stop: Callable[[], bool],
) -> FitOutcome:
    """See `fit_material` (preset `paper`) and `fit_recorded` (`fast`, `balanced`)."""
    fit = fit_material if settings.preset == "paper" else fit_recorded
    return fit(renderer, reference, settings, display=display, listener=listener, should_stop=should_stop)
