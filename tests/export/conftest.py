# SPDX-License-Identifier: Apache-2.0
"""Scenes built in bpy, rendered by Cycles on one side and, after an export, by Mitsuba on the other."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .load_scene import load_scene

Pixels = np.ndarray

# the pure part is tested without Blender too
collect_ignore = (
    []
    if find_spec("bpy")
    else [
        "test_audit.py",
        "test_bad_input.py",
        "test_camera.py",
        "test_geometry.py",
        "test_image_filter.py",
        "test_lamps.py",
        "test_light_levels.py",
        "test_materials.py",
        "test_reference.py",
        "test_scene_walk.py",
        "test_smooth_facets.py",
        "test_untouched.py",
        "test_view_lut.py",
        "test_world.py",
    ]
)


@pytest.fixture(scope="session")
def mitsuba() -> Any:
    from mfo_backend.render.machine.variant import load_variant

    load_variant("llvm_ad_rgb")
    import mitsuba as mi

    from mfo_backend.render.lamps.lamp_plugins import register

    register()
    return mi


@pytest.fixture
def scene() -> Any:
    """An empty scene, 32x32, box filter, Cycles on the CPU without anything that biases it."""
    import bpy

    # preferences and add-ons are those of a new Blender in a module, and to read them anew takes five times as long
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.use_compositing = scene.render.use_sequencer = False
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = 64
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.max_bounces = 0
    return scene


@pytest.fixture
def render_cycles(tmp_path: Path) -> Callable[[], Pixels]:
    def render() -> Pixels:
        """Return what Cycles sees, linear (height, width, 3)."""
        import bpy
        import OpenEXR

        path = tmp_path / "cycles.exr"
        bpy.context.scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        return np.array(next(iter(OpenEXR.File(str(path)).channels().values())).pixels[:, :, :3])

    return render


@pytest.fixture
def export(tmp_path: Path) -> Callable[..., Any]:
    def run(target: Any, name: str = "job", **options: Any) -> Any:
        import bpy

        from blender_addon.export.job import export_job

        options = {"reference": None, "fit": {}, **options}
        return export_job(bpy.context, target, tmp_path / name, **options)

    return run


@pytest.fixture
def in_both(export: Callable[..., Any], render_cycles: Callable[[], Pixels]) -> Callable[[Any], tuple[Any, Any, Any]]:
    """The report of a target's export, our picture of the scene by it, and that by Cycles."""

    def run(target: Any) -> tuple[Any, Any, Any]:
        import bpy

        from studies.parity.cycles_parity import render_job

        bpy.context.view_layer.update()
        theirs = render_cycles()
        report = export(target, reference=bpy.data.images.new("Any", 32, 32))
        return report, np.mean(render_job(report.folder, 256), axis=0), theirs

    return run


@pytest.fixture
def render_mitsuba(mitsuba: Any) -> Callable[..., Pixels]:
    def render(report: Any, spp: int = 64) -> Pixels:
        """Return what `mi.render` makes of the job's scene, with our lamps registered."""
        scene = load_scene(mitsuba, report, parallel=False)  # plugins in Python
        return np.array(mitsuba.render(scene, spp=spp))[:, :, :3]

    return render
