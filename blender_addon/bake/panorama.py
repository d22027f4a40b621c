# SPDX-License-Identifier: GPL-3.0-or-later
"""A world of any nodes as an equirectangular picture, rendered by the Blender this runs in.

The picture is laid out as an Environment Texture: +X in its middle, +Z at its top. Discs of suns in Sky Textures are a
pixel or two wide there; they come back apart, measured through a narrow lens.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ..probe.light_path import CAMERA, SCATTERED, answer_light_paths, light_path_outputs
from ..versions import active_output, node_tree_of
from .stage import copy_properties

Pixels = NDArray[np.float32]

LEAST_WIDTH, MOST_WIDTH = 1024, 4096  # pixels around
SAMPLES = {1024: 8, 2048: 4, 4096: 2}  # per pixel, by width
FINDING_SAMPLES = 4  # of the picture that finds a sun's disc
DISC_PIXELS = 64  # along each side of the picture that measures a sun's disc
DISC_SAMPLES = 16
DISC_MARGIN = 1.5  # field of view of that picture, in diameters of the disc
ALIKE = 1e-4  # largest difference, relative to the mean, of two panoramas that count as one


def world_panoramas(scene: bpy.types.Scene, folder: Path, width: int) -> dict[str, Any]:
    """Render the world of `scene` into `folder`; nothing of the file's own data changes.

    Returns ``light``, and where it differs ``camera``: names of .npy files with radiance (width / 2, width, 3), float32
    in Blender's working space; further ``suns``: direction to each, its irradiance on a plane that faces it and its
    angle in radians.
    """
    world = scene.world
    paths = light_path_outputs(node_tree_of(world))
    suns: list[dict[str, Any]] = []
    with _studio(scene) as studio:
        light = _panorama(studio, world, folder, width, SCATTERED)
        for number in range(len(_discs(node_tree_of(world)))):
            found = _sun(studio, world, folder, width, light, number)
            suns += [found] if found else []
        answer: dict[str, Any] = {"light": "light.npy", "suns": suns, "paths": sorted(paths)}
        if paths:
            camera = _panorama(studio, world, folder, width, CAMERA)
            if np.abs(camera - light).max() > ALIKE * max(float(np.abs(light).mean()), 1e-6):
                answer["camera"] = "camera.npy"
                np.save(folder / "camera.npy", camera)
    np.save(folder / "light.npy", light)
    return answer


@contextmanager
def _studio(scene: bpy.types.Scene) -> Iterator[bpy.types.Scene]:
    """A scene of its own with an equirectangular camera and nothing else, removed afterwards."""
    studio = bpy.data.scenes.new("material_fit_world")
    data = bpy.data.cameras.new("material_fit_world")
    camera = bpy.data.objects.new("material_fit_world", data)
    try:
        studio.collection.objects.link(camera)
        studio.camera = camera
        copy_properties((scene, bpy.context.view_layer), studio)
        studio.frame_set(scene.frame_current, subframe=scene.frame_subframe)
        _set_up(studio, scene)
        yield studio
    finally:
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(data)
        bpy.data.scenes.remove(studio)


def _set_up(studio: bpy.types.Scene, scene: bpy.types.Scene) -> None:
    render, cycles = studio.render, studio.cycles
    render.engine = "CYCLES"
    render.resolution_percentage = 100
    render.use_compositing = render.use_sequencer = render.film_transparent = False
    render.use_file_extension = False
    settings = render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5.0
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    settings.exr_codec = "NONE"
    cycles.device, cycles.shading_system = "CPU", scene.cycles.shading_system
    cycles.use_adaptive_sampling = cycles.film_transparent_glass = False
    cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.film_exposure = 1.0


def _panorama(
    studio: bpy.types.Scene, world: bpy.types.World, folder: Path, width: int, answers: dict[str, float]
) -> Pixels:
    _look_around(studio.camera)
    return _render(studio, world, folder, (width, width // 2), SAMPLES.get(width, 2), answers, ())


def _look_around(camera: bpy.types.Object) -> None:
    camera.data.type, camera.data.panorama_type = "PANO", "EQUIRECTANGULAR"
    camera.matrix_world = Matrix.Rotation(-math.pi / 2.0, 4, "Z") @ Matrix.Rotation(math.pi / 2.0, 4, "X")


def _render(
    studio: bpy.types.Scene,
    world: bpy.types.World,
    folder: Path,
    size: tuple[int, int],
    samples: int,
    answers: dict[str, float],
    discs: tuple[int, ...],
) -> Pixels:
    """Render a copy of `world` whose Light Path nodes give `answers`, with these suns' discs only."""
    copy = world.copy()
    tree: Any = copy.node_tree
    groups = answer_light_paths(tree, answers)
    output = active_output(tree)
    for link in list(output.inputs["Volume"].links) if output is not None else []:
        tree.links.remove(link)
    copy.cycles_visibility.camera = True
    copy.cycles.sampling_method = "NONE"  # nothing is lit here, and the map for it takes longer than the picture
    for number, (owner, name) in enumerate(_discs(tree)):
        node = owner.nodes[name]
        for link in [link for socket in node.inputs for link in socket.links]:  # a Vector is not read beside a disc
            owner.links.remove(link)
        node.sun_disc = number in discs
    studio.world = copy
    studio.render.resolution_x, studio.render.resolution_y = size
    studio.cycles.samples = samples
    path = folder / "panorama.exr"
    studio.render.filepath = str(path)
    try:
        bpy.ops.render.render(scene=studio.name, write_still=True)
        return _read(path)
    finally:
        studio.world = None
        bpy.data.worlds.remove(copy)
        for group in groups:
            bpy.data.node_groups.remove(group)
        path.unlink(missing_ok=True)


def _read(path: Path) -> Pixels:
    """Scene-linear pixels of a picture Blender wrote, in its working space, first row at the top."""
    image = bpy.data.images.load(str(path))
    try:
        image.colorspace_settings.is_data = True
        width, height = image.size
        pixels = np.empty(width * height * image.channels, dtype=np.float32)
        image.pixels.foreach_get(pixels)
        return np.ascontiguousarray(pixels.reshape(height, width, image.channels)[::-1, :, :3])
    finally:
        bpy.data.images.remove(image)


def _discs(tree: bpy.types.NodeTree) -> list[tuple[bpy.types.NodeTree, str]]:
    """Sky Textures that show the sun's disc, each as its tree and name."""
    found = []
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeTexSky" and node.sun_disc and node.sky_type not in ("PREETHAM", "HOSEK_WILKIE"):
            found.append((tree, node.name))
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            found += _discs(node.node_tree)
    return found


def _sun(
    studio: bpy.types.Scene, world: bpy.types.World, folder: Path, width: int, without: Pixels, number: int
) -> dict[str, Any] | None:
    """Direction, irradiance and angle of one sun's disc; None where it lights nothing."""
    camera = studio.camera
    _look_around(camera)
    size = (width, width // 2)
    wide = _render(studio, world, folder, size, FINDING_SAMPLES, SCATTERED, (number,)) - without
    power = wide.sum(axis=2).clip(0.0)
    # what the disc alone adds is far brighter than the noise of the sky
    power[power < 0.5 * power.max(initial=0.0)] = 0.0
    if power.max(initial=0.0) <= ALIKE * max(float(without.mean()), 1e-6):
        return None
    height = width // 2
    rows, columns = np.nonzero(power)
    polar, azimuth = (rows + 0.5) / height * math.pi, -((columns + 0.5) / width - 0.5) * 2.0 * math.pi
    towards = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1)
    direction = Vector((towards * power[rows, columns][:, None]).sum(axis=0)).normalized()

    tree, name = _discs(node_tree_of(world))[number]
    angle = float(tree.nodes[name].sun_size)
    view = max(DISC_MARGIN * angle, 4.0 * 2.0 * math.pi / width)
    camera.data.type, camera.data.angle = "PERSP", view
    camera.matrix_world = direction.to_track_quat("-Z", "Y").to_matrix().to_4x4()
    size = (DISC_PIXELS, DISC_PIXELS)
    with_disc, bare = (
        _render(studio, world, folder, size, DISC_SAMPLES, SCATTERED, shown) for shown in ((number,), ())
    )
    disc = (with_disc - bare).clip(0.0).astype(np.float64)
    side = 2.0 * math.tan(view / 2.0) / DISC_PIXELS
    across = (np.arange(DISC_PIXELS) + 0.5 - DISC_PIXELS / 2) * side
    x, y = np.meshgrid(across, -across)
    solid = side**2 / (1.0 + x**2 + y**2) ** 1.5
    weights = disc.sum(axis=2) * solid
    if weights.sum() <= 0.0:
        return None
    local = Vector((float((x * weights).sum()), float((y * weights).sum()), -float(weights.sum()))).normalized()
    towards_sun = camera.matrix_world.to_3x3() @ local
    irradiance = (disc * solid[:, :, None]).sum(axis=(0, 1))
    return {"direction": list(towards_sun), "irradiance": irradiance.tolist(), "angle": angle}
