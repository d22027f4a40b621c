# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles renders and bakes for an export, from the asking to the scene it goes into."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import bpy
import numpy as np
from mathutils import Vector  # pyright: ignore[reportMissingImports]
from numpy.typing import NDArray

from ...bake.bake_cache import cache_folder
from ...bake.baker import BakeError, Baker
from ...bake.panorama import ALIKE, LEAST_WIDTH, MOST_WIDTH
from ...bake.requests import name_of
from ...bake.stage import color_of
from ...probe.client import Probe
from ...probe.light_path import BEHIND, OF_CAMERA, other_looks
from ...versions import cycles_settings, node_tree_of
from ..camera.camera_model import Camera
from ..findings import Findings
from ..images.color_space import to_rec709
from ..lights.lamp_tables import LampTables
from ..lights.light_model import Light
from ..lights.negative_light import refuse_negative
from ..material_model import grey
from ..materials.baked_material import Baked
from ..materials.read_context import read_context
from ..materials.read_material import volume_sockets
from ..meshes.mesh_arrays import Piece
from ..meshes.read_mesh import material_of_slot
from ..nodes.backs import note_displaced_backs
from ..nodes.circling import turned_axis
from ..nodes.dependence import (
    OF_INSTANCER_COLOR,
    OF_SIZE,
    OF_STRETCH,
    asked_for,
    asked_of_instancer,
    asked_of_place,
    differs_behind,
    lets_light_through,
)
from ..nodes.displacement import bends_normals
from ..nodes.graph_findings import note_missing_pictures, note_pixel_sizes
from ..render_state import rendered_layer
from .displaced_meshes import OTHER_FACES, DisplacedMeshes
from .ray_visibility import put_looks, scattered_id
from .scene_data import SceneData

MOST_SURFACES = 64  # baked in one export; what comes later keeps its nearest model
# of one object whose instances have each something of their own, or bent normals and other proportions or sizes; what
# comes later has the first bake
MOST_PLACES = 8
SIZE_STEP = 0.02  # the smallest ratio of two sizes, above 1, that counts as another: slopes of bumps change as much
LEAST_SIZE, MOST_SIZE = 256, 2048  # texels along each side
TEXELS_A_PIXEL = 1.5  # along each side, where a surface is nearest to the camera
USED = 0.6  # of a map's side by the faces in it, about
POINTS = 2000  # of a surface that are looked at for its size in the picture

Own = tuple[float, ...]


@dataclass(frozen=True)
class Surface:
    """The faces of one material slot of something the depsgraph shows."""

    instance: bpy.types.DepsgraphObjectInstance
    slot: int
    piece: Piece

    @property
    def material(self) -> bpy.types.Material:
        """Its material, which is there."""
        material = material_of_slot(self.instance.object, self.slot)
        assert material is not None
        return material.original

    @property
    def owner(self) -> str:
        """Name of its object."""
        return self.instance.object.name


@dataclass(frozen=True)
class _Shown:
    """A shape of the scene that a bake is for."""

    shape: str
    piece: Piece


@dataclass
class _Asked:
    """A surface that is to be baked, and the request that says so; `looks` are ids of others by kinds of rays."""

    material: bpy.types.Material
    owner: str
    request: dict[str, Any]
    shown: list[_Shown] = field(default_factory=list)
    looks: dict[str, str] = field(default_factory=dict)


class SceneBakes:
    """Requests to a Blender beside this one: that of `probe`, or one that lives from the first of them to the end."""

    def __init__(self, context: bpy.types.Context, probe: Probe | None = None) -> None:
        cycles = cycles_settings(context.scene)
        self._by_language = cycles is not None and cycles.shading_system
        self._baker = Baker(context.scene.name, rendered_layer(context.scene, context.view_layer).name, probe)
        self.displaced = DisplacedMeshes(self._baker)
        self.lamps = LampTables(self._baker)
        self._world: tuple[int, bpy.types.World] | None = None
        self._failed: list[str] = []  # errors of what was asked
        self._surfaces: dict[str, _Asked] = {}  # by the BSDF's id
        self._number: int | BakeError | None = None  # of the request for them, or why there is none
        # those ids, by what a bake hangs on of an instance, by object, its data and slot
        self._ids: dict[tuple[str, int, int], dict[Own, str]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._baker.close()

    def ask_world(self, world: bpy.types.World, findings: Findings) -> None:
        """Have the world rendered; `finish` puts it into the scene."""
        note_missing_pictures(f"World '{world.name}'", node_tree_of(world), findings)
        try:
            self._world = self._baker.ask("world", cache=cache_folder(), width=_panorama_width(world)), world
        except BakeError as problem:
            self._failed.append(_of_world(world, problem))

    def ask_surface(self, data: SceneData, shape: str, surface: Surface, findings: Findings) -> str:
        """Have a surface baked for the shape of that id; returns the id of a BSDF that `finish` describes.

        Instances share one, but where nodes ask for what each has of its own, or where size or proportions bend normals
        in another way.
        """
        item, material = surface.instance.object, surface.material
        known = self._ids.setdefault((item.name_full, item.data.as_pointer(), surface.slot), {})
        told = asked_of_instancer(node_tree_of(material))
        if told and surface.instance.is_instance:
            findings.note(
                f"Material '{material.name}': what {', '.join(told)} tell of each instance of '{item.name}' is left "
                "out: in the fit it is as of the object alone."
            )
        own = _own(surface)
        if own not in known and len(known) == MOST_PLACES:
            if asked_for(node_tree_of(material), OF_INSTANCER_COLOR):
                findings.note(
                    f"Material '{material.name}' asks for the colour of each instance of '{item.name}'; beyond "
                    f"{MOST_PLACES} bakes all have that of the first."
                )
            elif not asked_of_place(node_tree_of(material)):  # else `_put_surface` names it
                findings.note(
                    f"Material '{material.name}' bends normals of '{item.name}' by the size of each instance; beyond "
                    f"{MOST_PLACES} sizes all have those of the first."
                )
            own = next(iter(known))
        if own not in known:
            note_missing_pictures(f"Material '{material.name}'", node_tree_of(material), findings)
            note_pixel_sizes(f"Material '{material.name}'", node_tree_of(material), findings)
            identifier = f"baked_{sum(map(len, self._ids.values())) + 1:04d}"
            try:
                if len(self._surfaces) >= MOST_SURFACES:
                    raise BakeError(f"It would be one of more than {MOST_SURFACES}.")
                self._baker.start()
                request = {"instance": name_of(surface.instance), "slot": surface.slot}
                request |= {"size": _texels(data.camera, surface.piece), "rays": "scattered"}
                data.materials[identifier] = grey(material.name)
                asked = self._surfaces[identifier] = _Asked(material, item.name, request)
                others = other_looks(node_tree_of(material)) or _looks_behind(data.camera, surface)
                if surface.piece.stretch > 1.0 + SIZE_STEP and _back_is_met(data.camera, surface):
                    note_displaced_backs(material, item.name, findings, by_language=self._by_language)
                asked.looks = {rays: f"{identifier}_{of}" for rays, of in others.items()}
                for of in dict.fromkeys(others.values()):
                    self._surfaces[f"{identifier}_{of}"] = _Asked(material, item.name, request | {"rays": of})
            except BakeError as problem:
                _give_up(data, identifier, material, item.name, problem, findings)
            known[own] = identifier
        identifier = known[own]
        if identifier in self._surfaces:
            self._surfaces[identifier].shown.append(_Shown(shape, surface.piece))
        return identifier

    def is_ready(self) -> bool:
        """Whether `finish` would not wait; surfaces are asked for with the first call, when all are known."""
        self._ask_surfaces()
        return self._baker.is_ready()

    def _ask_surfaces(self) -> None:
        if self._number is None and self._surfaces:
            try:
                requests = [asked.request for asked in self._surfaces.values()]
                self._number = self._baker.ask("surfaces", cache=cache_folder(), surfaces=requests)
            except BakeError as problem:
                self._number = problem

    def finish(self, data: SceneData, findings: Findings) -> None:
        """Wait for everything that was asked and put it into `data`; what failed is an error in `findings`."""
        for sentence in self._failed:
            findings.error(sentence)
        self.displaced.finish(data, findings)
        self.lamps.finish(data.lights, findings)
        if self._world is not None:
            self._put_world(data, findings, *self._world)
        if self._surfaces:
            self._put_surfaces(data, findings)

    def _put_surfaces(self, data: SceneData, findings: Findings) -> None:
        self._ask_surfaces()
        try:
            if not isinstance(self._number, int):
                raise self._number or BakeError("It was not asked for.")
            answer, folder = self._baker.wait(self._number, len(self._surfaces))
            found = answer["surfaces"]
        except BakeError as problem:
            found, folder = [{"status": "failed", "sentence": str(problem)}] * len(self._surfaces), Path()
        for index, (identifier, asked) in enumerate(self._surfaces.items()):
            try:
                if found[index]["status"] != "ok":
                    raise BakeError(found[index]["sentence"])
                circles = bool(turned_axis(asked.material))
                baked = Baked(found[index], folder / str(index), circles=circles, others=asked.looks)
                self._put_surface(data, findings, identifier, asked, baked)
            except BakeError as problem:
                _give_up(data, identifier, asked.material, asked.owner, problem, findings)
        for identifier, asked in self._surfaces.items():
            if asked.looks:
                shapes = [shown.shape for shown in asked.shown]
                put_looks(data, identifier, asked.material.name, asked.looks, shapes, findings)

    def _put_surface(self, data: SceneData, findings: Findings, identifier: str, asked: _Asked, baked: Baked) -> None:
        corners = baked.corners
        if any(len(corners) != len(shown.piece.mesh.uvs) for shown in asked.shown):
            raise BakeError(OTHER_FACES)
        pieces = {
            shown.shape: replace(shown.piece, mesh=replace(self.displaced.of(shown.piece.mesh), uvs=corners)).placed()
            for shown in asked.shown
        }
        if len(asked.shown) > 1 and baked.place:
            findings.note(
                f"Material '{asked.material.name}': {', '.join(baked.place)} may differ between the {len(asked.shown)} "
                f"instances of '{asked.owner}'; all have the bake of the first."
            )
        own = scattered_id(identifier) if asked.looks else identifier
        found = baked.materials(own, asked.material.name, findings)
        if any(each.passes_light for each in found.values()):
            key = next(key for key in (f"{own}_flat", own) if key in found)
            inside = volume_sockets(asked.material, found[key], findings)
            found[key] = replace(found[key], sockets=found[key].sockets | inside)
        data.materials |= found
        data.shapes[:] = [
            replace(shape, mesh=pieces[shape.identifier]) if shape.identifier in pieces else shape
            for shape in data.shapes
        ]

    def _put_world(self, data: SceneData, findings: Findings, number: int, world: bpy.types.World) -> None:
        try:
            answer, folder = self._baker.wait(number)
        except BakeError as problem:
            findings.error(_of_world(world, problem))
            return
        exposure = data.settings.exposure

        def picture(name: str) -> NDArray[np.float32]:
            radiance = to_rec709(np.load(folder / name))
            refuse_negative(world.name, radiance, findings)
            return np.ascontiguousarray(radiance.clip(0.0) * exposure, dtype=np.float32)

        light = picture(answer["light"])
        suns = [
            _sun(f"{world.name} sun {index + 1}", sun, exposure, "camera" not in answer)
            for index, sun in enumerate(answer["suns"])
        ]
        camera = picture(answer["camera"]) if "camera" in answer else None
        # Cycles sends no light samples to a world without a place to aim at, so what casts no shadow blocks its light
        color, pixels = (light[0, 0].astype(np.float64), None) if _is_uniform(light) else (np.ones(3), light)
        data.world = replace(data.world, color=color, pixels=pixels, lookup=None, camera_pixels=camera)
        data.lights += suns
        other = [name for name in answer["paths"] if name not in OF_CAMERA]
        if other:
            findings.note(
                f"World '{world.name}' asks Light Path for {', '.join(other)}: the fit takes it as diffuse rays see it."
            )


def _is_uniform(radiance: NDArray[np.float32]) -> bool:
    return bool(np.ptp(radiance.reshape(-1, 3), axis=0).max() <= ALIKE * float(radiance.mean()))


def _own(surface: Surface) -> Own:
    """What a bake of a surface hangs on of its instance: its colour, and all, or for bent normals proportions, size,
    and mirroring."""
    tree = node_tree_of(surface.material)
    color = color_of(surface.instance) if asked_for(tree, OF_INSTANCER_COLOR) else ()
    return (*color, *_own_of_place(surface, tree))


def _own_of_place(surface: Surface, tree: bpy.types.NodeTree) -> Own:
    if asked_of_place(tree):
        return (*map(float, surface.piece.matrix.ravel()), float(surface.instance.random_id))
    by_size = bool(asked_for(tree, OF_SIZE)) or bends_normals(surface.material)
    if not by_size and not asked_for(tree, OF_STRETCH):
        return ()
    linear = surface.piece.matrix[:3, :3]
    volume = float(np.linalg.det(linear))
    if volume == 0.0:
        return ()
    size = abs(volume) ** (1.0 / 3.0)
    proportions = np.round((linear / size).T @ (linear / size) / SIZE_STEP)[np.triu_indices(3)] + 0.0
    step = round(math.log(size) / math.log1p(SIZE_STEP)) if by_size else 0
    return (*map(float, proportions), float(step), math.copysign(1.0, volume))


def _looks_behind(camera: Camera, surface: Surface) -> dict[str, str]:
    """Another look of a surface's back, where nodes give it one and something may meet it; see `other_looks`."""
    tree = node_tree_of(surface.material)
    return {BEHIND: BEHIND} if tree is not None and differs_behind(tree) and _back_is_met(camera, surface) else {}


def _back_is_met(camera: Camera, surface: Surface) -> bool:
    tree, piece = node_tree_of(surface.material), surface.piece
    is_clear = tree is not None and lets_light_through(tree)
    return is_clear or piece.mesh.is_open or piece.may_hold(camera.world[:3, 3])


def _texels(camera: Camera, piece: Piece) -> int:
    """Texels along each side of a bake: about as fine as the pixels where the surface is nearest to the camera."""
    triangles = np.concatenate(list(piece.corners()))
    areas = 0.5 * np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    total = float(areas.sum())
    if total <= 0.0:
        return LEAST_SIZE
    chance = np.random.default_rng(0)
    chosen = triangles[chance.choice(len(triangles), POINTS, p=areas / total)]
    a, b = chance.random((2, POINTS, 1))
    a, b = np.where(a + b > 1.0, 1.0 - a, a), np.where(a + b > 1.0, 1.0 - b, b)
    points = chosen[:, 0] + a * (chosen[:, 1] - chosen[:, 0]) + b * (chosen[:, 2] - chosen[:, 0])
    places, depths = camera.project(points)
    seen = camera.shown(places) & (depths > 0.0)
    if not seen.any():
        return LEAST_SIZE
    right = camera.world[:3, 0] / np.linalg.norm(camera.world[:3, 0])
    step = 1e-4 * total**0.5
    moved, _ = camera.project(points[seen] + step * right)
    pixels_a_metre = np.linalg.norm(moved - places[seen], axis=1) / step
    side = TEXELS_A_PIXEL * float(np.quantile(pixels_a_metre, 0.9)) * total**0.5 / USED
    return int(np.clip(2 ** math.ceil(math.log2(max(side, 1.0))), LEAST_SIZE, MOST_SIZE))


def _give_up(
    data: SceneData,
    identifier: str,
    material: bpy.types.Material,
    owner: str,
    problem: BakeError,
    findings: Findings,
) -> None:
    findings.note(f"Material '{material.name}' of '{owner}' could not be baked by Cycles: {problem}")
    data.materials[identifier] = read_context(material, owner, findings)


def _sun(name: str, found: dict[str, Any], exposure: float, camera: bool) -> Light:
    """A sun lamp that gives what a disc in the sky does."""
    matrix = np.eye(4)
    # a sun shines along its local -Z
    matrix[:3, :3] = np.array(Vector(found["direction"]).to_track_quat("Z", "Y").to_matrix())
    color = to_rec709(found["irradiance"]).clip(0.0)
    return Light("SUN", name, matrix, color, exposure, sun_angle=float(found["angle"]), camera=camera)


def _of_world(world: bpy.types.World, problem: BakeError) -> str:
    return f"World '{world.name}' could not be rendered by Cycles: {problem}"


def _panorama_width(world: bpy.types.World) -> int:
    """Pixels around: as fine as the pictures that the world is made of."""
    widths = [float(LEAST_WIDTH), *_picture_widths(node_tree_of(world))]
    return min(2 ** math.ceil(math.log2(max(widths))), MOST_WIDTH)


def _picture_widths(tree: bpy.types.NodeTree) -> list[float]:
    widths: list[float] = []
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeTexEnvironment" and node.image is not None:
            widths.append(float(node.image.size[0]))
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            widths += _picture_widths(node.node_tree)
    return widths
