# SPDX-License-Identifier: Apache-2.0
"""The methods by name, as settings of a fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...fit.plans import RecordedPlan
from ...fit.settings import FitSettings
from ...metrics.losses.loss import make_loss
from ...metrics.losses.loss_names import OPTIONAL_LOSS_NAMES
from ...types.errors import SetupError
from ...types.image import Encoding, Image
from ..scenes.scenario import Scenario

_EVERY = 10**9
_EVERYTHING = RecordedPlan(
    scan_lanes=_EVERY, start_lanes=_EVERY, exact_scan_lanes=_EVERY, exact_start_lanes=_EVERY, refine_lanes=_EVERY
)


@dataclass(frozen=True)
class Method:
    """How a method fits.

    Attributes
    ----------
    settings
        What differs from the defaults of a fit.
    plan
        That of a recorded fit where it is not its preset's.
    new_seeds
        Random numbers of its own for every picture of the fit instead of common ones.
    compares_with
        The method that this one leaves something out of; empty for methods that stand for themselves.
    """

    settings: Mapping[str, Any]
    plan: RecordedPlan | None = None
    new_seeds: bool = False
    compares_with: str = ""


def _paper(losses: tuple[str, ...], light: str, **more: Any) -> Method:
    return Method({"preset": "paper", "losses": losses, "range": light, **more})


# cheap ones first: a bench that is stopped early has as much as can be had
OUR_METHODS = {name: Method({"preset": name, "range": "hdr"}) for name in ("fast", "balanced", "best")}
PAPER_METHODS = {
    f"{name}-{light}": _paper(losses, light)
    for name, losses in (("mfo", ("mse", "flip")), ("mse", ("mse",)), ("flip", ("flip",)))
    for light in ("hdr", "ldr")
}
PAPER_METHODS |= {"lpips": _paper(("lpips",), "ldr"), "lpips-pu": _paper(("lpips_pu",), "hdr")}
_BALANCED = OUR_METHODS["balanced"].settings
ABLATIONS = {
    "balanced-no-scan": Method(_BALANCED, RecordedPlan(scan=False, same_cost=0.0), compares_with="balanced"),
    "balanced-full-scan": Method(_BALANCED, RecordedPlan(same_cost=0.0), compares_with="balanced"),
    "balanced-few-rays": Method(_BALANCED, RecordedPlan(most_own=1.0), compares_with="balanced"),
    "balanced-no-subset": Method(_BALANCED, _EVERYTHING, compares_with="balanced"),
    "mfo-hdr-kept": replace(_paper(("mse", "flip"), "hdr", keep_optimizer_state=True), compares_with="mfo-hdr"),
    "mfo-ldr-kept": replace(_paper(("mse", "flip"), "ldr", keep_optimizer_state=True), compares_with="mfo-ldr"),
    "mfo-hdr-new-seeds": replace(_paper(("mse", "flip"), "hdr"), new_seeds=True, compares_with="mfo-hdr"),
}
METHODS = {**OUR_METHODS, **PAPER_METHODS, **ABLATIONS}
DEFAULT_METHODS = (*OUR_METHODS, *PAPER_METHODS)


def method_settings(method: str, scenario: Scenario, seed: int) -> FitSettings:
    """Settings of `method`: the paper's loop with its losses (``mfo-hdr`` is MSE, then HDR-FLIP), or our preset.

    What the paper leaves open (Adam's rate, its schedule, the limit of iterations) is the preset's default.
    """
    chosen = {"model": scenario.model, "parameters": scenario.fitted, "seed": seed, "spp": scenario.fit_spp}
    return FitSettings(**chosen, **METHODS[method].settings)


def missing_for(method: str) -> str:
    """Why a method cannot run here, one sentence; empty where it can. LPIPS needs weights of the user."""
    settings = FitSettings(**METHODS[method].settings)
    grey = Image(np.full((64, 64, 3), 0.5, np.float32), Encoding.LINEAR)
    try:
        for name in settings.stage_names(Encoding.LINEAR) if settings.preset == "paper" else ():
            if name in OPTIONAL_LOSS_NAMES:
                make_loss(name, grey)
    except SetupError as error:
        return str(error)
    return ""


def is_quick(method: str) -> bool:
    """Whether it takes seconds and not minutes."""
    return METHODS[method].settings["preset"] != "paper"


def warm_up_settings(settings: FitSettings) -> FitSettings:
    """Settings of a fit that compiles the same kernels; the paper's loop compiles all of them in two iterations."""
    return replace(settings, max_iterations=2) if settings.preset == "paper" else settings
