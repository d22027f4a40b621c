# SPDX-License-Identifier: Apache-2.0
"""Pictures between their pixels and with alpha. Oracle: Cycles on an emitting plane that shows them."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import PIL.Image
import pytest

from blender_addon.export.files.exr_file import write_exr
from blender_addon.export.images.color_space import to_rec709
from blender_addon.export.images.image_filter import divides_by_nothing, filtered_pixels
from blender_addon.export.nodes.shader_graph import read_socket

from ..scenes import add_camera, add_quad, new_material, world_color

MODES = ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")


def picture(path: Path, size: int = 8, *, floats: bool = False) -> Any:
    """A file of random colours and two alphas below 1 on its right half, of 8 bits or of floats."""
    values = np.ones((size, size, 4), np.float32)
    values[..., :3] = np.random.default_rng(3).uniform(0.0, 1.0, (size, size, 3))
    values[:, size // 2 :, 3] = 0.5
    values[: size // 4, size // 2 :, 3] = 0.25
    image = bpy.data.images.new("made", size, size, alpha=True, float_buffer=floats)
    image.pixels.foreach_set(values.ravel())
    image.filepath_raw, image.file_format = str(path), "OPEN_EXR" if floats else "PNG"
    image.save()
    return bpy.data.images.load(str(path))


def shown_by_cycles(
    scene: Any, image: Any, interpolation: str, alpha_read: bool, render: Any, after: str = "", **values: Any
) -> np.ndarray:
    """What a plane that fills the frame glows with, perhaps by a node after the texture."""
    material = new_material("Target", Emission_Strength=1.0, Base_Color=(0, 0, 0), Specular_IOR_Level=0.0)
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation = image, interpolation
    principled = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    given = texture.outputs["Color"]
    if after:
        node = tree.nodes.new(after)
        for name, value in values.items():
            setattr(node, name, value)
        node.inputs[1].default_value = 3.0
        tree.links.new(given, node.inputs[0])
        given = node.outputs[0]
    tree.links.new(given, principled.inputs["Emission Color"])
    if alpha_read:
        tree.links.new(texture.outputs["Alpha"], principled.inputs["Roughness"])
    item = add_quad("Target", 2.0, 0.0, material)
    if not item.data.uv_layers:
        item.data.uv_layers.new()
    for loop, uv in zip(item.data.loops, item.data.uv_layers[0].data, strict=True):
        x, y, _ = item.data.vertices[loop.vertex_index].co
        uv.uv = (0.5 + 0.5 * x, 0.5 + 0.5 * y)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=2.0)
    scene.cycles.samples = 16
    return render()


def blocks(pixels: np.ndarray, count: int) -> np.ndarray:
    step = len(pixels) // count
    return pixels[:, :, :3].reshape(count, step, count, step, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("alpha_read", [False, True])
def test_colours_have_the_alpha_cycles_gives_them(
    mode: str, alpha_read: bool, scene: Any, render_cycles: Any, tmp_path: Path
) -> None:
    image = picture(tmp_path / "picture.png")
    image.alpha_mode = mode
    theirs = shown_by_cycles(scene, image, "Closest", alpha_read, render_cycles)
    ours = filtered_pixels(image, "Closest", "repeat", alpha_read=alpha_read)
    assert blocks(theirs, 8) == pytest.approx(blocks(ours, 8), abs=0.02)  # Cycles rounds to 8 bits in between


@pytest.mark.parametrize("mode", ["STRAIGHT", "PREMUL"])
@pytest.mark.parametrize("alpha_read", [False, True])
@pytest.mark.parametrize("packed", [False, True])
def test_floats_are_multiplied_as_cycles_takes_them(
    packed: bool, mode: str, alpha_read: bool, scene: Any, render_cycles: Any, tmp_path: Path
) -> None:
    """Of a file Straight means nothing to Cycles; of a packed one Blender has multiplied."""
    image = picture(tmp_path / "picture.exr", floats=True)
    if packed:
        image.pack()
    image.alpha_mode = mode
    theirs = shown_by_cycles(scene, image, "Closest", alpha_read, render_cycles)
    ours = filtered_pixels(image, "Closest", "repeat", alpha_read=alpha_read)
    assert blocks(theirs, 8) == pytest.approx(blocks(ours, 8), rel=2e-3)  # half floats; Straight was a quarter


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("alpha_read", [False, True])
@pytest.mark.parametrize("kind", ["PNG of 16 bits", "WebP", "straight TIFF of 16 bits", "multiplied TIFF of 8 bits"])
def test_a_file_says_itself_what_is_multiplied(
    kind: str, alpha_read: bool, mode: str, scene: Any, render_cycles: Any, tmp_path: Path
) -> None:
    """By OpenImageIO a PNG has straight colours however many bits it has, and a WebP multiplied ones."""
    image = bpy.data.images.load(str(saved(tmp_path, kind)))
    assert image.is_float == kind.endswith("16 bits")
    image.colorspace_settings.name, image.alpha_mode = "sRGB", mode
    theirs = shown_by_cycles(scene, image, "Closest", alpha_read, render_cycles)
    ours = filtered_pixels(image, "Closest", "repeat", alpha_read=alpha_read)
    assert blocks(theirs, 8) == pytest.approx(blocks(ours, 8), rel=4e-3, abs=1e-4)  # half floats of the file


def saved(folder: Path, kind: str) -> Path:
    """Random sRGB colours at alphas of 1, 0.502 and 0.251 as another program would write them."""
    numbers = np.full((8, 8, 4), 255, np.uint8)
    numbers[..., :3] = np.random.default_rng(3).integers(20, 256, (8, 8, 3))
    numbers[:, 4:, 3], numbers[:2, 4:, 3] = 128, 64
    path = folder / ("picture." + {"P": "png", "W": "webp"}.get(kind[0], "tif"))
    if kind == "WebP":
        PIL.Image.fromarray(numbers).save(path, lossless=True, exact=True)
    elif kind.startswith("PNG"):
        rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in numbers * np.uint16(257))
        size = struct.pack(">IIBBBBB", 8, 8, 16, 6, 0, 0, 0)
        parts = ((b"IHDR", size), (b"IDAT", zlib.compress(rows)), (b"IEND", b""))
        chunks = [struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in parts]
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))
    else:
        path.write_bytes(tiff(numbers * np.uint16(257), 2) if kind.startswith("straight") else tiff(numbers, 1))
    return path


def tiff(numbers: np.ndarray, extra: int) -> bytes:
    """An uncompressed picture in one strip; an `extra` of 2 says that its alpha is straight, 1 that it is not."""
    height, width, channels = numbers.shape
    data, bits = numbers.astype(numbers.dtype.newbyteorder("<")).tobytes(), 8 * numbers.itemsize
    of_bits = struct.pack("<4H", bits, bits, bits, bits)
    tags = [
        (256, 3, 1, width), (257, 3, 1, height), (258, 3, 4, 8), (259, 3, 1, 1), (262, 3, 1, 2),
        (273, 4, 1, 8 + len(of_bits)), (277, 3, 1, channels), (278, 3, 1, height), (279, 4, 1, len(data)),
        (338, 3, 1, extra),
    ]  # fmt: skip
    directory = struct.pack("<H", len(tags)) + b"".join(struct.pack("<HHII", *tag) for tag in tags) + bytes(4)
    return b"II*\0" + struct.pack("<I", 8 + len(of_bits) + len(data)) + of_bits + data + directory


def test_pictures_are_filtered_after_decoding_in_a_wide_working_space(
    scene: Any, render_cycles: Any, tmp_path: Path
) -> None:
    if not hasattr(getattr(bpy.data, "colorspace", None), "working_space"):
        pytest.skip("this Blender has one working space")
    bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=False)
    image = picture(tmp_path / "picture.png")
    image.alpha_mode = "NONE"
    theirs = to_rec709(shown_by_cycles(scene, image, "Linear", False, render_cycles))
    ours = filtered_pixels(image, "Linear", "repeat", alpha_read=False)
    seen = blocks(ours, 8).mean(axis=(0, 1))
    assert blocks(theirs, 8).mean(axis=(0, 1)) == pytest.approx(seen, rel=5e-3)  # before decoding 14 % darker


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("interpolation", ["Linear", "Cubic"])
def test_floats_in_srgb_are_filtered_as_they_are_stored(
    interpolation: str, packed: bool, scene: Any, render_cycles: Any, tmp_path: Path
) -> None:
    """Packed ones Cycles has from Blender, which has decoded them: they were 3.6 % too dark in places."""
    values = np.ones((8, 8, 4), np.float32)
    values[..., :3] = np.random.default_rng(3).uniform(0.0, 1.0, (8, 8, 3))
    image = bpy.data.images.new("made", 8, 8, float_buffer=True)
    image.pixels.foreach_set(values.ravel())
    image.filepath_raw, image.file_format = str(tmp_path / "picture.exr"), "OPEN_EXR"
    image.save()
    image = bpy.data.images.load(image.filepath_raw)
    image.colorspace_settings.name = "sRGB"
    if packed:
        image.pack()
    theirs = shown_by_cycles(scene, image, interpolation, False, render_cycles)
    ours = filtered_pixels(image, interpolation, "repeat", alpha_read=False, bends=True)  # on the finer grid, both
    assert blocks(theirs, 16) == pytest.approx(blocks(ours, 16), abs=0.015)


@pytest.mark.parametrize("interpolation", ["Linear", "Cubic"])
def test_hidden_colours_do_not_bleed_into_what_is_seen(
    interpolation: str, scene: Any, render_cycles: Any, tmp_path: Path
) -> None:
    """A leaf whose Alpha is read: Cycles weighs colours by alpha before it filters them."""
    image = picture(tmp_path / "picture.png")
    theirs = shown_by_cycles(scene, image, interpolation, True, render_cycles)
    ours = filtered_pixels(image, interpolation, "repeat", alpha_read=True)
    assert blocks(theirs, 16) == pytest.approx(blocks(ours, 16), abs=0.02)  # without alpha 0.22 and 0.19


@pytest.mark.parametrize("interpolation", ["Linear", "Cubic"])
@pytest.mark.parametrize("space", ["sRGB", "Non-Color"])
def test_between_pixels_it_is_cycles(
    interpolation: str, space: str, scene: Any, render_cycles: Any, tmp_path: Path
) -> None:
    image = picture(tmp_path / "picture.png")
    image.alpha_mode, image.colorspace_settings.name = "NONE", space
    theirs = shown_by_cycles(scene, image, interpolation, False, render_cycles)
    ours = filtered_pixels(image, interpolation, "repeat", alpha_read=False)
    if len(ours) == 8:  # linear numbers are left to Mitsuba
        assert (interpolation, space) == ("Linear", "Non-Color")
        return
    assert blocks(theirs, 16) == pytest.approx(blocks(ours, 16), abs=0.015)  # decoded before filtering 0.2


@pytest.mark.parametrize(
    ("after", "values"),
    [
        ("ShaderNodeGamma", {}),
        ("ShaderNodeMath", {"operation": "POWER"}),
        ("ShaderNodeMath", {"operation": "MULTIPLY", "use_clamp": True}),
    ],
)
def test_nodes_that_bend_numbers_see_interpolated_ones(
    after: str, values: dict[str, Any], scene: Any, render_cycles: Any, tmp_path: Path
) -> None:
    image = picture(tmp_path / "picture.png")
    image.alpha_mode, image.colorspace_settings.name = "NONE", "Non-Color"
    theirs = shown_by_cycles(scene, image, "Linear", False, render_cycles, after, **values)
    shader = bpy.data.materials["Target"].node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    texture = read_socket(shader.inputs["Emission Color"]).texture
    assert texture is not None
    assert blocks(theirs, 16) == pytest.approx(blocks(texture.pixels, 16), abs=0.015)  # bent before 0.2 and more


def glow_of_floats(path: Path, color: float) -> Any:
    """Random pixels with alpha 1, the others with alpha 0 and a colour all the same."""
    values = np.ones((8, 8, 4), np.float32)
    values[..., 3] = np.random.default_rng(5).random((8, 8)) < 0.6
    values[..., :3] = np.where(values[..., 3:] > 0.0, 0.5, color)
    write_exr(path, values)  # Blender before 5 encodes what it saves
    return bpy.data.images.load(str(path))


@pytest.mark.parametrize(
    ("color", "mode", "interpolation", "divides"),
    [
        (0.5, "PREMUL", "Linear", True),
        (0.5, "STRAIGHT", "Cubic", True),
        (0.0, "PREMUL", "Linear", False),
        (0.5, "PREMUL", "Closest", False),
        (0.5, "CHANNEL_PACKED", "Linear", False),
    ],
)
def test_colours_that_cycles_divides_by_nothing_are_named(
    color: float, mode: str, interpolation: str, divides: bool, scene: Any, render_cycles: Any, export: Any, tmp_path
) -> None:
    """No colour is above 0.5, and Cycles shows such as are."""
    image = glow_of_floats(tmp_path / "glow.exr", color)
    image.alpha_mode = mode
    shown = shown_by_cycles(scene, image, interpolation, True, render_cycles)
    assert (shown.max() > 0.6) == divides
    assert divides_by_nothing(image, interpolation) == divides
    target = bpy.data.objects["Target"]
    assert any("has colours where its alpha is 0" in note for note in export(target).notes) == divides


@pytest.mark.parametrize("wrap", ["REPEAT", "EXTEND", "MIRROR"])
@pytest.mark.parametrize("interpolation", ["Closest", "Linear"])
def test_all_of_a_mesh_without_a_map_shows_the_pixel_that_it_does_in_cycles(
    interpolation: str, wrap: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any, tmp_path: Path
) -> None:
    """It lies on an edge between pixels, where Closest had the row above the picture's lowest: the uppermost."""
    material = new_material("Target", Roughness=1.0, Specular_IOR_Level=0.0)
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image, texture.interpolation, texture.extension = picture(tmp_path / "picture.png"), interpolation, wrap
    texture.image.alpha_mode = "NONE"
    shader = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    tree.links.new(texture.outputs["Color"], shader.inputs["Base Color"])
    item = add_quad("Target", 2.0, 0.0, material)
    assert not item.data.uv_layers
    add_camera("ORTHO", (0, 0, 5), ortho_scale=1.0)
    world_color(scene, 1.0)
    scene.cycles.samples = 16
    expected, found = render_cycles().mean(axis=(0, 1)), render_mitsuba(export(item)).mean(axis=(0, 1))
    np.testing.assert_allclose(found, expected, rtol=0.03, atol=0.005)
