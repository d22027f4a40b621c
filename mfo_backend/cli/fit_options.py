# SPDX-License-Identifier: Apache-2.0
"""The command-line options of a fit, shared by every command that runs one."""

from __future__ import annotations

import argparse
from typing import Any

from ..fit.settings import PAPER_LOSSES
from ..types.errors import BadInputError

_OPTIONS = ("preset", "model", "range", "seed", "max_iterations", "spp", "learning_rate", "keep_optimizer_state")


def add_fit_options(parser: argparse.ArgumentParser) -> None:
    """Add the options; none has a default here, so that what is not given stays with `FitSettings`."""
    group = parser.add_argument_group("how to fit")
    group.add_argument("--preset", help="fast, balanced, best or paper (default: balanced)")
    group.add_argument("--model", help="blender_principled or mitsuba_principled (default: what the scene holds)")
    group.add_argument(
        "--parameters",
        metavar="LIST",
        help='all, reduced, or names with commas between, as "Base Color,Roughness", base_color or, of a node that '
        'feeds it, "Color Ramp/Stop 0" (default: all)',
    )
    group.add_argument("--range", help="losses on radiance or display values: hdr, ldr or auto (default: auto)")
    group = parser.add_argument_group("for experts and the paper's method")
    group.add_argument(
        "--losses",
        metavar="LIST",
        help="stages in order with commas between, such as log,itp,flip; without --preset that is the preset paper",
    )
    group.add_argument("--lf", metavar="LOSS", help="low fidelity: the first of two losses (default: mse)")
    group.add_argument("--hf", metavar="LOSS", help="high fidelity: the second of two losses (default: flip)")
    group.add_argument("--seed", type=int, help="random numbers of the fit (default: 0)")
    group.add_argument("--max-iterations", type=int, metavar="N", help="of each stage, preset paper (default: 300)")
    group.add_argument("--spp", type=int, metavar="N", help="samples per pixel and iteration, preset paper")
    group.add_argument("--learning-rate", type=float, metavar="RATE", help="of Adam, preset paper")
    group.add_argument(
        "--keep-optimizer-state",
        action="store_const",
        const=True,
        help="carry Adam's state into the second stage instead of a new optimisation, preset paper",
    )


def fit_from_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The `fit` object of request.json: the options that were given.

    Raises
    ------
    BadInputError
        If both a pair and a list of losses are given.
    """
    fit = {name: getattr(arguments, name) for name in _OPTIONS if getattr(arguments, name) is not None}
    if arguments.losses is not None:
        if arguments.lf is not None or arguments.hf is not None:
            raise BadInputError("Both --losses and --lf or --hf were given: name a pair, or list all losses in order.")
        fit["losses"] = _names(arguments.losses)
    elif arguments.lf is not None or arguments.hf is not None:
        fit["losses"] = [arguments.lf or PAPER_LOSSES[0], arguments.hf or PAPER_LOSSES[1]]
    if arguments.parameters is not None:
        names = _names(arguments.parameters)
        is_set = len(names) == 1 and names[0].lower() in ("all", "reduced")
        fit["parameters"] = names[0].lower() if is_set else names
    return fit


def _names(listed: str) -> list[str]:
    return [name.strip() for name in listed.split(",") if name.strip()]
