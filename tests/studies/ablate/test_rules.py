# SPDX-License-Identifier: Apache-2.0
"""The table of rules against the sources: every target is there, and off means off, everywhere and only inside."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.recorded import start, where_to_look
from studies.ablate.page import page
from studies.ablate.rules import RULES, Rule, switched_off, target_of


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_the_target_of_a_rule_is_there_and_comes_back(rule: Rule) -> None:
    owner, name, original = target_of(rule)
    with switched_off(rule):
        assert getattr(owner, name) is not original
    assert getattr(owner, name) is original


def test_a_rule_is_off_where_its_name_was_imported() -> None:
    rule = next(rule for rule in RULES if rule.name == "thinning")
    grid = np.full((4, 4), 3)
    with switched_off(rule):
        assert where_to_look.thinned_grid(grid, None, None, 1) is grid
        assert start.thinned_grid is where_to_look.thinned_grid
    assert start.thinned_grid is where_to_look.thinned_grid


def test_a_list_given_instead_is_a_new_one_each_time() -> None:
    rule = next(rule for rule in RULES if rule.name == "opposite starts")
    with switched_off(rule):
        start.agreeing_ends().append(1)
        assert start.agreeing_ends() == []


def test_the_names_are_different() -> None:
    assert len({rule.name for rule in RULES}) == len(RULES)


def test_a_line_counts_what_changed() -> None:
    common = {"size": 64, "commit": "c", "scenario": "base"}
    on = {"rule": "", "solved": True, "error": 0.001, "wrong": [], "seconds": 2.0, **common}
    off = on | {"rule": "other basins", "solved": False, "error": 0.05, "wrong": ["metallic"], "seconds": 1.0}
    same = on | {"rule": "other basins", "seconds": 1.0}
    text = page([on | {"scene": 0}, off | {"scene": 0}, on | {"scene": 1}, same | {"scene": 1}])
    assert "| other basins | base | 2 | 1 | 2 | 1 | 1 | 0 | 0 | 1 | 0.50 |" in text
