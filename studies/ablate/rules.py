# SPDX-License-Identifier: Apache-2.0
"""The rules of a fit that can be switched off, each by one replaced function, method or number; the product has no such
switches."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

EXACT, SAMPLED, TRACED, HARD = ("base", "parameters"), ("noise", "cycles"), ("transparency_4spp",), ("hard",)
GLASS = ("transparency",)
CLASSES = ("classes",)  # Cycles' pictures of every class of material, from Blender's own
UNREACHED = ("measured",)  # materials that no values of the model give


@dataclass(frozen=True)
class Rule:
    """`target` is ``module:name`` or ``module:Class.name`` below `mfo_backend`; `off` makes what takes its place of it.

    `scenarios` are those of the bench whose fits come by the rule.
    """

    name: str
    target: str
    off: Callable[[Any], Any]
    scenarios: tuple[str, ...]


def _constant(value: Any) -> Callable[[Any], Any]:
    """Gives a new copy each time: callers append to lists."""
    return lambda original: lambda *given, **named: copy(value)


def _argument(number: int) -> Callable[[Any], Any]:
    """Gives back its argument of this number, unchanged."""
    return lambda original: lambda *given, **named: given[number]


def _number(value: Any) -> Callable[[Any], Any]:
    return lambda original: value


def _without(name: str) -> Callable[[Any], Any]:
    """Leaves one entry out of a function's dictionary."""
    return lambda original: lambda *given, **named: {k: v for k, v in original(*given, **named).items() if k != name}


def _not_recounted(original: Any) -> Any:
    return lambda *given, **named: replace(original(*given, **named), log_ratio=0.0, sd=0.0)


RULES = (
    # search
    Rule("opposite starts", "fit.search.global_start:agreeing_ends", _constant([]), (*EXACT, *SAMPLED)),
    Rule("starts of the scan", "fit.search.global_start:best_starts", _constant([]),
         (*EXACT, *SAMPLED, *HARD, *CLASSES)),
    Rule("metals in the scan", "fit.search.global_start:METAL_SECOND_NODES", _number(()),
         (*EXACT, *SAMPLED, *CLASSES)),
    Rule("other basins", "fit.alike.exchanges:best_basin", _argument(1), (*EXACT, *HARD)),
    Rule("fireflies left out", "fit.recorded.where_to_look:without_fireflies",
         lambda original: lambda image, mask: (image, 0), (*SAMPLED, *CLASSES)),
    # where the fit looks
    Rule("edges of light", "fit.recorded.where_to_look:edges_of_light", _constant(None), (*EXACT, *HARD)),
    Rule("finer grid at the solution", "fit.recorded.where_to_look:solution_grid", _constant(None), (*EXACT, *HARD)),
    Rule("thinning", "fit.recorded.where_to_look:thinned_grid", _argument(0), EXACT),
    Rule("finer recording for little noise", "fit.recorded.where_to_look:finer_grid", _argument(0), SAMPLED),
    # noise
    Rule("own noise taken away", "fit.squares.recording_noise:without_own_noise", _argument(0), SAMPLED),
    Rule("equal counts", "fit.traced.sample_count:equal_counts", _constant(None), TRACED),
    Rule("recount", "fit.traced.sample_count:recount", _not_recounted, TRACED),
    # materials that look alike
    Rule("metal rivals", "fit.alike.exchanges:metal_rivals",
         lambda original: lambda problem, solve, found, table: (found, ()), (*EXACT, *HARD)),
    Rule("width rivals", "fit.alike.exchanges:width_rivals", _constant(()), (*EXACT, *SAMPLED, *HARD)),
    Rule("simplest end", "fit.alike.simplest:OtherEnds.simplest", _argument(1), (*SAMPLED, *HARD)),
    Rule("unneeded lobes", "fit.alike.unneeded_lobes:unneeded_lobes", _constant([]), (*EXACT, *SAMPLED, *HARD)),
    Rule("values back to the user's", "fit.recorded.keep_user_values:_sets_to_return", _constant(()),
         (*EXACT, *SAMPLED, *HARD)),
    # certainty
    Rule("few pixels that rule a value", "solve.leverage:residuals_left_out", _argument(1),
         (*EXACT, *SAMPLED, *GLASS, *HARD, *CLASSES)),
    # perceptual stages
    Rule("all perceptual stages", "fit.recorded.perceptual_stages:perceptual_ends",
         lambda original: lambda *given: ([], []), (*EXACT, *SAMPLED, *UNREACHED)),
    Rule("stage itp", "fit.squares.stage_residuals:finishing_residuals", _without("itp"),
         (*EXACT, *SAMPLED, *UNREACHED)),
    Rule("none at the noise", "fit.recorded.fit:AT_NOISE", _number(0.0), (*SAMPLED, *UNREACHED)),
)  # fmt: skip


def target_of(rule: Rule) -> tuple[Any, str, Any]:
    """Owner, name and present value of what the rule's switch replaces.

    Raises
    ------
    AttributeError
        If the sources have no such name any more: adapt the table.
    """
    module, _, path = rule.target.partition(":")
    owner: Any = importlib.import_module(f"mfo_backend.{module}")
    *classes, name = path.split(".")
    for each in classes:
        owner = getattr(owner, each)
    return owner, name, getattr(owner, name)


@contextmanager
def switched_off(rule: Rule) -> Iterator[None]:
    """The rule is off inside, in every module of the backend that has imported its name."""
    owner, name, original = target_of(rule)
    instead = rule.off(original)
    modules = [module for key, module in list(sys.modules.items()) if key.startswith("mfo_backend")]
    holders = [owner, *(m for m in modules if m is not owner and vars(m).get(name) is original)]
    for holder in holders:
        setattr(holder, name, instead)
    try:
        yield
    finally:
        for holder in holders:
            setattr(holder, name, original)
