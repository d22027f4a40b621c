# SPDX-License-Identifier: Apache-2.0
"""Prints pictures with alpha of which the export has other colours than this Cycles, and how many it tried.

Run by a Blender in the background. A plane glows with each of them: of every format, alpha mode and colour space that
Blender saves, packed and not, with the node's Alpha linked and not.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from blender_addon.export.images.image_filter import filtered_pixels

FORMATS = (
    ("PNG", "8"),
    ("PNG", "16"),
    ("TIFF", "8"),
    ("TIFF", "16"),
    ("WEBP", "8"),
    ("TARGA", "8"),
    ("OPEN_EXR", "32"),
)
MODES = ("STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE")
LIMIT = 6e-3  # of half floats and of bytes, and far below what any wrong use of alpha changes


def main() -> None:
    """Try all of them."""
    folder = Path(tempfile.mkdtemp())
    scene = plane()
    wrong, count = [], 0
    for (kind, depth), mode, space, is_packed, alpha_read in itertools.product(
        FORMATS, MODES, ("sRGB", "Non-Color"), (False, True), (False, True)
    ):
        image = bpy.data.images.load(saved(scene, folder, kind, depth), check_existing=False)
        image.colorspace_settings.name, image.alpha_mode = space, mode
        if is_packed:
            image.pack()
        theirs = glow(scene, folder, image, alpha_read)
        ours = filtered_pixels(image, "Linear", "repeat", alpha_read=alpha_read)[1, 1, :3]
        count += 1
        if np.abs(theirs - ours).max() > LIMIT:
            wrong.append((kind, depth, mode, space, is_packed, alpha_read, theirs.round(3).tolist(), ours.tolist()))
        bpy.data.images.remove(image)
    print(f"WRONG {wrong} of {count}")


def plane() -> bpy.types.Scene:
    """A plane that fills the frame and glows with an Image Texture."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    render = scene.render
    render.engine, render.resolution_x, render.resolution_y = "CYCLES", 8, 8
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.device = 4, False, "CPU"
    scene.view_settings.view_transform = "Raw"
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "IMAGE"
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location = (0.0, 0.0, 3.0)
    scene.collection.objects.link(scene.camera)
    bpy.ops.mesh.primitive_plane_add(size=10.0)
    material = bpy.data.materials.new("Glow")
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    assert tree is not None
    tree.nodes.clear()
    names = ("ShaderNodeOutputMaterial", "ShaderNodeEmission", "ShaderNodeTexImage", "ShaderNodeMath")
    output, glow, picture, one = (tree.nodes.new(name) for name in names)
    tree.links.new(glow.outputs[0], output.inputs[0])
    tree.links.new(picture.outputs["Color"], glow.inputs["Color"])
    one.operation, one.inputs[1].default_value, one.inputs[2].default_value = "MULTIPLY_ADD", 0.0, 1.0
    tree.links.new(one.outputs[0], glow.inputs["Strength"])
    bpy.context.object.data.materials.append(material)
    return scene


def glow(scene: bpy.types.Scene, folder: Path, image: bpy.types.Image, alpha_read: bool) -> np.ndarray:
    """What Cycles makes of an image's colour."""
    tree = bpy.data.materials["Glow"].node_tree
    assert tree is not None
    picture = next(node for node in tree.nodes if node.type == "TEX_IMAGE")
    one = next(node for node in tree.nodes if node.type == "MATH")
    picture.image = image
    for link in [link for link in tree.links if link.to_node == one]:
        tree.links.remove(link)
    one.inputs[0].default_value = 0.0
    if alpha_read:
        tree.links.new(picture.outputs["Alpha"], one.inputs[0])
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    scene.render.filepath = str(folder / "render.exr")
    bpy.ops.render.render(write_still=True)
    shown = bpy.data.images.load(scene.render.filepath, check_existing=False)
    shown.colorspace_settings.name = "Non-Color"
    numbers = np.array(shown.pixels[:]).reshape(8, 8, 4)[4, 4, :3]
    bpy.data.images.remove(shown)
    return numbers


def saved(scene: bpy.types.Scene, folder: Path, kind: str, depth: str) -> str:
    """A file of one colour at an alpha of a half."""
    path = folder / f"{kind}_{depth}"
    if path.exists():
        return str(path)
    image = bpy.data.images.new("made", 4, 4, alpha=True, float_buffer=depth != "8")
    image.pixels.foreach_set(np.full((16, 4), (0.6, 0.4, 0.2, 0.5), np.float32).ravel())
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth, settings.quality = kind, "RGBA", depth, 100
    image.save_render(str(path))
    bpy.data.images.remove(image)
    return str(path)


main()
