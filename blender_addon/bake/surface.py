# SPDX-License-Identifier: GPL-3.0-or-later
"""A material on an object as textures, baked by the Blender this runs in.

Every number that its closures hang on is baked as emission onto a UV map of its own, and normals as those of that map.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..export.meshes.read_mesh import material_of_slot
from ..export.nodes.backs import is_displaced_hollow, turns_on_backs
from ..export.nodes.dependence import OF_SIDE, OF_SURROUNDINGS, OF_VIEW, asked_for, asked_of_place
from ..export.nodes.displacement import bends_normals, unbent
from ..export.nodes.leaf_kinds import EMISSION, distribution_of, is_shader, kind_of, only_nearest, walks_of
from ..export.nodes.read_alphas import keep_alphas
from ..probe.closure_tree import ClosureTree, Leaf, Value, own_groups
from ..probe.graph_copy import nodes_of
from ..probe.light_path import (
    ANSWERS,
    BEHIND,
    answer_backfacing,
    answer_light_paths,
    answer_random,
    light_path_outputs,
)
from ..versions import active_output
from .stage import bake
from .surface_stage import NORMAL, TANGENT, SurfaceStage, surface_stage

Pixels = NDArray[np.float32]

FLAT = 2e-3  # largest slope of a normal map that counts as none
# Mean of 1 - n^2 over texels of the mean normal n, above which normals are baked twice as fine: a vase with waves of a
# slope of 5, narrower than pixels, was 8 % too bright where it is 0.056, 3 % at 0.016 and 1 % at 0.003
MOST_SPREAD = 0.01
# Texels along each side to which normals are: the export of two such objects, with all pictures of 256, 1024 and 2048
# texels, took 3, 8 and 23 seconds of a processor
FINEST_NORMALS = 1024
MOST_RANDOM = 0xFFFFFFFF  # Cycles divides an instance's random number by it
LEFT_OUT = ("Coat Normal", "Tangent")
SKIPPED = ("Weight", "Normal", *LEFT_OUT)


def baked_surface(
    scene: bpy.types.Scene,
    instance: Any,
    depsgraph: bpy.types.Depsgraph,
    slot: int,
    folder: Path,
    size: int,
    rays: str,
) -> dict[str, Any]:
    """Bake the material in `slot` of a depsgraph's instance into `folder`, `size` texels along each side.

    Light Path answers as to `rays` of that kind (`probe.light_path.ANSWERS`); of those from `BEHIND` values are those
    of the back, and normals those of the front, which the backend turns.

    Returns ``corners``, the name of a .npy with UV (triangles, 3, 2) of all triangles of the object; ``leaves``,
    those that reflect light or let it through, each with ``kind``, ``name``, ``weight``, ``sockets`` and what of the
    node's settings counts; ``emission`` and for leaves ``normal``, where there are any, and ``shading_normal`` where a
    displacement bends those that it lies on; ``view``, ``paths``,
    ``around`` and ``place``: what of the view, of light paths, of other objects and of its own place the nodes ask
    for; ``sides``: whether for the side that is seen; ``alone``: whether there is one closure in all; ``left_out``:
    linked sockets that are not baked. A value is a number, a list, or the name of a .npy (size, size, channels), first
    row at the top, in the working space. Normals are in the frame of the map: its u axis, the normal's side of it, the
    smooth normal.
    """
    shown = material_of_slot(instance.object, slot)
    assert shown is not None  # a surface without material needs no bake
    material = shown.original.copy()
    groups: list[bpy.types.NodeTree] = []
    try:
        tree = material.node_tree
        paths, place = light_path_outputs(tree), asked_of_place(tree)
        groups += answer_light_paths(tree, ANSWERS["scattered" if rays == BEHIND else rays])
        if instance.is_instance:  # what is none has a number by its name, which the object on stage has, too
            groups += answer_random(tree, instance.random_id % (MOST_RANDOM + 1) / MOST_RANDOM)
        sides = bool(asked_for(tree, OF_SIDE))
        if rays == BEHIND:
            groups += answer_backfacing(tree)
        view, around = asked_for(tree, OF_VIEW), asked_for(tree, OF_SURROUNDINGS)
        emits = _emits(tree)
        bends = bends_normals(material) or any(_is_bumped(node) for node in nodes_of(tree))
        with surface_stage(scene, instance, depsgraph, slot, material, size, for_normals=bends) as stage:
            baked = _Bake(stage, material, folder, size, of_view=bool(view), of_back=rays == BEHIND)
            answer: dict[str, Any] = {"view": view, "paths": sorted(paths), "around": around}
            answer["place"], answer["sides"] = place, sides
            if emits:
                answer["emission"] = baked.file(baked.closure())
            own = own_groups(tree)
            groups += own
            keep_alphas((tree, *own))
            closures = ClosureTree(tree)
            answer["leaves"] = _leaves(closures, baked)
            answer["alone"] = len(closures.leaves) == 1
            sockets = [leaf.node.inputs.get(name) for leaf in closures.leaves for name in LEFT_OUT]
            answer["left_out"] = sorted({socket.name for socket in sockets if socket is not None and socket.is_linked})
            np.save(folder / "corners.npy", stage.corners)
            answer["corners"] = "corners.npy"
            return answer
    finally:
        bpy.data.materials.remove(material)
        for group in groups:
            bpy.data.node_groups.remove(group)


def _leaves(closures: ClosureTree, baked: _Bake) -> list[dict[str, Any]]:
    asked: list[tuple[dict[str, Any], str, Value, bool]] = []
    leaves = []
    reflecting = [leaf for leaf in closures.leaves if is_shader(leaf.node) and leaf.node.bl_idname != EMISSION]
    for leaf in reflecting:
        found: dict[str, Any] = {"kind": leaf.node.bl_idname, "label": leaf.node.bl_label, "sockets": {}}
        found |= {"distribution": distribution_of(leaf.node), "walks": walks_of(leaf.node)}
        kind = kind_of(leaf.node)
        if kind is not None:
            found |= {"nearest": only_nearest(leaf.node), "shader": kind.shader}
        asked.append((found, "weight", leaf.weight, False))
        for socket in leaf.node.inputs:
            if socket.name not in SKIPPED and socket.type != "SHADER" and socket.enabled:
                several = socket.type != "VALUE"  # whatever is linked: a colour on Roughness is one number
                asked.append((found["sockets"], socket.name, closures.bounded(leaf, socket), several))
        leaves.append(found)
    baked.values(asked)
    for found, leaf in zip(leaves, reflecting, strict=True):
        normal = _normal(closures, leaf)
        if normal is None:
            bent = baked.bent
            if bent is not None:
                found |= {"normal": bent, "displaced": True, "turned": baked.turns_on_backs(None)}
            continue
        local = baked.local_normal(normal)
        if baked.bent is not None:  # how far a lobe's normal is from that decides what a bump shades
            found |= {"shading_normal": baked.bent, "shading_turned": baked.turns_on_backs(None)}
        if baked.bent is not None or not _is_flat(local):
            found |= {"normal": baked.file(local), "displaced": False, "turned": baked.turns_on_backs(normal)}
    return leaves


def _is_bumped(shader: bpy.types.Node) -> bool:
    """Whether nodes give a shader its normal."""
    socket = shader.inputs.get("Normal")
    return socket is not None and socket.is_linked


def _is_flat(local: Pixels) -> bool:
    """Whether the normals of a map bend nothing."""
    return np.abs(local[..., :2]).max() <= FLAT


def _normal(closures: ClosureTree, leaf: Leaf) -> Value | None:
    if not _is_bumped(leaf.node):
        return None
    value = closures.value(leaf.path, leaf.node.inputs["Normal"])
    return value if hasattr(value, "is_output") else None


class _Bake:
    """Bakes of one material, kept in a folder."""

    def __init__(
        self,
        stage: SurfaceStage,
        material: bpy.types.Material,
        folder: Path,
        size: int,
        *,
        of_view: bool,
        of_back: bool,
    ) -> None:
        self._stage, self._folder, self._size, self._of_back = stage, folder, size, of_back
        self._material, self._tree = material, material.node_tree
        self._output: Any = active_output(self._tree) or self._tree.nodes.new("ShaderNodeOutputMaterial")
        self._count = 0
        self._covered: NDArray[np.bool_] | None = None
        self._frame: tuple[Pixels, Pixels] | None = None
        stage.scene.render.bake.view_from = "ACTIVE_CAMERA" if of_view and stage.scene.camera else "ABOVE_SURFACE"

    def file(self, pixels: Pixels) -> str:
        """Keep a picture and return its name."""
        self._count += 1
        name = f"{self._count:03d}.npy"
        np.save(self._folder / name, pixels)
        return name

    def closure(self) -> Pixels:
        """The emission of the material as it is."""
        image = bpy.data.images.new("material_fit", self._size, self._size, float_buffer=True, is_data=True)
        blank = bpy.data.images.new("material_fit_blank", 4, 4, float_buffer=True, is_data=True)
        made = []
        try:
            for slot in self._stage.item.material_slots:
                tree = slot.material.node_tree
                if tree is None:
                    slot.material.use_nodes = True
                    tree = slot.material.node_tree
                node = tree.nodes.new("ShaderNodeTexImage")
                made.append((tree, node))
                node.image = image if slot.material == self._material else blank
                tree.nodes.active = node
            bake(self._stage.stage, "EMIT")
            pixels = np.empty(self._size * self._size * 4, dtype=np.float32)
            image.pixels.foreach_get(pixels)
            return np.ascontiguousarray(pixels.reshape(self._size, self._size, 4)[::-1, :, :3])
        finally:
            for tree, node in made:
                tree.nodes.remove(node)
            bpy.data.images.remove(image)
            bpy.data.images.remove(blank)

    def values(self, asked: list[tuple[dict[str, Any], str, Value, bool]]) -> None:
        """Put each value, or the name of its picture, where it is asked for.

        Three numbers share a bake, and so does all that one output gives.
        The last of each says whether its socket holds several numbers.
        """
        with self._turned():
            self._values(asked)

    @contextmanager
    def _turned(self) -> Iterator[None]:
        """The mesh with the side outside that is baked."""
        mesh: Any = self._stage.item.data
        if self._of_back:
            mesh.flip_normals()
        try:
            yield
        finally:
            if self._of_back:
                mesh.flip_normals()

    def _values(self, asked: list[tuple[dict[str, Any], str, Value, bool]]) -> None:
        colors: dict[int, tuple[Value, list[tuple[dict[str, Any], str]]]] = {}
        numbers: dict[int, tuple[Value, list[tuple[dict[str, Any], str]]]] = {}
        for place, name, value, several in asked:
            if not hasattr(value, "is_output"):
                place[name] = value
                continue
            _, places = (colors if several else numbers).setdefault(value.as_pointer(), (value, []))
            places.append((place, name))
        for value, places in colors.values():
            self._fill(places, self._of_socket(value))
        listed = list(numbers.values())
        for first in range(0, len(listed), 3):
            three = listed[first : first + 3]
            joined = self._tree.nodes.new("ShaderNodeCombineColor")
            for (value, _), socket in zip(three, joined.inputs, strict=False):
                self._tree.links.new(value, socket)
            pixels = self._of_socket(joined.outputs[0])
            for channel, (_, places) in enumerate(three):
                self._fill(places, pixels[:, :, channel : channel + 1])

    def _fill(self, places: list[tuple[dict[str, Any], str]], pixels: Pixels) -> None:
        """Put what one output gives wherever it is asked for."""
        found = self._put(pixels)
        for place, name in places:
            place[name] = found

    def local_normal(self, socket: bpy.types.NodeSocket | None) -> Pixels:
        """A normal in the frame of the map; without a `socket` the one that a displacement by bump makes."""
        if self._frame is None:
            with unbent(self._material):
                smooth, along = self._vector(self._geometry), self._vector(self._attribute(TANGENT))
                if NORMAL in self._stage.item.data.attributes:
                    kept = self._vector(self._attribute(NORMAL))
                    smooth = np.where(np.linalg.norm(kept, axis=2, keepdims=True) > 0.5, kept, smooth)
            self._frame = _unit(smooth), _unit(along)
        smooth, along = self._frame
        normal = self._vector(socket or self._geometry)
        if self._size < FINEST_NORMALS and 1.0 - np.mean((normal[self._where] ** 2).sum(axis=1)) > MOST_SPREAD:
            self._size, self._frame, self._covered = 2 * self._size, None, None
            return self.local_normal(socket)
        side = _unit(along - smooth * (along * smooth).sum(axis=2, keepdims=True))
        third = np.cross(smooth, side)
        local = np.stack([(axis * _unit(normal)).sum(axis=2) for axis in (side, third, smooth)], axis=2)
        is_known = np.linalg.norm(local, axis=2, keepdims=True) > 0.5
        return np.where(is_known, _unit(local), (0.0, 0.0, 1.0)).astype(np.float32)

    @cached_property
    def bent(self) -> str | None:
        """The file of the normals that a displacement by bump makes for all lobes, None where it bends nothing."""
        local = self.local_normal(None) if bends_normals(self._material) else None
        return None if local is None or _is_flat(local) else self.file(local)

    def turns_on_backs(self, socket: bpy.types.NodeSocket | None) -> bool:
        """Whether the normal of `local_normal` has the opposite direction on back faces."""
        if socket is not None:
            return turns_on_backs(socket)
        return is_displaced_hollow(self._material, by_language=self._stage.scene.cycles.shading_system)

    def _attribute(self, name: str) -> bpy.types.NodeSocket:
        node: Any = self._tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = name
        return node.outputs["Vector"]

    @property
    def _geometry(self) -> bpy.types.NodeSocket:
        return self._tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]

    def _vector(self, socket: bpy.types.NodeSocket) -> Pixels:
        """Means of vectors; emission has no negative colours."""
        node = self._tree.nodes.new("ShaderNodeVectorMath")
        node.operation = "MULTIPLY_ADD"
        self._tree.links.new(socket, node.inputs[0])
        node.inputs[1].default_value = node.inputs[2].default_value = (0.5, 0.5, 0.5)
        return 2.0 * self._of_socket(node.outputs[0]) - 1.0

    @property
    def _where(self) -> NDArray[np.bool_]:
        """Texels that are baked or lie beside those; Blender leaves all others black."""
        if self._covered is None:
            self._covered = self._of_socket(None)[:, :, 0] > 0.5
        return self._covered

    def _of_socket(self, socket: bpy.types.NodeSocket | None) -> Pixels:
        """What feeds from `socket`; white without one."""
        emission = self._tree.nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        if socket is not None:
            self._tree.links.new(socket, emission.inputs["Color"])
        self._tree.links.new(emission.outputs[0], self._output.inputs["Surface"])
        try:
            return self.closure()
        finally:
            self._tree.nodes.remove(emission)

    def _put(self, pixels: Pixels) -> Any:
        """The name of a picture, or its value where it is the same everywhere."""
        covered = pixels[self._where]
        if not len(covered):
            return 0.0 if pixels.shape[2] == 1 else [0.0, 0.0, 0.0]
        low, high = covered.min(axis=0), covered.max(axis=0)
        if np.all(high - low <= 1e-4 * np.maximum(np.abs(high), 1e-3)):
            return float(high[0]) if len(high) == 1 else [float(number) for number in high]
        pixels[~self._where] = covered.mean(axis=0)  # filtering may look at texels beside the islands
        return self.file(pixels)


def _unit(vectors: Pixels) -> Pixels:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=2, keepdims=True), 1e-12)


def _emits(tree: bpy.types.NodeTree) -> bool:
    if any(link.from_socket.type != "SHADER" and link.to_socket.type == "SHADER" for link in tree.links):
        return True
    for node in tree.nodes:
        if node.bl_idname == EMISSION:
            return True
        strength = node.inputs.get("Emission Strength")
        if strength is not None and (strength.is_linked or strength.default_value != 0.0):
            return True
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and _emits(node.node_tree):
            return True
    return False
