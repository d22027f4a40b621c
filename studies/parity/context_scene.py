# SPDX-License-Identifier: Apache-2.0
"""Scenes of `contexts.py`, run by a Python with `bpy`: a plain ball among surfaces and under worlds of nodes.

    python -m studies.parity.context_scene CONTEXT FOLDER --seed 0 --size 64 --samples 256

writes FOLDER/job and the scene-linear pictures FOLDER/cycles_0.exr and cycles_1.exr, two seeds of the same scene.
"""

from __future__ import annotations

import argparse
import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .parity_scene import _give, _light, _set_up_render

Random = random.Random


def build(context: str, seed: int, size: int) -> Any:
    """Make the scene of one context; returns the ball."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, chance = bpy.context.scene, random.Random(f"{context} {seed}")
    _set_up_render(scene, size)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -5.5, 2.2), (1.2566, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.mesh.primitive_plane_add(size=8.0)
    floor = bpy.context.object
    floor.name = "Floor"
    _give(floor, "Floor", {"Base Color": (0.4, 0.4, 0.4), "Roughness": 0.7})
    bpy.ops.mesh.primitive_plane_add(size=8.0, location=(0.0, 3.0, 3.0), rotation=(1.5708, 0.0, 0.0))
    wall = bpy.context.object
    wall.name = "Wall"
    _give(wall, "Wall", {"Base Color": (0.6, 0.6, 0.6), "Roughness": 0.6})
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, radius=1.0, location=(0.0, 0.0, 1.05))
    ball = bpy.context.object
    ball.name = "Ball"
    for polygon in ball.data.polygons:
        polygon.use_smooth = True
    color = tuple(chance.uniform(0.1, 0.9) for _ in range(3))
    _give(ball, "Ball", {"Base Color": color, "Roughness": chance.uniform(0.15, 0.5), "Metallic": chance.random()})
    if context in WORLDS:
        bpy.data.objects.remove(wall)
        scene.world = world = bpy.data.worlds.new("World")
        if world.node_tree is None:
            world.use_nodes = True
        WORLDS[context](
            Nodes(world.node_tree, chance), next(n for n in world.node_tree.nodes if n.type == "BACKGROUND")
        )
    else:
        _light(scene, "AREA", energy=400.0, shape="RECTANGLE", size=2.5, size_y=2.0)
        SURFACES[context](chance, floor, wall)
    return ball


class Nodes:
    """Short words for building node trees."""

    def __init__(self, tree: Any, chance: Random) -> None:
        self.tree, self.chance = tree, chance

    def new(self, kind: str, **inputs: Any) -> Any:
        """A node with the given inputs (spaces as underscores): values, or outputs to link."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in inputs.items():
            socket = node.inputs[int(name[1:]) if name[0] == "i" and name[1:].isdigit() else name.replace("_", " ")]
            if hasattr(value, "is_output"):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node

    def link(self, source: Any, target: Any) -> None:
        """Link two sockets."""
        self.tree.links.new(source, target)

    def color(self) -> tuple[float, float, float, float]:
        """A random colour."""
        red, green, blue = (self.chance.uniform(0.05, 0.95) for _ in range(3))
        return red, green, blue, 1.0

    def ramp(self, fac: Any) -> Any:
        """A ramp between three random colours; returns its colour output."""
        node = self.new("ValToRGB", Fac=fac)
        stops = node.color_ramp.elements
        stops[0].position, stops[1].position = self.chance.uniform(0.2, 0.4), self.chance.uniform(0.6, 0.8)
        stops[0].color, stops[1].color = self.color(), self.color()
        stops.new(0.5).color = self.color()
        return node.outputs["Color"]

    @property
    def output(self) -> Any:
        """The tree's output node."""
        return self.tree.get_output_node("CYCLES")


def sky_picture() -> Any:
    """A smooth float picture with a bright part."""
    import bpy
    import numpy as np

    v, u = np.meshgrid((np.arange(64) + 0.5) / 64, (np.arange(128) + 0.5) / 128, indexing="ij")
    glow = 6.0 * np.exp(-((u - 0.3) ** 2 + (v - 0.75) ** 2) / 0.005)
    pixels = np.stack([0.3 + 0.2 * v + glow, 0.3 + 0.4 * u + glow, 0.9 - 0.3 * v + glow, np.ones_like(u)], -1)
    image = bpy.data.images.new("Sky", 128, 64, float_buffer=True)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    return image


def _environment(nodes: Nodes) -> Any:
    node = nodes.new("TexEnvironment")
    node.image = sky_picture()
    return node.outputs["Color"]


def _curves(nodes: Nodes, background: Any) -> None:
    saturated = nodes.new(
        "HueSaturation", Saturation=1.6, Hue=nodes.chance.uniform(0.4, 0.6), Color=_environment(nodes)
    )
    curves = nodes.new("RGBCurve", Color=saturated.outputs[0])
    curves.mapping.curves[3].points.new(0.5, 0.4)
    curves.mapping.update()
    nodes.link(curves.outputs[0], background.inputs["Color"])


def _seen_apart(nodes: Nodes, background: Any) -> None:
    nodes.link(_environment(nodes), background.inputs["Color"])
    other = nodes.new("Background", Color=nodes.color())
    camera = nodes.new("LightPath").outputs["Is Camera Ray"]
    mixed = nodes.new("MixShader", i0=camera, i1=background.outputs[0], i2=other.outputs[0])
    nodes.link(mixed.outputs[0], nodes.output.inputs["Surface"])


def _noise_world(nodes: Nodes, background: Any) -> None:
    coordinates = nodes.new("TexCoord").outputs["Generated"]
    noise = nodes.new("TexNoise", Vector=coordinates, Scale=nodes.chance.uniform(1.5, 3.0))
    nodes.link(nodes.ramp(noise.outputs[0]), background.inputs["Color"])


def _gradient_world(nodes: Nodes, background: Any) -> None:
    coordinates = nodes.new("TexCoord").outputs["Generated"]
    height = nodes.new("SeparateXYZ", Vector=coordinates).outputs["Z"]
    half = nodes.new("MapRange", Value=height, From_Min=-1.0)
    nodes.link(nodes.ramp(half.outputs[0]), background.inputs["Color"])
    background.inputs["Strength"].default_value = 1.3


def _sky(nodes: Nodes, background: Any) -> Any:
    sky = nodes.new("TexSky")
    sky.sun_elevation, sky.sun_rotation = nodes.chance.uniform(0.4, 1.0), nodes.chance.uniform(2.0, 4.0)
    nodes.link(sky.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.1
    return sky


def _sky_without_sun(nodes: Nodes, background: Any) -> None:
    _sky(nodes, background).sun_disc = False


def _sky_tinted(nodes: Nodes, background: Any) -> None:
    sky = _sky(nodes, background)
    nodes.link(nodes.new("Gamma", Color=sky.outputs[0], Gamma=0.8).outputs[0], background.inputs["Color"])


def _group_world(nodes: Nodes, background: Any) -> None:
    import bpy

    tree = bpy.data.node_groups.new("Sky", "ShaderNodeTree")
    tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    inner = Nodes(tree, nodes.chance)
    first, second = inner.new("Background", Color=_environment(inner)), inner.new("Background", Color=inner.color())
    added = inner.new("AddShader", i0=first.outputs[0], i1=second.outputs[0])
    inner.link(added.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    group = nodes.new("Group")
    group.node_tree = tree
    nodes.link(group.outputs[0], nodes.output.inputs["Surface"])


WORLDS: dict[str, Callable[[Nodes, Any], Any]] = {
    "world curves": _curves,
    "world seen apart": _seen_apart,
    "world noise": _noise_world,
    "world gradient": _gradient_world,
    "sky with sun": _sky,
    "sky without sun": _sky_without_sun,
    "sky tinted": _sky_tinted,
    "world group": _group_world,
}


def _nodes(item: Any, chance: Random) -> tuple[Nodes, Any]:
    """The nodes of an object's material and its Principled node."""
    tree = item.data.materials[0].node_tree
    return Nodes(tree, chance), next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")


def _noise_ramp(chance: Random, floor: Any, _wall: Any) -> None:
    nodes, principled = _nodes(floor, chance)
    coordinates = nodes.new("TexCoord").outputs["Generated"]
    noise = nodes.new("TexNoise", Vector=coordinates, Scale=chance.uniform(3.0, 6.0))
    nodes.link(nodes.ramp(noise.outputs[0]), principled.inputs["Base Color"])


def _checker(chance: Random, floor: Any, _wall: Any) -> None:
    nodes, principled = _nodes(floor, chance)
    place = nodes.new("NewGeometry").outputs["Position"]
    checker = nodes.new("TexChecker", Vector=place, Color1=nodes.color(), Color2=nodes.color(), Scale=1.0)
    nodes.link(checker.outputs["Color"], principled.inputs["Base Color"])


def _bricks(chance: Random, _floor: Any, wall: Any) -> None:
    nodes, principled = _nodes(wall, chance)
    mapped = nodes.new("Mapping", Vector=nodes.new("TexCoord").outputs["UV"], Scale=(2.0, 2.0, 2.0))
    bricks = nodes.new("TexBrick", Vector=mapped.outputs[0], Color1=nodes.color(), Color2=nodes.color())
    nodes.link(bricks.outputs["Color"], principled.inputs["Base Color"])
    rough = nodes.new("MapRange", Value=bricks.outputs[1], To_Min=0.2, To_Max=0.9)
    nodes.link(rough.outputs[0], principled.inputs["Roughness"])


def _metal_floor(chance: Random, floor: Any, _wall: Any) -> None:
    nodes, principled = _nodes(floor, chance)
    cells = nodes.new("TexVoronoi", Vector=nodes.new("TexCoord").outputs["Object"], Scale=1.2)
    rough = nodes.new("MapRange", Value=cells.outputs["Distance"], To_Min=0.3, To_Max=0.7)
    nodes.link(rough.outputs[0], principled.inputs["Roughness"])
    nodes.link(cells.outputs["Color"], principled.inputs["Base Color"])
    principled.inputs["Metallic"].default_value = 1.0


def _mixed(chance: Random, floor: Any, _wall: Any) -> None:
    nodes, principled = _nodes(floor, chance)
    principled.inputs["Base Color"].default_value = nodes.color()
    metal = nodes.new("BsdfPrincipled", Base_Color=nodes.color(), Metallic=1.0, Roughness=0.35)
    wave = nodes.new("TexNoise", Vector=nodes.new("TexCoord").outputs["Object"], Scale=1.0)
    steep = nodes.new("MapRange", Value=wave.outputs[0], From_Min=0.45, From_Max=0.55)
    mixed = nodes.new("MixShader", i0=steep.outputs[0], i1=principled.outputs[0], i2=metal.outputs[0])
    nodes.link(mixed.outputs[0], nodes.output.inputs["Surface"])


def _glow(chance: Random, _floor: Any, wall: Any) -> None:
    nodes, principled = _nodes(wall, chance)
    wave = nodes.new("TexWave", Vector=nodes.new("TexCoord").outputs["Generated"], Scale=2.0)
    glow = nodes.new("Emission", Color=nodes.color(), Strength=wave.outputs["Fac" if "Fac" in wave.outputs else 1])
    added = nodes.new("AddShader", i0=principled.outputs[0], i1=glow.outputs[0])
    nodes.link(added.outputs[0], nodes.output.inputs["Surface"])


def _matte_and_metal(chance: Random, floor: Any, wall: Any) -> None:
    for item in (floor, wall):
        nodes, _ = _nodes(item, chance)
        matte = nodes.new("BsdfDiffuse", Color=nodes.color(), Roughness=chance.uniform(0.0, 1.0))
        metal = nodes.new("BsdfMetallic", Base_Color=nodes.color(), Roughness=0.4)
        metal.fresnel_type = "F82"
        mixed = nodes.new("MixShader", i0=chance.uniform(0.2, 0.8), i1=matte.outputs[0], i2=metal.outputs[0])
        nodes.link(mixed.outputs[0], nodes.output.inputs["Surface"])


def _grouped(chance: Random, floor: Any, _wall: Any) -> None:
    import bpy

    nodes, principled = _nodes(floor, chance)
    tree = bpy.data.node_groups.new("Paint", "ShaderNodeTree")
    for name, direction, kind in (
        ("Scale", "INPUT", "NodeSocketFloat"),
        ("Base", "INPUT", "NodeSocketShader"),
        ("Shader", "OUTPUT", "NodeSocketShader"),
    ):
        tree.interface.new_socket(name, in_out=direction, socket_type=kind)
    inner = Nodes(tree, chance)
    given = tree.nodes.new("NodeGroupInput")
    noise = inner.new("TexNoise", Scale=given.outputs["Scale"], Vector=inner.new("TexCoord").outputs["Object"])
    paint = inner.new("BsdfPrincipled", Base_Color=inner.ramp(noise.outputs[0]), Roughness=0.4)
    mixed = inner.new("MixShader", i0=0.6, i1=given.outputs["Base"], i2=paint.outputs[0])
    inner.link(mixed.outputs[0], tree.nodes.new("NodeGroupOutput").inputs[0])
    group = nodes.new("Group")
    group.node_tree = tree
    group.inputs["Scale"].default_value = 1.5
    nodes.link(principled.outputs[0], group.inputs["Base"])
    nodes.link(group.outputs[0], nodes.output.inputs["Surface"])


def _bumped(chance: Random, floor: Any, wall: Any) -> None:
    for item in (floor, wall):
        nodes, principled = _nodes(item, chance)
        noise = nodes.new("TexNoise", Vector=nodes.new("TexCoord").outputs["Object"], Scale=1.5)
        bump = nodes.new("Bump", Height=noise.outputs[0], Strength=0.6, Distance=0.4)
        nodes.link(bump.outputs[0], principled.inputs["Normal"])
        principled.inputs["Roughness"].default_value = 0.35


def _normal_map(chance: Random, _floor: Any, wall: Any) -> None:
    nodes, principled = _nodes(wall, chance)
    cells = nodes.new("TexNoise", Vector=nodes.new("TexCoord").outputs["UV"], Scale=6.0)
    tilted = nodes.new("MixRGB", i0=0.35, i1=(0.5, 0.5, 1.0, 1.0), i2=cells.outputs["Color"])
    normal = nodes.new("NormalMap", Color=tilted.outputs[0])
    nodes.link(normal.outputs[0], principled.inputs["Normal"])
    principled.inputs["Metallic"].default_value = 0.8


def _displaced(method: str, size: float) -> Callable[[Random, Any, Any], None]:
    """Floor and wall with the height of a noise on Displacement, over a grid where that moves faces."""

    def build(chance: Random, floor: Any, wall: Any) -> None:
        for item in (floor, wall):
            nodes, principled = _nodes(item, chance)
            noise = nodes.new("TexNoise", Vector=nodes.new("TexCoord").outputs["Object"], Scale=1.5)
            moved = nodes.new("Displacement", Height=noise.outputs[0], Midlevel=0.5, Scale=size)
            nodes.link(moved.outputs[0], nodes.output.inputs["Displacement"])
            principled.inputs["Roughness"].default_value = 0.35
            item.data.materials[0].displacement_method = method
            if method != "BUMP":
                grid = item.modifiers.new("Grid", "SUBSURF")
                grid.subdivision_type, grid.levels, grid.render_levels = "SIMPLE", 6, 6

    return build


def _holes(chance: Random, _floor: Any, wall: Any) -> None:
    nodes, principled = _nodes(wall, chance)
    wall.location.y = 2.0
    checker = nodes.new("TexChecker", Vector=nodes.new("NewGeometry").outputs["Position"], Scale=1.0)
    holes = nodes.new("BsdfTransparent")
    mixed = nodes.new("MixShader", i0=checker.outputs[1], i1=principled.outputs[0], i2=holes.outputs[0])
    nodes.link(mixed.outputs[0], nodes.output.inputs["Surface"])


def _attribute(chance: Random, floor: Any, _wall: Any) -> None:
    nodes, principled = _nodes(floor, chance)
    colors = floor.data.color_attributes.new("Paint", "FLOAT_COLOR", "CORNER")
    for entry in colors.data:
        entry.color = nodes.color()
    attribute = nodes.new("Attribute")
    attribute.attribute_name = "Paint"
    nodes.link(attribute.outputs["Color"], principled.inputs["Base Color"])


def _missing_image(chance: Random, floor: Any, _wall: Any) -> None:
    import bpy

    nodes, principled = _nodes(floor, chance)
    picture = nodes.new("TexImage")
    picture.image = bpy.data.images.new("Lost", 8, 8)
    picture.image.source, picture.image.filepath = "FILE", "//no_such_file.png"
    half = nodes.new("MixRGB", i0=0.5, i1=picture.outputs[0], i2=nodes.color())
    nodes.link(half.outputs[0], principled.inputs["Base Color"])


SURFACES: dict[str, Callable[[Random, Any, Any], None]] = {
    "noise floor": _noise_ramp,
    "checker floor": _checker,
    "brick wall": _bricks,
    "metal floor": _metal_floor,
    "mixed floor": _mixed,
    "glowing wall": _glow,
    "matte and metal": _matte_and_metal,
    "group floor": _grouped,
    "bumped": _bumped,
    "normal map wall": _normal_map,
    "displaced by bump": _displaced("BUMP", 0.3),
    "displaced": _displaced("DISPLACEMENT", 0.4),
    "displaced and bumped": _displaced("BOTH", 0.4),
    "wall with holes": _holes,
    "painted floor": _attribute,
    "missing image": _missing_image,
}


def main() -> None:
    """Build, export, render."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("context", choices=[*WORLDS, *SURFACES])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--samples", type=int, default=256)
    chosen = parser.parse_args()
    import bpy

    from blender_addon.export.job import export_job

    ball = build(chosen.context, chosen.seed, chosen.size)
    scene = bpy.context.scene
    scene.cycles.samples = chosen.samples
    for seed in range(2):
        scene.cycles.seed = seed
        scene.render.filepath = str(chosen.folder / f"cycles_{seed}.exr")
        bpy.ops.render.render(write_still=True)
    reference = chosen.folder / "cycles_0.exr"
    job = export_job(bpy.context, ball, chosen.folder / "job", reference=reference, fit={})
    print("\n" + json.dumps({"notes": job.notes}))


if __name__ == "__main__":
    main()
