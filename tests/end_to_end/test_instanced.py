# SPDX-License-Identifier: Apache-2.0
"""An asset that is appended as an instance: its object is in no scene, an empty shows its collection."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .conftest import run_bpy, run_mfo

BUILD = """
from studies.graphs.measure import build_scene
target, node = build_scene("ramp", "lamp", 48)
scene = bpy.context.scene
asset = bpy.data.collections.new("Asset")
for each in list(target.users_collection):
    each.objects.unlink(target)
asset.objects.link(target)
shown = bpy.data.objects.new("Shown", None)
shown.instance_type, shown.instance_collection = "COLLECTION", asset
scene.collection.objects.link(shown)
scene.cycles.samples = 64
settings = scene.render.image_settings
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = argv[1]
bpy.ops.render.render(write_still=True)
stops = target.active_material.node_tree.nodes["Color Ramp"].color_ramp.elements
found = [list(stop.color)[:3] for stop in stops]
for stop in stops:
    stop.color = (0.4, 0.4, 0.4, 1.0)
bpy.ops.wm.save_as_mainfile(filepath=argv[0])
"""
SHOW = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
stops = bpy.data.objects["Suzanne"].active_material.node_tree.nodes["Color Ramp"].color_ramp.elements
found = [list(stop.color)[:3] for stop in stops]
"""


def test_colours_inside_its_nodes_are_found_and_written(tmp_path: Path) -> None:
    """It was refused: *its mesh objects are: none*."""
    start, reference, fitted = (tmp_path / name for name in ("start.blend", "reference.exr", "fitted.blend"))
    truth = run_bpy(BUILD, start, reference)
    done = run_mfo(
        "blend", start, "--object", "Suzanne", "--reference", reference, "--parameters", "Color Ramp/Stop 0, Color "
        "Ramp/Stop 1", "--preset", "fast", "--out", tmp_path / "job", "--apply", "--save-as", fitted, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    np.testing.assert_allclose(run_bpy(SHOW, fitted), truth, atol=0.02)
