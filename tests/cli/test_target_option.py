# SPDX-License-Identifier: Apache-2.0
"""`--object NAME@slot=2`: what a word names."""

from __future__ import annotations

import pytest

from mfo_backend.cli.target_option import TargetOption, is_active, target_option
from mfo_backend.types.errors import BadInputError


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("Floor", TargetOption("Floor")),
        ("Floor@home", TargetOption("Floor@home")),
        ("Floor@slot=2", TargetOption("Floor", slot=2)),
        ("a@b@material=Dark @wood=", TargetOption("a@b", material="Dark @wood=")),
    ],
)
def test_targets(text: str, found: TargetOption) -> None:
    assert target_option(text) == found


@pytest.mark.parametrize("slot", ["0", "-1", "two", "1.5"])
def test_a_slot_is_counted_from_one(slot: str) -> None:
    with pytest.raises(BadInputError, match="it must be a whole number from 1 on"):
        target_option(f"Floor@slot={slot}")


def test_only_what_is_given_goes_to_blender() -> None:
    assert target_option("Floor@slot=2").fields() == {"object": "Floor", "slot": 2}
    assert is_active([target_option("Floor")])
    assert not is_active([target_option("Floor@slot=1")])
