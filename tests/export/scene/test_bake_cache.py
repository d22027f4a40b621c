# SPDX-License-Identifier: Apache-2.0
"""Bakes are kept by what they hang on: any change of it is another key, and what cannot be told has none."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.bake.bake_cache import cached
from blender_addon.bake.bake_key import surface_key, world_key

from ..scenes import add_camera, add_quad, new_material, world_color


def image(tmp: Path) -> Any:
    made = bpy.data.images.new("Picture", 4, 4)
    made.filepath_raw, made.file_format = str(tmp / "picture.png"), "PNG"
    made.pixels.foreach_set(np.full(64, 0.5, np.float32))
    made.save()
    made.source = "FILE"
    return made


@pytest.fixture
def ball(scene: Any, tmp_path: Path) -> Any:
    """A ball whose material has a ramp, a group, a picture and an attribute."""
    world_color(scene, 1.0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=4)
    item = bpy.context.object
    item.name = "Ball"
    item.data.attributes.new("Wear", "FLOAT", "POINT")
    item.data.materials.append(new_material("Ball"))
    tree = item.data.materials[0].node_tree
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    ramp, noise, out = (group.nodes.new(k) for k in ("ShaderNodeValToRGB", "ShaderNodeTexNoise", "NodeGroupOutput"))
    group.links.new(noise.outputs[0], ramp.inputs[0])
    group.links.new(ramp.outputs[0], out.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    texture, curves, wear = (tree.nodes.new(f"ShaderNode{k}") for k in ("TexImage", "RGBCurve", "Attribute"))
    texture.image, wear.attribute_name = image(tmp_path), "Wear"
    tree.links.new(texture.outputs[0], curves.inputs["Color"])
    tree.links.new(node.outputs[0], principled.inputs["Base Color"])
    tree.links.new(curves.outputs[0], principled.inputs["Roughness"])
    tree.links.new(wear.outputs["Fac"], principled.inputs["Metallic"])
    return item


def tree_of(item: Any) -> Any:
    return item.data.materials[0].node_tree


def node(item: Any, kind: str) -> Any:
    inner = bpy.data.node_groups["Inner"].nodes
    return next(n for n in [*tree_of(item).nodes, *inner] if n.bl_idname == f"ShaderNode{kind}")


def key_of(item: Any, size: int = 64, rays: str = "scattered") -> str | None:
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for instance in depsgraph.object_instances:
        if instance.object.original == item:
            return surface_key(scene, instance, depsgraph, 0, size, rays)
    raise AssertionError


def move_vertex(item: Any) -> None:
    item.data.vertices[3].co.x += 1e-3


def move_uv(item: Any) -> None:
    item.data.uv_layers[0].uv[5].vector.x += 1e-3


def repaint(item: Any) -> None:
    node(item, "TexImage").image.pixels[1] = 0.25  # not saved


def other_file(item: Any) -> None:
    """Another file under the same name, which this Blender has not read."""
    path = Path(node(item, "TexImage").image.filepath_raw)
    other = bpy.data.images.new("Other", 4, 4)
    other.filepath_raw, other.file_format = str(path), "PNG"
    other.save()
    bpy.data.images.remove(other)


def curve(item: Any) -> None:
    node(item, "RGBCurve").mapping.curves[3].points[0].location.y = 0.1


def unlink(item: Any) -> None:
    tree_of(item).links.remove(tree_of(item).links[0])


def smooth(item: Any) -> None:
    for polygon in item.data.polygons:
        polygon.use_smooth = True


def color_space(item: Any) -> None:
    node(item, "TexImage").image.colorspace_settings.name = "Non-Color"


def shrink_textures(_item: Any) -> None:
    scene = bpy.context.scene
    scene.render.use_simplify, scene.cycles.texture_limit_render = True, "128"


CHANGES: dict[str, Callable[[Any], Any]] = {
    "a stop": lambda i: setattr(node(i, "ValToRGB").color_ramp.elements[0], "position", 0.1),
    "its colour": lambda i: setattr(node(i, "ValToRGB").color_ramp.elements[1], "color", (1.0, 0.0, 0.0, 1.0)),
    "a socket in a group": lambda i: setattr(node(i, "TexNoise").inputs["Scale"], "default_value", 5.5),
    "a setting of a node": lambda i: setattr(node(i, "TexImage"), "interpolation", "Closest"),
    "a curve": curve,
    "a muted node": lambda i: setattr(node(i, "RGBCurve"), "mute", True),
    "a link": unlink,
    "its other end": lambda i: tree_of(i).links.new(
        node(i, "Attribute").outputs["Alpha"], node(i, "BsdfPrincipled").inputs["Metallic"]
    ),
    "painted pixels": repaint,
    "a file": other_file,
    "a colour space": color_space,
    "a vertex": move_vertex,
    "UV": move_uv,
    "an attribute": lambda i: setattr(i.data.attributes["Wear"].data[2], "value", 0.5),
    "normals": smooth,
    "a modifier": lambda i: setattr(i.modifiers.new("Wave", "SOLIDIFY"), "thickness", 0.1),
    "textures read smaller": shrink_textures,
    "its place": lambda i: setattr(i, "location", (0.0, 0.0, 0.1)),
    "a number of the shader": lambda i: setattr(node(i, "BsdfPrincipled").inputs["IOR"], "default_value", 1.4),
}


@pytest.mark.parametrize("change", CHANGES)
def test_each_change_is_another_key(ball: Any, change: str) -> None:
    before = key_of(ball)
    assert before is not None
    assert key_of(ball) == before
    CHANGES[change](ball)
    assert key_of(ball) not in (before, None)


def test_the_size_and_what_does_not_count(ball: Any) -> None:
    before = key_of(ball)
    assert key_of(ball, 128) != before
    assert key_of(ball, rays="glossy") != before
    node(ball, "ValToRGB").location.x += 10.0
    node(ball, "TexNoise").label = "Rust"
    bpy.context.scene.frame_set(7)
    assert key_of(ball) == before


def animate(item: Any) -> None:
    node(item, "TexNoise").inputs["Scale"].keyframe_insert("default_value")


def other_object(item: Any) -> None:
    tree_of(item).nodes.new("ShaderNodeTexCoord").object = bpy.data.objects.new("Empty", None)


def linked(kind: str, output: str) -> Callable[[Any], None]:
    def put(item: Any) -> None:
        tree = tree_of(item)
        tree.links.new(tree.nodes.new(f"ShaderNode{kind}").outputs[output], node(item, "BsdfPrincipled").inputs["IOR"])

    return put


def test_what_is_painted_next_is_another_key_again(ball: Any) -> None:
    repaint(ball)
    before = key_of(ball)
    node(ball, "TexImage").image.pixels[1] = 0.75
    assert key_of(ball) not in (before, None)


def test_a_neighbour_that_moves_faces_in_another_way_is_another_key(ball: Any) -> None:
    other = new_material("Other")
    ball.data.materials.append(other)
    moved = other.node_tree.nodes.new("ShaderNodeDisplacement")
    other.node_tree.links.new(moved.outputs[0], other.node_tree.get_output_node("CYCLES").inputs["Displacement"])
    keys = set()
    for method in ("BUMP", "DISPLACEMENT", "BOTH"):
        other.displacement_method = method
        keys.add(key_of(ball))
    moved.inputs["Height"].default_value = 0.7
    assert len({*keys, key_of(ball)} - {None}) == 4


@pytest.mark.parametrize("swapped", ["outputs", "inputs"])
def test_two_links_that_change_places_are_another_key(ball: Any, swapped: str) -> None:
    """The same sockets are linked, each to the other's end."""
    tree, shader, attribute = tree_of(ball), node(ball, "BsdfPrincipled"), node(ball, "Attribute")
    outputs = [attribute.outputs[name] for name in ("Fac", "Alpha")]
    inputs = [shader.inputs[name] for name in ("Coat Weight", "Sheen Weight")]
    keys = set()
    for _ in range(2):
        links = [tree.links.new(*ends) for ends in zip(outputs, inputs, strict=True)]
        keys.add(key_of(ball))
        for link in links:
            tree.links.remove(link)
        {"outputs": outputs, "inputs": inputs}[swapped].reverse()
    assert len(keys) == 2


UNSURE: dict[str, Callable[[Any], Any]] = {
    "animation": animate,
    "animation of the material": lambda i: i.data.materials[0].keyframe_insert("pass_index"),
    "another object": other_object,
    "the view": linked("LayerWeight", "Facing"),
    "its place": linked("ObjectInfo", "Random"),
    "the camera": lambda i: setattr(tree_of(i).nodes.new("ShaderNodeVectorTransform"), "convert_to", "CAMERA"),
    "what is around": linked("AmbientOcclusion", "AO"),
    "a sequence": lambda i: setattr(node(i, "TexImage").image, "source", "SEQUENCE"),
    "a vertex group": lambda i: i.vertex_groups.new(name="Wear"),
    "a property": lambda i: setattr(node(i, "Attribute"), "attribute_type", "OBJECT"),
}


@pytest.mark.parametrize("case", UNSURE)
def test_what_cannot_be_told_has_no_key(ball: Any, case: str) -> None:
    UNSURE[case](ball)
    assert key_of(ball) is None


def test_a_world_has_a_key_too(scene: Any) -> None:
    world_color(scene, 1.0)
    tree: Any = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    tree.links.new(sky.outputs[0], next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Color"])
    before = world_key(scene, 1024)
    assert before is not None
    assert world_key(scene, 1024) == before
    assert world_key(scene, 2048) != before
    sky.sun_rotation = 0.5
    assert world_key(scene, 1024) not in (before, None)


def bake_into(place: Path, number: float) -> dict[str, Any]:
    np.save(place / "001.npy", np.full(1000, number, np.float32))
    return {"leaves": [number]}


def cut(entry: Path) -> None:
    """As after a loss of power."""
    with (entry / "001.npy").open("r+b") as file:
        file.truncate(1000)


def flip(entry: Path) -> None:
    content = bytearray((entry / "001.npy").read_bytes())
    content[2000] ^= 4
    (entry / "001.npy").write_bytes(content)


def empty_answer(entry: Path) -> None:
    (entry / "answer.json").write_text("{")


def other_answer(entry: Path) -> None:
    text = (entry / "answer.json").read_text()
    (entry / "answer.json").write_text(text.replace('"leaves": [8', '"leaves": [9'))


def test_the_oldest_go_and_what_was_cut_off_is_no_hit(tmp_path: Path) -> None:
    cache, places = tmp_path / "cache", iter(range(100))

    def ask(key: str, number: float, most: int = 10_000) -> float:
        place = tmp_path / f"place_{next(places)}"
        place.mkdir()
        answer = cached(cache, key * 64, place, lambda: bake_into(place, number), most)
        assert np.load(place / "001.npy")[0] == answer["leaves"][0]
        return answer["leaves"][0]

    assert ask("a", 1.0) == 1.0
    assert ask("a", 2.0) == 1.0
    assert ask("b", 3.0) == 3.0
    os.utime(cache / ("a" * 64), (time.time() - 9.0,) * 2)
    os.utime(cache / ("b" * 64), (time.time() - 20.0,) * 2)
    ask("a", 9.0)  # is used, so it stays
    (cache / ".999999999.left").mkdir()  # of a process that was killed
    ask("c", 4.0, most=9_000)
    assert sorted(path.name[0] for path in cache.iterdir()) == ["a", "c"]
    (cache / ("a" * 64) / "001.npy").unlink()
    assert (ask("a", 5.0), ask("a", 0.0)) == (5.0, 5.0)  # half of an entry is none, and is made whole
    for number, damage in enumerate((cut, flip, empty_answer, other_answer), 6):
        damage(cache / ("c" * 64))
        assert (ask("c", number), ask("c", 0.0)) == (number, number), damage
    shutil.rmtree(cache)
    cache.write_text("a file")
    assert ask("a", 7.0) == 7.0


BAKE = """
import sys, time, shutil
from pathlib import Path
import numpy as np
from blender_addon.bake import bake_cache
cache, place, number, hangs = Path(sys.argv[1]), Path(sys.argv[2]), float(sys.argv[3]), sys.argv[4] == "hangs"
place.mkdir()
copy = shutil.copyfile
def slow(source, target):
    copy(source, target)
    while hangs:
        print("copied", flush=True)
        time.sleep(60.0)
    time.sleep(0.3)
bake_cache.shutil.copyfile = slow
def bake():
    for name in ("001.npy", "002.npy"):
        np.save(place / name, np.full(1000, number, np.float32))
    print("baked", flush=True)
    sys.stdin.readline()
    return {"leaves": [number]}
print(bake_cache.cached(cache, "a" * 64, place, bake)["leaves"][0], flush=True)
"""


def baking(tmp_path: Path, number: float, words: str = "") -> Any:
    """A process that has baked, and keeps the bake once it reads a line."""
    place = str(tmp_path / f"place_{number:g}")
    command = [sys.executable, "-c", BAKE, str(tmp_path / "cache"), place, str(number), words]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "baked\n"
    return process


def test_two_that_bake_the_same_at_once_leave_one_whole_entry(tmp_path: Path) -> None:
    both = [baking(tmp_path, number) for number in (1.0, 2.0)]
    for process in both:
        process.stdin.write("\n")
        process.stdin.flush()
    assert [process.communicate()[0] for process in both] == ["1.0\n", "2.0\n"]
    (kept,) = (tmp_path / "cache").iterdir()
    (tmp_path / "place").mkdir()
    (found,) = cached(tmp_path / "cache", kept.name, tmp_path / "place", pytest.fail)["leaves"]
    assert {np.load(path)[-1] for path in (tmp_path / "place").iterdir()} == {found}


@pytest.mark.skipif(os.name == "nt", reason="Windows cannot be asked for a process")
def test_one_that_is_killed_while_it_keeps_a_bake_leaves_none(tmp_path: Path) -> None:
    killed = baking(tmp_path, 1.0, "hangs")
    killed.stdin.write("\n")
    killed.stdin.flush()
    assert killed.stdout.readline() == "copied\n"
    assert len(list((tmp_path / "cache").glob("*/*.npy"))) == 1
    killed.kill()
    killed.communicate()
    (tmp_path / "place").mkdir()
    assert cached(tmp_path / "cache", "a" * 64, tmp_path / "place", lambda: bake_into(tmp_path / "place", 3.0)) == {
        "leaves": [3.0]
    }
    assert [path.name for path in (tmp_path / "cache").iterdir()] == ["a" * 64]


def test_the_second_export_takes_the_bake_of_the_first(
    ball: Any, export: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Told by a number written into what is kept."""
    from blender_addon.bake import bake_cache

    monkeypatch.setenv("MFO_BAKES", str(tmp_path / "cache"))
    add_camera("ORTHO", ortho_scale=4.0)
    target = add_quad("Target", 1.0, 1.5, new_material("Target"))

    def ior() -> float:
        materials = export(target).request["materials"]
        return next(v for k, v in materials.items() if k.startswith("baked"))["sockets"]["IOR"]["value"]

    assert ior() == 1.5
    (kept,) = (tmp_path / "cache").iterdir()
    text = (kept / "answer.json").read_text()
    assert '"IOR": 1.5' in text
    entry = json.loads(text.replace('"IOR": 1.5', '"IOR": 1.75'))
    entry["digest"] = bake_cache._digest(entry["answer"], {name: kept / name for name in entry["files"]})
    (kept / "answer.json").write_text(json.dumps(entry))
    assert ior() == 1.75
    node(ball, "BsdfPrincipled").inputs["Coat Weight"].default_value = 0.3
    assert ior() == 1.5
