# SPDX-License-Identifier: Apache-2.0
"""Inside the bpy module: export a job with a sphere of very many triangles; run by `tests.faults.heavy`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import bpy
import numpy as np

from blender_addon.demo_scene import OBJECT, build_demo_scene
from blender_addon.export.job import export_job
from mfo_backend.scene.image_file import write_exr


def main(folder: str, segments: str, size: str) -> None:
    """The demo's scene with its object exchanged, and a smooth reference."""
    source = Path(folder).with_name("source")
    source.mkdir()
    build_demo_scene(source, 0, int(size))
    bpy.ops.wm.open_mainfile(filepath=str(source / "start.blend"), load_ui=False)
    target = bpy.data.objects[OBJECT]
    target.modifiers.clear()
    material = target.active_material
    bpy.ops.mesh.primitive_uv_sphere_add(segments=int(segments), ring_count=int(segments), radius=1.0)
    sphere = bpy.context.object
    target.data = sphere.data
    bpy.data.objects.remove(sphere)
    target.data.materials.append(material)
    write_exr(source / "reference.exr", np.full((int(size), int(size), 3), 0.3, np.float32))
    report = export_job(
        bpy.context, target, Path(folder), reference=source / "reference.exr", fit={"preset": "fast"}, bake_view=False
    )
    print("mfo: exported", *report.notes, file=sys.stderr)


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stderr.flush()
    os._exit(0)
