# SPDX-License-Identifier: Apache-2.0
"""Scenes of `graphs.py`, run by a Python with `bpy` or by Blender: a head whose material is a node graph.

    python -m studies.parity.graph_scene GRAPH LIGHT FOLDER --size 256 --samples 128
    blender --background --factory-startup --python studies/parity/graph_scene.py -- GRAPH LIGHT FOLDER

writes FOLDER/job and the scene-linear pictures FOLDER/cycles_0.exr and cycles_1.exr, two seeds of the same scene.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

CONSTANT = "constant"  # the head without any nodes but its shader, which graphs are compared with


def main() -> None:
    """Build, export, render."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("graph")
    parser.add_argument("light")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--samples", type=int, default=128)
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    chosen = parser.parse_args(words)
    import bpy

    from blender_addon.export.job import export_job
    from studies.graphs.bumps import BUMPS
    from studies.graphs.head import head_scene
    from studies.graphs.materials import GRAPHS
    from studies.graphs.subsurface import SUBSURFACE

    target, node = head_scene(chosen.light, chosen.size)
    if chosen.graph != CONSTANT:
        (GRAPHS | BUMPS | SUBSURFACE)[chosen.graph](target.active_material.node_tree, node)
    scene = bpy.context.scene
    scene.cycles.samples = chosen.samples
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    for seed in range(2):
        scene.cycles.seed = seed
        scene.render.filepath = str(chosen.folder / f"cycles_{seed}.exr")
        bpy.ops.render.render(write_still=True)
    export_job(bpy.context, target, chosen.folder / "job", reference=chosen.folder / "cycles_0.exr", fit={})


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # Blender starts the file itself
    main()
