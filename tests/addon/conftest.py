# SPDX-License-Identifier: Apache-2.0
"""A Blender in this process (the bpy module), a small scene, and a backend that answers at once."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from . import fake_backend

WIDTH, HEIGHT = 96, 64  # of the fake backend's pictures


@pytest.fixture
def scene(addon: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A new scene in the test's own folder."""
    return new_scene(tmp_path, monkeypatch)


def new_scene(folder: Path, monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Blender's start-up scene with names, a reference that fits it and the fake backend; `bpy`, `reference`, `job`."""
    import bpy

    bpy.ops.wm.read_homefile(use_factory_startup=True)  # without preferences and add-ons, five times as long
    cube = bpy.data.objects["Cube"]
    cube.name, cube.active_material.name = "Väse", "Glaze"
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = WIDTH, HEIGHT, 100
    bpy.context.scene.view_settings.view_transform = "Standard"
    reference = folder / "reference.png"
    fake_backend.png(reference, (180, 60, 40), WIDTH, HEIGHT)
    monkeypatch.setenv("MFO_BACKEND_PYTHON", str(fake_backend.write_interpreter(folder / "backend python")))
    return SimpleNamespace(bpy=bpy, reference=str(reference), job=str(folder / "job"))
