# SPDX-License-Identifier: Apache-2.0
"""Two hundred random materials of each family, four direction pairs each, against the Cycles of the `bpy` module."""

from __future__ import annotations

import importlib.util
from functools import cache

import numpy as np
import pytest

from .. import parity

needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="the bpy module is not installed")
MATERIALS = 200


@cache
def answers() -> dict[str, tuple[parity.Cases, np.ndarray]]:
    cases = {group.name: parity.random_cases(group, MATERIALS, seed) for seed, group in enumerate(parity.GROUPS)}
    batches = [{**cases[group.name].batch, "distribution": group.distribution} for group in parity.GROUPS]
    return {
        group.name: (cases[group.name], a) for group, a in zip(parity.GROUPS, parity.ask_cycles(batches), strict=True)
    }


@needs_bpy
@pytest.mark.parametrize("group", parity.GROUPS, ids=lambda group: group.name)
def test_value_is_that_of_cycles(group: parity.Group) -> None:
    cases, theirs = answers()[group.name]
    error = parity.relative_difference(parity.evaluate_cases(cases, group, (5, 0)), theirs)
    # Single precision on both sides; docs/reference/material_parity.md explains the few that are worse than the rest
    assert np.quantile(error, 0.99) < group.most, np.sort(error)[-20:]
    if group.refracted:
        error = error[~parity.at_total_reflection(cases)]
    assert error.max() < group.worst, np.sort(error)[-5:]


@needs_bpy
def test_parity_table_is_up_to_date() -> None:
    rows = {group.name: parity.table_row(group, *answers()[group.name], (5, 0)) for group in parity.GROUPS}
    text = parity.TABLE.read_text("utf-8")
    for name, row in rows.items():
        assert f"| {name} |" in text
        # Processors differ in the last digits, the order of magnitude stays
        written = next(line for line in text.splitlines() if line.startswith(f"| {name} | {parity.TABLE_VERSION}"))
        old, new = (float(r.split("|")[4]) for r in (written, row))
        assert new < 3 * old + 1e-6
