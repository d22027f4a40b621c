# SPDX-License-Identifier: Apache-2.0
"""Lamps without shadows that something hides from the target: named where their light is another in Cycles."""

from __future__ import annotations

from typing import Any

import pytest

from tests.export.scenes import add_camera, add_light, add_quad, new_material


@pytest.mark.parametrize(
    ("kind", "lamp", "lid", "said"),
    [
        ("AREA", {}, True, True),
        ("SUN", {"angle": 0.1}, True, True),
        ("POINT", {"shadow_soft_size": 0.3}, True, True),
        ("POINT", {"shadow_soft_size": 0.0}, True, False),
        ("AREA", {"use_shadow": True}, True, False),
        ("AREA", {}, False, False),
    ],
)
def test_a_lamp_without_shadows_behind_something_is_named(
    kind: str, lamp: dict[str, Any], lid: bool, said: bool, scene: Any, export: Any
) -> None:
    """Metal balls below a board before such a lamp were up to a quarter too dark or too bright."""
    add_camera(ortho_scale=2.0)
    light = add_light(kind, energy=100.0)
    light.location = (0.0, 0.0, 7.0)
    for name, value in {"use_shadow": False, **lamp}.items():
        setattr(light.data, name, value)
    if lid:
        add_quad("Board", 0.5, 6.0, new_material("Board"))
    notes = export(add_quad("Target", 1.0, 0.0, new_material("Steel", Metallic=1.0))).notes
    found = [note for note in notes if "casts no shadows and is behind 'Board'" in note]
    assert len(found) == said
