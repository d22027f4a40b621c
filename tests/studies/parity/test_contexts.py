# SPDX-License-Identifier: Apache-2.0
"""A slice of the study of contexts: one baked surface and one world of two panoramas, small pictures."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from studies.parity.contexts import holds, measure

ROW = {"level": 0.009, "flip": 0.049, "floor": 0.04}


@pytest.mark.parametrize(("change", "expected"), [({}, True), ({"level": -0.011}, False), ({"flip": 0.051}, False)])
def test_what_holds(change: dict[str, float], expected: bool) -> None:
    assert holds(ROW | change) is expected


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="needs the bpy module")
@pytest.mark.parametrize(("context", "said"), [("mixed floor", "is baked"), ("world seen apart", "into a panorama")])
def test_the_truth_is_as_in_cycles(context: str, said: str, tmp_path: Path) -> None:
    row = measure(context, 1, tmp_path, size=32, samples=64)
    assert holds(row), row
    assert any(said in note for note in row["notes"])
