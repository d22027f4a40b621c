# SPDX-License-Identifier: Apache-2.0
"""Scenes of `cycles_recovery.py`, run by a Python with `bpy`: the demo's head and materials under another light.

    python -m studies.recovery.recovery_scene SEED LIGHT FOLDER --size 128

writes FOLDER/truth.blend and start.blend with Blender's own render settings and light settings wherever possible.
"""

from __future__ import annotations

import argparse
import json
import math
import random
from pathlib import Path
from typing import Any

LIGHTS = ("environment", "point", "area", "sun")


def build(seed: int, light: str, folder: Path, size: int) -> dict[str, Any]:
    """Write both files; returns the object's name and the socket values `truth` and `start`."""
    import bpy

    from blender_addon.demo_scene import OBJECT, build_demo_scene

    materials = build_demo_scene(folder, seed, size)
    for name in materials if light != "environment" else ():
        path = str(folder / f"{name}.blend")
        bpy.ops.wm.open_mainfile(filepath=path)
        _replace_light(light, random.Random(seed))
        bpy.ops.wm.save_as_mainfile(filepath=path, compress=True)
    return {"object": OBJECT, **materials}


def _replace_light(kind: str, draw: random.Random) -> None:
    """One light in front of the head, above the camera, and a dim grey world, so that shadows are not black."""
    import bpy

    background = next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.id_data.links.remove(background.inputs["Color"].links[0])
    background.inputs["Color"].default_value = (0.05, 0.05, 0.05, 1.0)
    data = bpy.data.lights.new("Light", kind.upper())
    data.energy = {"point": 1500.0, "area": 900.0, "sun": 6.0}[kind]
    if kind == "area":
        data.shape, data.size = "SQUARE", 1.5
    if kind == "sun":
        data.angle = math.radians(5.0)
    item = bpy.data.objects.new("Light", data)
    turn = draw.uniform(-1.0, 1.0)
    item.location = (3.5 * math.sin(turn), -3.5 * math.cos(turn), 3.0)
    item.rotation_euler = (math.atan2(3.5, 3.0), 0.0, turn)
    bpy.context.scene.collection.objects.link(item)


def main() -> None:
    """Build."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seed", type=int)
    parser.add_argument("light", choices=LIGHTS)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", type=int, default=128)
    chosen = parser.parse_args()
    print("\n" + json.dumps(build(chosen.seed, chosen.light, chosen.folder.absolute(), chosen.size)))


if __name__ == "__main__":
    main()
