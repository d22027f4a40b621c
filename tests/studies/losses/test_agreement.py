# SPDX-License-Identifier: Apache-2.0
"""The agreement study: its correlations on made-up scores and the table it writes. Nothing is rendered."""

from __future__ import annotations

import numpy as np
import pytest

from studies.losses import agreement


@pytest.fixture(scope="module")
def study():
    return agreement


def scores(study, materials=6):
    changes = [change for _ in range(materials) for change in study.CHANGES]
    judged = np.random.default_rng(0).uniform(0, 4, len(changes))
    return changes, judged


def test_only_the_order_counts(study):
    changes, judged = scores(study)
    columns = {"same": judged**3, "opposite": -np.exp(judged)}
    found = study.correlations(columns, judged, changes)
    assert list(found["same"]) == ["roughness", "hue", "metallic", "coat", "noise", "all"]
    assert list(found["same"].values()) == pytest.approx([1] * 6)
    assert list(found["opposite"].values()) == pytest.approx([-1] * 6)


def test_a_loss_may_agree_on_each_change_and_not_on_all(study):
    changes, judged = scores(study)
    weight = np.array([1e6 if change == "hue" else 1.0 for change in changes])
    found = study.correlations({"hue first": judged * weight}, judged, changes)["hue first"]
    assert found["hue"] == found["noise"] == pytest.approx(1)
    assert found["all"] < 0.9


def test_every_step_is_at_least_the_least_and_stays_inside(study):
    from_module = study.material_pairs.__globals__["_moved"]
    rng = np.random.default_rng(1)
    for value in rng.uniform(0, 1, 200):
        moved = from_module(value, 0.0, 1.0, 0.02, rng)
        assert 0 <= moved <= 1
        assert abs(moved - value) >= 0.02 - 1e-12


def test_the_table_goes_between_the_markers(study, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{study.BEGIN}\nold\n{study.END}\nafter\n", "utf-8")
    study.write_between_markers(page, "new")
    study.write_between_markers(page, "newer")
    assert page.read_text("utf-8") == f"before\n{study.BEGIN}\nnewer\n{study.END}\nafter\n"
