# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's data as scene.xml, with the meshes and pictures it refers to. Knows nothing of bpy."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..camera.camera_model import CAMERA_NOT_FINITE, sensor_element
from ..files.exr_file import write_exr
from ..files.ply_file import TriangleMesh, write_ply
from ..files.xml_scene import (
    Element,
    NotFiniteError,
    add,
    boolean,
    integer,
    plugin,
    reference,
    scalar,
    scene_text,
    string,
)
from ..findings import Findings
from ..lights.light_elements import light_element
from ..lights.light_model import irradiance_at
from ..material_model import Texture
from ..materials.material_elements import bsdf_element, emission_element
from ..meshes.leaning_normals import normals_lean, share_of_mirrored
from ..meshes.mesh_arrays import joined
from .scene_data import SceneData, Shape, target_bsdf
from .world_model import camera_world_element, world_element, world_irradiance

# a weak emitter may still matter elsewhere: it is sampled at least this often, relative to the strongest
LEAST_WEIGHT = 0.1
# Clamping of indirect light by the radiance of a white matt surface at the target. At 1 plastic, metal and coat were
# within 0.1 % of Cycles and glass within 0.2 %; at 0.3 nothing was above the noise of 0.3 % either
LEAST_CLAMP = 1.0
# the same where Cycles chooses by its light tree, which does not know what nodes make of lamps, so that single samples
# of those are brighter: a gobo, an IES lamp and a softbox lost 0.8 % at 1, 0.4 % at 3 and nothing at 9
LEAST_CLAMP_OF_NODES = 9.0
# share that a mirror along the normals sends inside, of subsurface under a light probe: a lump of 320 faces, 0.30, was
# 2 % too dark, a ball of 8 segments, 0.23, as other balls
MOST_LEANING_WALKS = 0.25
# Shapes of a scene, from which on those that are alike are one, as each takes the renderer time of its own: with 15,852
# sprinkles of a donut as one a fit of 144 x 81 pixels took 43 s of a processor, and else it was not done after 246 s
# (docs/notebook/wild.md). Fewer: no measurement
MANY_SHAPES = 64
SMALL = 0.1  # metres from the origin that a shape reaches whose rays start nearer to it (the backend's `ray_starts`)
WORLD_NOT_FINITE = "The colour or strength of the world is NaN or infinite: mend the driver or keyframe that gives it."
LIGHT_NOT_FINITE = (
    "The place or a setting of light '{name}' is NaN or infinite: mend the driver, constraint or keyframe that gives "
    "it, or hide the light in renders."
)
MATERIAL_NOT_FINITE = (
    "A value of material '{name}' is NaN or infinite: mend the driver or keyframe that gives it, or set a number."
)


@dataclass
class SceneFiles:
    """The text of scene.xml and the files beside it, by their path in the job folder."""

    text: str = ""
    meshes: dict[str, TriangleMesh] = field(default_factory=dict)
    pictures: dict[str, NDArray[np.float32]] = field(default_factory=dict)
    _names: dict[tuple[tuple[int, ...], bytes], str] = field(default_factory=dict)

    def picture(self, pixels: NDArray[np.float32]) -> str:
        """Keep `pixels` and return their path; equal pictures are kept once."""
        key = (pixels.shape, pixels.tobytes())
        if key not in self._names:
            self._names[key] = f"textures/tex_{len(self._names) + 1:04d}.exr"
            self.pictures[self._names[key]] = pixels
        return self._names[key]

    def texture(self, texture: Texture) -> str:
        """Keep a socket's picture and return its path."""
        return self.picture(texture.pixels)

    def write(self, folder: Path) -> None:
        """Write everything below `folder`.

        Raises
        ------
        OSError
            If something cannot be written.
        """
        for name in ("meshes", "textures"):
            (folder / name).mkdir(exist_ok=True)
        (folder / "scene.xml").write_text(self.text, encoding="utf-8")
        for path, mesh in self.meshes.items():
            write_ply(folder / path, mesh)
        for path, pixels in self.pictures.items():
            write_exr(folder / path, pixels)


def scene_files(scene: SceneData, findings: Findings) -> SceneFiles:
    """Return scene.xml and its files; what had to be approximated goes into `findings`, and as an error what is NaN."""
    files = SceneFiles()
    targets = [shape for n in range(scene.target_count) if (shape := scene.target_of(n)) is not None]
    # of several the middle of their middles
    middles = [shape.mesh.positions.mean(axis=0).astype(np.float64) for shape in targets]
    middle = np.mean(middles, axis=0) if middles else scene.middle()
    children: list[Element] = [
        add(
            plugin("integrator", "path"),
            integer("max_depth", scene.settings.max_depth),
            boolean("hide_emitters", _hide_emitters(scene)),
        ),
    ]
    with _finite(CAMERA_NOT_FINITE, findings):
        children.append(sensor_element(scene.camera, scene.settings.pixel_filter, scene.settings.spp))
    emitters: list[tuple[Element, float]] = []
    with _finite(WORLD_NOT_FINITE, findings):
        world = world_element(scene.world, files.picture)
        if world is not None:
            emitters.append((world, world_irradiance(scene.world)))
    for index, light in enumerate(scene.lights):
        with _finite(LIGHT_NOT_FINITE.format(name=light.name), findings):
            element = light_element(light, f"light_{index + 1:04d}", files.picture)
            emitters.append((element, irradiance_at(light, middle)))
    _note_clamping(scene, sum(irradiance for _, irradiance in emitters), findings)
    _weigh(emitters)
    children += [element for element, _ in emitters]
    camera_world = camera_world_element(scene.world, files.picture, hidden=scene.settings.film_transparent)
    if camera_world is not None:
        children.append(camera_world)
    fitted = {target_bsdf(number) for number in range(scene.target_count)}
    for identifier, material in scene.materials.items():
        is_target = identifier in fitted
        with _finite(MATERIAL_NOT_FINITE.format(name=material.name), findings):
            children.append(bsdf_element(material, identifier, files.texture, findings, every=is_target))
    _note_shadowless(scene, findings)
    _note_leaning_walks(scene, findings)
    for shape in _joined_alike(scene):
        with _finite(MATERIAL_NOT_FINITE.format(name=scene.materials[shape.bsdf].name), findings):
            children.append(_shape_element(shape, scene, files))
    files.text = scene_text(children)
    return files


def _joined_alike(scene: SceneData) -> list[Shape]:
    """The shapes of a scene, of many those that differ in their faces alone as one, as sprinkles and blades of grass.

    Not what is fitted; what glows, as a renderer draws points on each; what light walks below, as it stays inside of
    its shape; and what is small, as its size says where rays from it start.
    """
    if len(scene.shapes) < MANY_SHAPES:
        return scene.shapes
    fitted = {target_bsdf(number) for number in range(scene.target_count)}
    alone = fitted | {name for name, each in scene.materials.items() if each.scattering or each.emission.any()}
    alike: dict[object, list[Shape]] = {}
    for shape in scene.shapes:
        is_small = np.abs(shape.mesh.positions).max(initial=0.0) <= SMALL
        key = shape.identifier if shape.bsdf in alone or is_small else _but_faces(shape)
        alike.setdefault(key, []).append(shape)
    return [replace(shapes[0], mesh=joined([shape.mesh for shape in shapes])) for shapes in alike.values()]


def _but_faces(shape: Shape) -> tuple[object, ...]:
    """All that the scene file says of a shape beside its faces."""
    return shape.bsdf, tuple(_numbers(shape).items()), shape.mesh.tangents is None


@contextmanager
def _finite(sentence: str, findings: Findings) -> Iterator[None]:
    """Report an error where a number within is NaN or infinite."""
    try:
        yield
    except NotFiniteError:
        findings.error(sentence)


def _note_shadowless(scene: SceneData, findings: Findings) -> None:
    """Name what casts no shadows in light that Cycles finds by samples, which pass it, and by rays, which do not."""
    emitting = [shape.identifier for shape in scene.emitting]
    shadowless = [shape for shape in scene.shapes if shape.shadow_transmission == 1.0]
    glowing = [shape.bsdf for shape in shadowless if shape.identifier in emitting]
    for name in dict.fromkeys(scene.materials[bsdf].name for bsdf in glowing):
        # a glowing box on a floor was 6 % too dark
        findings.note(
            f"An object of the glowing material '{name}' casts no shadows (Ray Visibility): how much of its own light "
            "passes through it differs from Cycles."
        )
    if not emitting and (scene.world.pixels is None or not scene.world.is_lit):
        return
    for name in dict.fromkeys(scene.materials[s.bsdf].name for s in shadowless if s.identifier not in emitting):
        # a ball under a world picture was 0.7 % too bright, half a ball in a glowing room 0.8 %
        findings.note(
            f"An object of material '{name}' casts no shadows (Ray Visibility) in the light of a world picture or of "
            "glowing objects: how much of it passes through differs from Cycles."
        )


def _note_leaning_walks(scene: SceneData, findings: Findings) -> None:
    """Name subsurface that leaves below faces, where Cycles' shadow rays start above them."""
    if scene.world.pixels is None or not scene.world.is_lit:
        return
    walked = [s for s in scene.shapes if scene.materials[s.bsdf].scattering and s.terminator.geometry_offset > 0.0]
    leaning = [shape.bsdf for shape in walked if share_of_mirrored(shape.mesh) > MOST_LEANING_WALKS]
    for name in dict.fromkeys(scene.materials[bsdf].name for bsdf in leaning):
        findings.note(
            f"An object of material '{name}' has normals that lean far from its faces: how bright its subsurface is in "
            "the light of a world picture differs from Cycles."
        )


def _note_clamping(scene: SceneData, irradiance: float, findings: Findings) -> None:
    clamp = float(scene.settings.light_paths.get("clamp_indirect", 0.0))
    shaped = any(light.pattern is not None or light.falloff is not None for light in scene.lights)
    chosen = shaped and scene.settings.light_tree and len(scene.lights) + scene.world.is_lit > 1
    if 0.0 < clamp < (LEAST_CLAMP_OF_NODES if chosen else LEAST_CLAMP) * irradiance / math.pi:
        findings.note(
            f"Clamping of indirect light ({clamp / scene.settings.exposure:.3g}) is low for the lights of this scene: "
            "it works on single samples, and those of the fit are not Cycles', so how much light it takes away may "
            "differ."
        )


def _weigh(emitters: list[tuple[Element, float]]) -> None:
    """Let Mitsuba sample each emitter in proportion to what it gives the target, not all equally often."""
    most = max((irradiance for _, irradiance in emitters), default=0.0)
    for element, irradiance in emitters if len(emitters) > 1 else []:
        add(element, scalar("sampling_weight", max(irradiance / most, LEAST_WEIGHT)))


def _shape_element(shape: Shape, scene: SceneData, files: SceneFiles) -> Element:
    path = f"meshes/{shape.identifier}.ply"
    files.meshes[path] = shape.mesh
    element = add(plugin("shape", "ply", shape.identifier), string("filename", path), reference(shape.bsdf))
    for name, value in _numbers(shape).items():
        add(element, add(plugin("texture", "uniform", name=name), scalar("value", value)))
    material, exposure = scene.materials[shape.bsdf], scene.settings.exposure
    emitter = emission_element(material, exposure, files.texture)
    return element if emitter is None else add(element, emitter)


def _numbers(shape: Shape) -> dict[str, float]:
    """What the backend's transport reads (`smooth_facets`, `shadow_rays`, `camera_view`, `subsurface_walks`) and what a
    verdict leaves out (`seen_through`)."""
    numbers = {
        "shadow_geometry_offset": shape.terminator.geometry_offset or None,
        "shadow_shading_offset": shape.terminator.shading_offset or None,
        "shadow_transmission": shape.shadow_transmission,
        "camera_hidden": 1.0 if shape.camera_hidden else None,
        "seen_otherwise": 1.0 if shape.seen_otherwise else None,
        "body": float(shape.body) if shape.body else None,
        "leaning_normals": 1.0 if normals_lean(shape.mesh) else None,
    }
    return {name: value for name, value in numbers.items() if value is not None}


def _hide_emitters(scene: SceneData) -> bool:
    """Whether camera rays miss the world, for integrators without `camera_world`, which hide glowing objects too."""
    hidden = scene.settings.film_transparent or not scene.world.camera
    return hidden and scene.world.is_lit and not scene.emitting
