# SPDX-License-Identifier: Apache-2.0
"""A scene of a ball, a box and a floor, and settings that a random one of them may have.

Each setting draws its values from numbers of its own, so that a scene is the same with any of the others left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .artist_settings import ARTIST_SETTINGS
from .data_settings import DATA_SETTINGS
from .light_settings import LIGHT_SETTINGS
from .material_settings import MATERIAL_SETTINGS
from .owner_settings import OWNER_SETTINGS
from .picture_settings import PICTURE_SETTINGS
from .render_settings import RENDER_SETTINGS
from .rig import Draw, Rig, Setting, background, principled, put_socket
from .shape_settings import SHAPE_SETTINGS


def build(names: Iterable[str], seed: int, folder: Path, *, size: int, samples: int) -> Rig:
    """Build the scene of a seed with the settings of these names."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    rig = _plain(np.random.default_rng([seed, 0]), folder, size, samples)
    for number, setting in enumerate(SETTINGS, start=1):
        if setting.name in set(names):
            rig = setting.put(rig, np.random.default_rng([seed, number])) or rig
    bpy.context.view_layer.update()
    return rig


def drawn(seed: int, *, exported: bool = False, groups: Sequence[str] = ()) -> list[str]:
    """The names of the settings of a seed's scene, about five, of some `groups` or of all.

    With `exported` those that a sentence names are left out of them.
    """
    settings = [setting for group in groups or GROUPS for setting in GROUPS[group]]
    chance = np.random.default_rng([seed, 1 << 20]).random(len(settings))
    some = [s.name for s, c in zip(settings, chance, strict=True) if c < 5.0 / len(settings)]
    return [name for name in some if not (exported and WORDS[name])]


def _plain(draw: Draw, folder: Path, size: int, samples: int) -> Rig:
    scene = bpy.context.scene
    render, cycles = scene.render, scene.cycles
    render.engine, render.resolution_x, render.resolution_y = "CYCLES", size, size
    render.use_compositing = render.use_sequencer = False
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    cycles.device, cycles.samples = "CPU", samples
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 4
    world = bpy.data.worlds.new("World")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    background(world).inputs["Strength"].default_value = draw.uniform(0.2, 0.6)
    segments = int(draw.choice([12, 24, 32, 48]))
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments // 2, location=(0, 0, 1))
    target = _named("Ball", draw.uniform(0.1, 0.9, 3), draw.uniform(0.3, 0.8))
    bpy.ops.object.shade_smooth()
    # above the floor: which of two faces in one plane is seen through a cut-out is left to chance
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(-1.4, -0.6, 0.51))
    box = _named("Box", draw.uniform(0.1, 0.9, 3), 0.7)
    bpy.ops.mesh.primitive_plane_add(size=10.0)
    floor = _named("Floor", draw.uniform(0.2, 0.7, 3), 0.8)
    data = bpy.data.lights.new("Lamp", str(draw.choice(["AREA", "POINT", "SPOT"])))
    data.energy = 350.0
    light = bpy.data.objects.new("Lamp", data)
    light.location, light.rotation_euler = (2.0, -2.5, 4.0), (math.radians(40), 0.0, math.radians(39))
    scene.collection.objects.link(light)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -6.0, 2.3), (math.radians(75), 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return Rig(scene, target, box, floor, light, camera, folder)


def _named(name: str, color: Any, roughness: float) -> Any:
    item = bpy.context.object
    item.name = name
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    item.data.materials.append(material)
    put_socket(item, "Base Color", (*color, 1.0))
    put_socket(item, "Roughness", roughness)
    return item


def _put(path: str, value: Callable[[Draw], Any]) -> Callable[[Rig, Draw], None]:
    """A setting by its path from the rig: "light.data.energy"."""
    owner, _, name = path.rpartition(".")

    def put(rig: Rig, draw: Draw) -> None:
        found: Any = rig
        for part in owner.split("."):
            found = getattr(found, part)
        if hasattr(found, name):  # not in every version of Blender, nor for every kind of light
            setattr(found, name, value(draw))

    return put


def _off(_: Draw) -> bool:
    return False


def _on(_: Draw) -> bool:
    return True


def _between(low: float, high: float) -> Callable[[Draw], float]:
    return lambda draw: float(draw.uniform(low, high))


def _among(*values: Any) -> Callable[[Draw], Any]:
    return lambda draw: values[int(draw.integers(len(values)))]


def _collection(rig: Rig, name: str) -> None:
    made = bpy.data.collections.new("Some")
    rig.scene.collection.children.link(made)
    for owner in list(rig.box.users_collection):
        owner.objects.unlink(rig.box)
    made.objects.link(rig.box)
    setattr(bpy.context.view_layer.layer_collection.children["Some"], name, True)


def _picture(draw: Draw, folder: Path, width: int, height: int) -> Any:
    values = np.ones((height, width, 4), np.float32)
    values[..., :3] = draw.uniform(0.05, 0.95, (height, width, 3))
    values[: height // 2, :, 3] = 0.5
    image = bpy.data.images.new("Picture", width, height, alpha=True)
    image.pixels.foreach_set(values.ravel())
    image.filepath_raw, image.file_format = str(folder / f"picture_{width}.png"), "PNG"
    image.save()
    return bpy.data.images.load(image.filepath_raw, check_existing=False)


def _texture(rig: Rig, draw: Draw) -> None:
    image = _picture(draw, rig.folder, 8, 8)
    image.alpha_mode = _among("STRAIGHT", "CHANNEL_PACKED", "NONE", "PREMUL")(draw)
    image.colorspace_settings.name = _among("sRGB", "sRGB", "Non-Color")(draw)
    item = rig.target if draw.random() < 0.5 else rig.floor
    tree = item.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = image, _among("Linear", "Closest", "Cubic")(draw)
    node.extension = _among("REPEAT", "EXTEND", "MIRROR")(draw)
    tree.links.new(node.outputs["Color"], principled(item).inputs["Base Color"])
    if draw.random() < 0.4:
        moved, where = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
        moved.inputs["Scale"].default_value = (*draw.uniform(0.5, 3.0, 2), 1.0)
        moved.inputs["Rotation"].default_value = (0.0, 0.0, draw.uniform(0.0, 3.0))
        tree.links.new(where.outputs["UV"], moved.inputs["Vector"])
        tree.links.new(moved.outputs["Vector"], node.inputs["Vector"])


def _sky(rig: Rig, draw: Draw) -> None:
    tree = rig.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = _picture(draw, rig.folder, 16, 8)
    node.image.colorspace_settings.name = _among("sRGB", "Linear Rec.709")(draw)
    node.interpolation = _among("Linear", "Closest", "Cubic")(draw)
    tree.links.new(node.outputs["Color"], background(rig.scene.world).inputs["Color"])
    moved, where = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    moved.inputs["Rotation"].default_value = (0.0, 0.0, draw.uniform(0.0, 6.0))
    tree.links.new(where.outputs["Generated"], moved.inputs["Vector"])
    tree.links.new(moved.outputs["Vector"], node.inputs["Vector"])


def _visibility(owner: str, kind: str) -> Callable[[Rig, Draw], None]:
    return _put(f"{owner}.visible_{kind}", _off)


def _instances(rig: Rig, draw: Draw) -> None:
    made = bpy.data.collections.new("Prefab")
    made.objects.link(rig.box)
    for owner in list(rig.box.users_collection):
        if owner != made:
            owner.objects.unlink(rig.box)
    for _ in range(2):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", made
        empty.location = (*draw.uniform(-1.5, 1.5, 2), 0.0)
        empty.scale = draw.uniform(0.4, 1.2, 3)
        rig.scene.collection.objects.link(empty)


def _subdivided(rig: Rig, draw: Draw) -> None:
    modifier = rig.box.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, int(draw.integers(1, 3))


def _no_shadow(rig: Rig, _: Draw) -> None:
    rig.light.data.use_shadow = False


def _full_shadow(rig: Rig, _: Draw) -> None:
    rig.box.data.materials[0].use_transparent_shadow = False


def _second_layer(rig: Rig, _: Draw) -> None:
    rig.scene.view_layers.new("Second")
    rig.scene.view_layers[0].use = False


def _muted(rig: Rig, draw: Draw) -> None:
    tree = rig.floor.data.materials[0].node_tree
    gamma, color = tree.nodes.new("ShaderNodeGamma"), tree.nodes.new("ShaderNodeRGB")
    gamma.inputs["Gamma"].default_value, gamma.mute = 3.0, True
    color.outputs[0].default_value = (*draw.uniform(0.1, 0.9, 3), 1.0)
    tree.links.new(color.outputs[0], gamma.inputs["Color"])
    tree.links.new(gamma.outputs[0], principled(rig.floor).inputs["Base Color"])


def _twin(rig: Rig, _: Draw) -> None:
    other = rig.box.copy()
    other.data = rig.box.data.copy()
    other.data.materials[0] = rig.floor.data.materials[0]
    rig.scene.collection.objects.link(other)


def _flat(rig: Rig, _: Draw) -> None:
    for polygon in rig.target.data.polygons:
        polygon.use_smooth = False


def _sockets(rig: Rig, draw: Draw, **highest: float) -> None:
    for name, value in highest.items():
        put_socket(rig.target, name.replace("_", " "), float(draw.uniform(0.3 * value, value)))


def _terminator(rig: Rig, draw: Draw) -> None:
    item = rig.target
    on_object = hasattr(item, "shadow_terminator_shading_offset")
    owner, name = (item, "shadow_terminator_shading_offset") if on_object else (item.cycles, "shadow_terminator_offset")
    owner.shadow_terminator_geometry_offset = float(draw.uniform(0.0, 0.5))
    setattr(owner, name, float(draw.uniform(0.0, 0.8)))


def _uncorrected(rig: Rig, _: Draw) -> None:
    rig.target.data.materials[0].cycles.use_bump_map_correction = False


LAMP, CYCLES = "light.data", "scene.cycles"
SETTINGS: tuple[Setting, ...] = (
    Setting("fast gi", _put(f"{CYCLES}.use_fast_gi", _on), ("Fast GI",)),
    Setting("film exposure", _put(f"{CYCLES}.film_exposure", _between(0.5, 2.0))),
    Setting("diffuse bounces", _put(f"{CYCLES}.diffuse_bounces", _among(0, 1)), ("limit of diffuse bounces",)),
    Setting("glossy bounces", _put(f"{CYCLES}.glossy_bounces", _among(0, 1)), ("limit of glossy bounces",)),
    Setting("max bounces", _put(f"{CYCLES}.max_bounces", _among(0, 1, 2))),
    Setting("reflective caustics", _put(f"{CYCLES}.caustics_reflective", _off), ("caustics",)),
    Setting("pixel filter", _put(f"{CYCLES}.pixel_filter_type", _among("GAUSSIAN", "BLACKMAN_HARRIS"))),
    Setting("light threshold", _put(f"{CYCLES}.light_sampling_threshold", _between(0.05, 0.3))),
    Setting("light tree", _put(f"{CYCLES}.use_light_tree", _off)),
    Setting("film transparent", _put("scene.render.film_transparent", _on)),
    Setting("frame", _put("scene.render.resolution_y", _among(32, 40))),
    Setting("lens", _put("camera.data.lens", _between(35.0, 70.0))),
    Setting("shift", _put("camera.data.shift_x", _between(-0.1, 0.1))),
    Setting("orthographic", _put("camera.data.type", _among("ORTHO"))),
    Setting("lamp energy", _put(f"{LAMP}.energy", _between(100.0, 800.0))),
    Setting("lamp colour", _put(f"{LAMP}.color", lambda d: tuple(d.uniform(0.2, 1.0, 3)))),
    Setting("lamp exposure", _put(f"{LAMP}.exposure", _between(-1.0, 1.0))),
    Setting("lamp temperature", _put(f"{LAMP}.use_temperature", _on)),
    Setting("lamp normalize", _put(f"{LAMP}.normalize", _off)),
    Setting("lamp radius", _put(f"{LAMP}.shadow_soft_size", _among(0.0, 0.3, 0.8))),
    Setting("lamp falloff", _put(f"{LAMP}.use_soft_falloff", _off)),
    Setting("lamp shape", _put(f"{LAMP}.shape", _among("RECTANGLE", "DISK", "ELLIPSE"))),
    Setting("lamp size", _put(f"{LAMP}.size", _between(0.2, 2.0))),
    Setting("lamp spread", _put(f"{LAMP}.spread", _between(1.0, 3.0))),
    Setting("lamp blend", _put(f"{LAMP}.spot_blend", _between(0.0, 1.0))),
    Setting("lamp shadow", _no_shadow),
    Setting("lamp bounces", _put(f"{LAMP}.cycles.max_bounces", _among(0, 1)), ("limit of bounces",)),
    Setting("lamp hidden from diffuse", _visibility("light", "diffuse"), ("hidden from",)),
    Setting("lamp hidden from glossy", _visibility("light", "glossy"), ("hidden from",)),
    Setting("lamp seen", _put("light.visible_camera", _on)),
    Setting("world picture", _sky),
    Setting("world hidden from camera", _put("scene.world.cycles_visibility.camera", _off)),
    Setting("world hidden from diffuse", _put("scene.world.cycles_visibility.diffuse", _off), ("hidden from diffuse",)),
    Setting("world hidden from glossy", _put("scene.world.cycles_visibility.glossy", _off), ("hidden from glossy",)),
    Setting("world bounces", _put("scene.world.cycles.max_bounces", _among(0, 1)), ("limit of bounces",)),
    Setting("world sampling", _put("scene.world.cycles.sampling_method", _among("NONE", "MANUAL"))),
    Setting("box hidden from camera", _visibility("box", "camera")),
    Setting("box hidden from diffuse", _visibility("box", "diffuse")),
    Setting("box hidden from glossy", _visibility("box", "glossy")),
    Setting("box without shadow", _visibility("box", "shadow"), ("how much of its own light",)),
    Setting("target without shadow", _visibility("target", "shadow")),
    Setting("box cut-out", lambda r, d: put_socket(r.box, "Alpha", float(d.uniform(0.1, 0.8)))),
    Setting("full shadow", _full_shadow),
    Setting("box a holdout", _put("box.is_holdout", _on), ("holdout",)),
    Setting("box a shadow catcher", _put("box.is_shadow_catcher", _on), ("shadow catcher",)),
    Setting("collection indirect only", lambda r, d: _collection(r, "indirect_only")),
    Setting("collection holdout", lambda r, d: _collection(r, "holdout"), ("holdout",)),
    Setting("collection excluded", lambda r, d: _collection(r, "exclude")),
    Setting("collection instances", _instances),
    Setting("second layer", _second_layer, ("View layer",)),
    Setting("without sky", lambda r, d: setattr(bpy.context.view_layer, "use_sky", False)),
    Setting("subdivision", _subdivided),
    Setting("flat shading", _flat),
    Setting("mirrored", lambda r, d: setattr(r.target, "scale", (-1.0, *d.uniform(0.6, 1.2, 2)))),
    Setting("shadow terminator", _terminator),
    Setting("coincident faces", _twin, ("in the same place",)),
    Setting("texture", _texture),
    Setting("muted node", _muted),
    Setting("metal", lambda r, d: put_socket(r.target, "Metallic", 1.0)),
    Setting("coat", lambda r, d: _sockets(r, d, Coat_Weight=1.0, Coat_Roughness=0.4)),
    Setting("sheen", lambda r, d: _sockets(r, d, Sheen_Weight=1.0, Sheen_Roughness=0.6)),
    Setting("glass", lambda r, d: put_socket(r.target, "Transmission Weight", 1.0), ("caustics",)),
    Setting("cut-out", lambda r, d: put_socket(r.target, "Alpha", float(d.uniform(0.2, 0.8)))),
    Setting("glowing", lambda r, d: _sockets(r, d, Emission_Strength=2.0)),
    Setting("glowing box", lambda r, d: put_socket(r.box, "Emission Strength", 1.5)),
    Setting("bump correction", _uncorrected, ("Bump Map Correction",)),
)  # fmt: skip
GROUPS = {
    "plain": SETTINGS, "artist": ARTIST_SETTINGS,
    "material": MATERIAL_SETTINGS, "light": LIGHT_SETTINGS, "shape": SHAPE_SETTINGS,
    "owner": OWNER_SETTINGS + DATA_SETTINGS, "render": RENDER_SETTINGS, "picture": PICTURE_SETTINGS,
}  # fmt: skip
SETTINGS = tuple(setting for group in GROUPS.values() for setting in group)
# of what the plain scene has at times, and of what two settings make together
PLAIN_WORDS = (
    "casts no shadows", "Subsurface is fitted as diffuse", "its Subsurface is shown as diffuse",
    "has colours where its alpha is 0",
    "takes Generated coordinates after", "all have the bake of the first", "its depth of field is left out",
    "Open Shading Language", "asks Light Path for", "rays; in the fit it is not.",
    "in the fit both sides are as its front is", "whose axes have different scales, Displacement",
)  # fmt: skip
WORDS = {setting.name: setting.words for setting in SETTINGS}
