# SPDX-License-Identifier: Apache-2.0
"""Lay the scene's own render over the camera's view with the mouse, and look at the screen's pixels.

Split, the line must not be seen; subtracted, all of the frame must be the one grey. A scene that is then brighter must
be brighter on the right of the line, and the difference lighter. In Cycles and EEVEE, under AgX.
"""

import importlib
import os
import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

sys.path.append(str(Path(__file__).parent.parent))
import steps
from desktop import from_disk
from hand import SCREEN_HEIGHT, area, click, drag, find, move, side_bar, view, widen, window

addon_id, folder = sys.argv[sys.argv.index("--") + 1 :]
folder = Path(folder)
bpy.context.preferences.view.show_splash = False
NEUTRAL = importlib.import_module(f"{addon_id}.blender_addon.pictures.view_paint").NEUTRAL
ENGINES = ("CYCLES", "BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT")
LOOK, PATIENCE = 2.0, 60.0  # seconds between two looks at a view, and until it has to be at rest
WIDTH, HEIGHT = 320, 240  # of the picture
CUT = 6  # pixels beside the line and along the frame, which Blender draws over them
BRIGHTER = 1.3
OFF = 0.01  # of a display value: half a level each of the reference, the paint, its opacity and the screen


def background():
    return next(n for n in bpy.context.scene.world.node_tree.nodes if n.type == "BACKGROUND")


def light_the_world(strength):
    background().inputs[1].default_value = strength
    bpy.context.scene.world.update_tag()
    area().tag_redraw()


def scene_of_colours(engine):
    """Two emitting faces before a world of a third colour: the same in every engine, and without noise."""
    scene = bpy.context.scene
    for obj in [o for o in bpy.data.objects if o.type != "CAMERA"]:
        bpy.data.objects.remove(obj)
    scene.render.engine, scene.render.dither_intensity = engine, 0.0
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.exposure = 0.5
    scene.world = scene.world or bpy.data.worlds.new("World")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    background().inputs[0].default_value = (0.05, 0.1, 0.3, 1.0)
    camera = scene.camera
    camera.location, camera.rotation_euler = (0.0, 0.0, 5.0), (0.0, 0.0, 0.0)
    for x, colour in ((-0.9, (0.8, 0.2, 0.1, 1.0)), (0.9, (0.02, 0.03, 0.02, 1.0))):
        bpy.ops.mesh.primitive_plane_add(size=1.2, location=(x, 0.0, 0.0))
        material = bpy.data.materials.new("Light")
        if material.node_tree is None:
            material.use_nodes = True
        nodes = material.node_tree.nodes
        nodes.clear()
        light, out = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
        light.inputs[0].default_value = colour
        material.node_tree.links.new(light.outputs[0], out.inputs[0])
        bpy.context.object.data.materials.append(material)


def render(name):
    scene = bpy.context.scene
    scene.render.filepath = str(folder / name)
    if hasattr(scene.render.image_settings, "media_type"):
        scene.render.image_settings.media_type = "IMAGE"
    scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "RGB"
    scene.cycles.samples, scene.cycles.use_denoising = 4, False
    bpy.ops.render.render(write_still=True)
    return scene.render.filepath


def screen(path):
    """Display values of the screen's pixels, first row below."""
    subprocess.run(["import", "-window", "root", str(path)], check=True)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.array(image.pixels[:], np.float32).reshape(image.size[1], image.size[0], -1)[..., :3]
    bpy.data.images.remove(image)
    return pixels


def frame(name, unlike=None):
    """What is inside the camera's frame, once it rests; `unlike`: an earlier one that it has to differ from."""
    move(side_bar().x + 10, side_bar().y + 10)
    place = Path(os.environ.get("MFO_SCREENSHOTS", folder))
    path, last = place / f"over_{bpy.app.version[0]}.{bpy.app.version[1]}_{name}.png", None
    for _ in range(int(PATIENCE / LOOK)):
        yield LOOK
        seen = in_frame(screen(path))
        is_new = unlike is None or np.quantile(np.abs(seen - unlike), 0.9) > 0.02
        if is_new and last is not None and np.quantile(np.abs(seen - last), 0.98) < OFF:  # edges go on
            return seen
        last = seen
    raise AssertionError(f"{name}: the view came to no rest within {PATIENCE} s")


def in_frame(pixels):
    """Those of the camera's frame without its edge."""
    camera, region = bpy.context.scene.camera, view()
    corners = [camera.matrix_world @ c for c in camera.data.view_frame(scene=bpy.context.scene)]
    seen = [location_3d_to_region_2d(region, area().spaces.active.region_3d, c) for c in corners]
    left, right = (round(f(c.x for c in seen)) + region.x + window().x for f in (min, max))
    low, high = (round(f(c.y for c in seen)) + region.y + window().y for f in (min, max))
    assert 0 <= left < right <= pixels.shape[1], (left, right)
    assert 0 <= low < high <= SCREEN_HEIGHT, (low, high)
    return pixels[low + CUT : high - CUT, left + CUT : right - CUT]


def press(words, part=0.3):
    place = []
    yield from find(words, place, part)
    yield from click(*place)


def inside(pixels):
    """Without the faces' edges, where filters differ."""
    steps = np.abs(np.diff(pixels, axis=1, prepend=pixels[:, :1])).max(axis=-1)
    steps = np.maximum(steps, np.abs(np.diff(pixels, axis=0, prepend=pixels[:1])).max(axis=-1))
    edges = steps > 0.04
    for _ in range(3):
        wide = edges.copy()
        for axis in (0, 1):
            for by in (-1, 1):
                wide |= np.roll(edges, by, axis)
        edges = wide
    return ~edges


def picture_in(place):
    """The render as the screen has it there: the nearest of its pixels."""
    image = bpy.data.images.load(bpy.context.scene.mfo.reference_path)
    image.colorspace_settings.name = "Non-Color"
    whole = np.array(image.pixels[:], np.float32).reshape(HEIGHT, WIDTH, -1)[..., :3]
    bpy.data.images.remove(image)
    rows, columns = ((np.arange(n) + CUT + 0.5) / (n + 2 * CUT) for n in place.shape[:2])
    return whole[(rows * HEIGHT).astype(int)][:, (columns * WIDTH).astype(int)]


def looks(name, pixels, expected, where):
    off = np.quantile(np.abs(pixels - expected).max(axis=-1)[where], 0.99)
    print(f"{name}: off by {off:.4f}", flush=True)
    assert off < OFF, (name, off)


def compared(engine):
    scene, space = bpy.context.scene, area().spaces.active
    mode = scene.mfo.overlay
    scene_of_colours(engine)
    space.shading.type, space.show_gizmo, space.overlay.show_overlays = "SOLID", False, True
    for what in ("extras", "outline_selected", "floor", "axis_x", "axis_y", "text", "object_origins", "cursor"):
        setattr(space.overlay, f"show_{what}", False)
    scene.mfo.reference_path = render(f"{engine}.png")
    yield 0.5
    yield from press("mfo.overlay_reference(")
    assert space.region_3d.view_perspective == "CAMERA"

    yield from press("overlay.mode", part=0.5)
    assert mode.mode == "SPLIT", mode.mode
    yield from press("wm.context_set_enum(")
    assert space.shading.type == "RENDERED"
    place = []
    yield from find("overlay.line", place, 0.5)
    yield from drag(place, (place[0] + 60, place[1]))
    assert 0.55 < mode.line < 0.9, mode.line
    alike = yield from frame(f"{engine}_split")
    where = inside(alike) & inside(picture_in(alike))
    middle = round(mode.line * alike.shape[1])
    where[:, middle - CUT : middle + CUT] = False
    looks(f"{engine} split", alike, picture_in(alike), where)
    light_the_world(BRIGHTER)
    brighter = yield from frame(f"{engine}_split_brighter", alike)
    changed = np.median((brighter - alike)[: HEIGHT // 10], axis=(0, 2))  # of the world below the faces
    assert np.abs(changed[: middle - CUT]).max() < 0.01, "the reference has changed"
    assert changed[middle + CUT :].min() > 0.02, "the scene has not changed"

    yield from press("overlay.mode", part=0.85)
    assert mode.mode == "DIFFERENCE", mode.mode
    lighter = yield from frame(f"{engine}_difference_brighter", brighter)
    assert np.median(lighter[: HEIGHT // 10]) > NEUTRAL + 0.01
    light_the_world(1.0)
    grey = yield from frame(f"{engine}_difference", lighter)
    looks(f"{engine} difference", grey, NEUTRAL, inside(grey))
    yield from press("mfo.overlay_reference(")
    assert not scene.camera.data.background_images
    mode.mode = "BLEND"


def story():
    with bpy.context.temp_override(window=window(), area=area(), region=view()):
        bpy.ops.screen.screen_full_area(use_hide_panels=False)
    yield 1.0
    yield from from_disk.side_bar_by_key()
    yield 0.8
    yield from widen(400)
    for engine in ENGINES:
        yield from compared(engine)
    print("ALL GOOD over the view", flush=True)


steps.take(story())
