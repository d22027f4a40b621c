# SPDX-License-Identifier: Apache-2.0
"""The command-line options of a fit, shared by every command that runs one."""

from __future__ import annotations

import argparse
from typing import Any

_OPTIONS = ("preset", "model", "range", "seed", "max_iterations", "spp", "learning_rate", "keep_optimizer_state")


def add_fit_options(parser: argparse.ArgumentParser) -> None:
    """Add the options; none has a default here, so that what is not given stays with the backend's defaults."""
    group = parser.add_argument_group("how to fit")
    group.add_argument("--preset", help="fast, balanced, best or paper")
    group.add_argument("--model", help="material model that is fitted (default: the one of the scene)")
    group.add_argument("--parameters", metavar="LIST", help="all, reduced, or names with commas between")
    group.add_argument("--range", choices=("auto", "hdr", "ldr"), help="losses on radiance or on display values")
    group.add_argument("--seed", type=int, help="random numbers of the fit")
    group.add_argument("--max-iterations", type=int, metavar="N", help="most iterations of a stage")
    group.add_argument("--spp", type=int, metavar="N", help="samples per pixel of an iteration")
    group.add_argument("--learning-rate", type=float, metavar="RATE", help="of Adam, preset paper")
    group.add_argument(
        "--keep-optimizer-state",
        action="store_true",
        default=None,
        help="carry Adam's state into the second stage instead of a new optimisation",
    )


def fit_from_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The `fit` object of request.json: the options that were given."""
    fit = {name: getattr(arguments, name) for name in _OPTIONS if getattr(arguments, name) is not None}
    if arguments.parameters is not None:
        names = [name.strip() for name in arguments.parameters.split(",")]
        fit["parameters"] = names[0] if names in (["all"], ["reduced"]) else names
    return fit
