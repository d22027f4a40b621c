# SPDX-License-Identifier: Apache-2.0
"""The methods by name, as settings of a fit."""

from __future__ import annotations

from dataclasses import replace

from ..fit.settings import FitSettings
from .scenario import Scenario

_PAPER = {"mse": ("mse",), "flip": ("flip",), "mfo": ("mse", "flip")}
PAPER_METHODS = tuple(f"{losses}-{light}" for losses in _PAPER for light in ("ldr", "hdr"))
OUR_METHODS = ("fast", "balanced", "best")
METHODS = (*PAPER_METHODS, *OUR_METHODS)


def method_settings(method: str, scenario: Scenario, seed: int) -> FitSettings:
    """Settings of `method`: the paper's loop with its losses (``mfo-hdr`` is MSE, then HDR-FLIP), or our preset.

    What the paper leaves open (Adam's rate, its schedule, the limit of iterations) is the preset's default.
    """
    chosen = {"model": "mitsuba_principled", "parameters": scenario.fitted, "seed": seed, "spp": scenario.fit_spp}
    if method in OUR_METHODS:
        return FitSettings(preset=method, range="hdr", **chosen)
    losses, _, light = method.partition("-")
    return FitSettings(preset="paper", losses=_PAPER[losses], range=light, **chosen)


def warm_up_settings(settings: FitSettings) -> FitSettings:
    """Settings of a fit that compiles the same kernels; the paper's loop compiles all of them in two iterations."""
    return replace(settings, max_iterations=2) if settings.preset == "paper" else settings
