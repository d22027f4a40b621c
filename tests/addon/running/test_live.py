# SPDX-License-Identifier: Apache-2.0
"""Live: what makes a new fit due, and when."""

from __future__ import annotations

import os
from types import SimpleNamespace

import pytest


@pytest.fixture
def due(scene: SimpleNamespace):
    """Whether a fit is due at a time, with the settings known at the beginning."""
    from blender_addon.running import live

    context = scene.bpy.context
    context.scene.mfo.reference_path = scene.reference
    live.forget(context.scene, context.view_layer)
    return lambda now: live.is_due(context.scene, context.view_layer, now)


def test_nothing_is_due_without_a_change(due) -> None:
    assert not any(due(now) for now in (0.0, 1.0, 100.0))


def test_a_drag_is_one_fit_after_it_has_settled(scene: SimpleNamespace, due) -> None:
    part = scene.bpy.context.scene.mfo.first_picture.part
    for step in range(5):
        part.left = 10.0 + step
        assert not due(0.2 * step)
    assert not due(1.3)
    assert due(1.5)
    assert not due(3.0)


@pytest.mark.parametrize("change", ["limit", "lock", "preset", "file", "mask"])
def test_what_the_next_fit_depends_on_makes_it_due(scene: SimpleNamespace, due, change: str) -> None:
    from blender_addon.properties import toggle_bound

    settings = scene.bpy.context.scene.mfo
    if change == "limit":
        toggle_bound(settings, "roughness")
    elif change == "lock":
        settings.sockets = {"roughness"}
    elif change == "preset":
        settings.preset = "fast"
    elif change == "file":
        os.utime(scene.reference, (1.0, 1.0))
    else:
        settings.first_picture.part.mask = scene.bpy.data.images.new("Mask", 4, 4)
    assert not due(0.0)
    assert due(1.0)


def test_a_fit_that_runs_ends_first(scene: SimpleNamespace, due, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.running import running_job

    scene.bpy.context.scene.mfo.preset = "best"
    assert not due(0.0)
    monkeypatch.setattr(running_job, "current", object())
    assert not due(1.0)
    monkeypatch.setattr(running_job, "current", None)
    assert due(1.1)
