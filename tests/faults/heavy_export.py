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
    material = target.active_material
    target.modifiers.clear()
    target.data = sphere(int(segments))
    target.data.materials.append(material)
    write_exr(source / "reference.exr", np.full((int(size), int(size), 3), 0.3, np.float32))
    report = export_job(bpy.context, target, Path(folder), reference=source / "reference.exr", fit={"preset": "fast"})
    print("mfo: exported", *report.notes, file=sys.stderr)


def sphere(count: int) -> bpy.types.Mesh:
    """A sphere of count x count patches of two triangles, smooth."""
    polar, around = np.meshgrid(
        np.linspace(0.01, np.pi - 0.01, count + 1), np.linspace(0, 2 * np.pi, count + 1), indexing="ij"
    )
    corners = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], -1)
    index = np.arange(corners[..., 0].size).reshape(polar.shape)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)])
    mesh = bpy.data.meshes.new("many")
    mesh.from_pydata(corners.reshape(-1, 3), [], faces, shade_flat=False)
    return mesh


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stderr.flush()
    os._exit(0)
