# SPDX-License-Identifier: GPL-3.0-or-later
"""What the nodes of a lamp make of its light, measured by the Blender this runs in: light on small white faces.

Cycles asks a lamp's nodes for every ray of light. So faces that look at the lamp are lit by it twice, by its nodes and
by plain white ones, and the quotient is what the nodes give there: by direction, by place on the lamp, by distance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..probe.server import ProbeRequestError
from ..versions import active_output, node_tree_of
from .lamp_layout import CONSTANT, NORMAL, PLACE, directions, distances, places
from .stage import NAME, Stage, alone, bake

Numbers = NDArray[np.float64]  # (points, 3)

# pixels along each side of a pattern, of textures or of anything else: 0.3 or 0.6 degrees, where it holds half a sphere
FINE, COARSE = 512, 256
DISTANCE = 1.0  # metres from the lamp, where nothing asks for it
# size of a face, as a share of its distance from the lamp; Cycles looks up to a third of that beside its corner
FACE = 1e-4
TINY = 1e-5  # metres; from a face an area light of that size lies in one direction
SURE = 1e-1  # metres; nearer to it than that it does not
WIDEST = 89.0  # degrees from an area light's axis, which shines on one side
LOOKED_AT = 16  # directions that say whether all fall alike with the distance
ALIKE_DIRECTIONS = 2e-3  # the largest difference of two that do, of the larger one
# of places on a lamp, of which some lie at the edges of a picture: farther away faces look beside their place there
DISTINCT = 5.0  # metres
ALIKE_PLACES = 5e-2  # of the strongest place
AWAY_FROM_EDGES = 0.75  # of the places; what changes on fewer is not told from edges
COLORS = "material_fit"
TURN = np.diag([1.0, -1.0, -1.0])  # a Blender lamp shines along its -Z, a pattern's along +Z


def lamp_table(
    scene: bpy.types.Scene, instance: bpy.types.DepsgraphObjectInstance, asked: Mapping[str, Any], folder: Path
) -> dict[str, Any]:
    """Measure what the nodes of an instance's lamp multiply its light with, and write it into `folder`.

    `asked` has a `Lookup`, and for directions the `rim` of a disc (degrees) and how many `halves` there are. The answer
    has a `color`, or the name of a `pattern` (points, 3) laid out as `directions` or `places`, and where it falls the
    name of a `falloff` (distances, 3) that the rest is multiplied with. All is linear, in Blender's working space.

    Raises
    ------
    ProbeRequestError
        If the values are no such product, or no light.
    """
    with _lamp_stage(scene, instance, asked) as (stage, lamp):
        faces = _Faces(stage, lamp)
        rim, halves, by = asked["rim"], asked["halves"], asked["by"]
        falloff, distance = None, DISTANCE
        side = FINE if asked["fine"] else COARSE
        if asked["falls"] and lamp.data.type != "SUN":
            straight = np.array([[0.0, 0.0, 1.0]])
            apart = {CONSTANT: lambda: straight, PLACE: _spread_places}.get(by, lambda: _spread(rim, halves))()
            steps = distances()
            measure = faces.before if by == PLACE else faces.around
            found = measure(np.repeat(apart, len(steps), axis=0), np.tile(steps, len(apart)))
            falloff, distance = _by_distance(found.reshape(len(apart), len(steps), 3), steps, of_places=by == PLACE)
        if by == CONSTANT:
            pixels = faces.around(np.array([[0.0, 0.0, 1.0]]), distance)
        elif by == PLACE:
            pixels = faces.before(places(side), distance)
        else:
            pixels = faces.around(directions(side, rim, halves), distance)
    if not np.isfinite(pixels).all():
        raise ProbeRequestError("Their light is not finite.")
    if pixels.min() < 0.0:
        raise ProbeRequestError("Their light is below zero.")
    answer: dict[str, Any] = {} if by != CONSTANT else {"color": pixels[0].tolist()}
    for name, values in (("pattern", None if by == CONSTANT else pixels), ("falloff", falloff)):
        if values is not None:
            np.save(folder / f"{name}.npy", values.astype(np.float32))
            answer[name] = f"{name}.npy"
    return answer


class _Faces:
    """White faces that look at a lamp, and what its nodes multiply the light on them with."""

    def __init__(self, stage: bpy.types.Scene, lamp: bpy.types.Object) -> None:
        self._stage, self._lamp = stage, lamp
        matrix = np.array(lamp.matrix_world, dtype=np.float64)
        self._place, self._frame = matrix[:3, 3], matrix[:3, :3] @ TURN
        # `around` makes a point of the lamp
        data: Any = lamp.data
        is_long = data.type == "AREA" and data.shape in ("RECTANGLE", "ELLIPSE")
        self._sizes = (data.size, data.size_y if is_long else data.size) if data.type == "AREA" else (0.0, 0.0)

    def around(self, local: Numbers, distance: Any) -> Numbers:
        """Factors in local directions at distances from the lamp, which is a point meanwhile."""
        away = local @ self._frame.T
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        distance = np.broadcast_to(np.asarray(distance, dtype=np.float64), len(away))[:, None]
        _shrink(self._lamp.data)
        return self._factors(self._place + distance * away, away, distance)

    def before(self, on_square: Numbers, distance: Any) -> Numbers:
        """Factors at places on an area light at distances from it, which shines straight ahead meanwhile."""
        data, sizes = self._lamp.data, self._sizes
        data.shape, data.size, data.size_y, data.spread = "RECTANGLE", *sizes, 0.0
        away = np.cross(self._frame[:, 0], self._frame[:, 1])
        away = np.broadcast_to(away / np.linalg.norm(away), (len(on_square), 3))
        distance = np.broadcast_to(np.asarray(distance, dtype=np.float64), len(away))[:, None]
        points = self._place + on_square * [sizes[0] / 2.0, sizes[1] / 2.0, 0.0] @ self._frame.T + distance * away
        return self._factors(points, away, distance)

    def _factors(self, points: Numbers, away: Numbers, distance: Numbers) -> Numbers:
        mesh = _faces(points, away, FACE * distance)
        material = bpy.data.materials.new(COLORS)
        item = bpy.data.objects.new(COLORS, mesh)
        try:
            if material.node_tree is None:  # before Blender 5
                material.use_nodes = True
            _shine(material.node_tree, "ShaderNodeBsdfDiffuse", (1.0, 1.0, 1.0, 1.0))
            mesh.materials.append(material)
            self._stage.collection.objects.link(item)
            lit = _lit(Stage(self._stage, item))
            with _plain(self._lamp.data):
                plain = _lit(Stage(self._stage, item))
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.where(plain > 0.0, lit / plain, 0.0)
        finally:
            bpy.data.objects.remove(item)
            bpy.data.meshes.remove(mesh)
            bpy.data.materials.remove(material)


@contextmanager
def _lamp_stage(
    scene: bpy.types.Scene, instance: bpy.types.DepsgraphObjectInstance, asked: Mapping[str, Any]
) -> Iterator[tuple[bpy.types.Scene, bpy.types.Object]]:
    """A scene with a white copy of the instance's lamp, without a radius, a soft rim and shadows, and nothing else."""
    matrix, data = instance.matrix_world.copy(), instance.object.original.data.copy()
    lamp = bpy.data.objects.new(NAME, data)
    try:
        # far from zero the kernel's places are coarse
        lamp.matrix_world = matrix if asked["placed"] else matrix.to_3x3().to_4x4()
        if asked["by"] == NORMAL:  # which a cone does not limit
            data.type = "POINT"
            data = lamp.data
        data.color, data.energy, data.use_shadow = (1.0, 1.0, 1.0), 1.0, False
        if hasattr(data, "use_temperature"):  # Blender 4.5
            data.use_temperature = False
        with alone(scene, instance, lamp) as stage:
            stage.cycles.samples, stage.cycles.light_sampling_threshold = 1, 0.0
            settings = stage.render.bake
            settings.target = "VERTEX_COLORS"
            settings.use_pass_direct, settings.use_pass_indirect, settings.use_pass_color = True, False, False
            yield stage, lamp
    finally:
        bpy.data.objects.remove(lamp)
        bpy.data.lights.remove(data)


def _shrink(data: Any) -> None:
    """Make a light a point as far as it can be one; what its nodes are told of directions stays."""
    if data.type in ("POINT", "SPOT"):
        data.shadow_soft_size, data.use_soft_falloff = 0.0, True
    if data.type == "SPOT":
        data.spot_blend = 0.0
    if data.type == "SUN":
        data.angle = 0.0
    if data.type == "AREA":
        data.shape, data.size, data.spread = "DISK", TINY, math.pi  # a square is sampled less exactly


@contextmanager
def _plain(data: bpy.types.Light) -> Iterator[None]:
    """The light with one plain white emission instead of its nodes."""
    tree: Any = node_tree_of(data)
    output: Any = active_output(tree)
    before = [link.from_socket for link in output.inputs["Surface"].links]
    emission = _shine(tree, "ShaderNodeEmission", (1.0, 1.0, 1.0, 1.0))
    try:
        yield
    finally:
        tree.nodes.remove(emission)
        for socket in before:
            tree.links.new(socket, output.inputs["Surface"])


def _shine(tree: Any, kind: str, color: tuple[float, float, float, float]) -> bpy.types.Node:
    """Put a shader of one colour on the surface of a tree."""
    node, output = tree.nodes.new(kind), active_output(tree)
    assert output is not None
    node.inputs["Color"].default_value = color
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return node


def _faces(points: Numbers, away: Numbers, sizes: Numbers) -> Any:
    """A mesh of triangles whose first corners are `points` and whose fronts look against `away`."""
    helper = np.eye(3)[np.argmin(np.abs(away), axis=1)]
    side = np.cross(away, helper)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    corners = np.stack([points, points + sizes * np.cross(away, side), points + sizes * side], axis=1)
    count = len(points)
    mesh: Any = bpy.data.meshes.new(COLORS)
    mesh.vertices.add(3 * count)
    mesh.vertices.foreach_set("co", corners.astype(np.float32).ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", np.arange(3 * count, dtype=np.int32))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


def _lit(stage: Stage) -> Numbers:
    """The direct light at the first corner of each face."""
    mesh: Any = stage.item.data
    colors = mesh.color_attributes.new(COLORS, "FLOAT_COLOR", "CORNER")
    name = colors.name
    try:
        mesh.color_attributes.active_color = colors
        bake(stage, "DIFFUSE")
        found = np.empty(len(mesh.loops) * 4, dtype=np.float32)
        mesh.color_attributes[name].data.foreach_get("color", found)
        return found.reshape(-1, 3, 4)[:, 0, :3].astype(np.float64)
    finally:
        mesh.color_attributes.remove(mesh.color_attributes[name])


def _spread(rim: float, halves: int) -> Numbers:
    """Unit vectors spread evenly over all directions, or up to `rim` degrees from +Z."""
    number = np.arange(LOOKED_AT, dtype=np.float64) + 0.5
    least = -1.0 if halves == 2 else math.cos(math.radians(min(rim, WIDEST)))
    up = 1.0 - (1.0 - least) * number / LOOKED_AT
    turn = number * math.pi * (3.0 - math.sqrt(5.0))
    across = np.sqrt(1.0 - up**2)
    return np.stack([across * np.cos(turn), across * np.sin(turn), up], axis=1).astype(np.float64)


def _spread_places() -> Numbers:
    """Places spread evenly over a square from -1 to 1."""
    number = np.arange(LOOKED_AT, dtype=np.float64)[:, None] + 1.0
    # the two-dimensional sequence of Roberts, which keeps away from lines of the places before
    across = (0.5 + number * [0.7548776662466927, 0.5698402909980532]) % 1.0
    return np.concatenate([2.0 * across - 1.0, np.zeros_like(number)], axis=1)


def _by_distance(
    found: NDArray[np.float64], steps: NDArray[np.float64], *, of_places: bool = False
) -> tuple[Numbers, float]:
    """The factors (distances, 3) of the strongest of some directions or places (directions, distances, 3) over those
    at one distance, and that.

    Raises
    ------
    ProbeRequestError
        If the others do not change alike.
    """
    strongest = found[np.argmax((found / np.maximum(found.max(axis=(0, 2)), 1e-30)[:, None]).sum(axis=(1, 2)))]
    lit = (strongest > 0.0).any(axis=1)
    if not lit.any():
        return np.zeros_like(strongest), DISTANCE
    there = int(np.argmin(np.where(lit, np.abs(np.log(steps / DISTANCE)), np.inf)))
    base = np.where(strongest[there] > 0.0, strongest[there], 1.0)
    falloff = strongest / base
    expected = found[:, there : there + 1] * falloff
    most = np.maximum(np.maximum(found, expected).max(axis=(0, 2)), 1e-30)[:, None]
    off = np.abs(found - expected) / most
    if not of_places and float(off[:, steps > SURE].max()) > ALIKE_DIRECTIONS:
        raise ProbeRequestError("Their light changes with the distance in another way in each direction.")
    of_each = off[:, (steps > SURE) & (steps < DISTINCT)].max(axis=(1, 2))
    if of_places and float(np.quantile(of_each, AWAY_FROM_EDGES)) > ALIKE_PLACES:
        raise ProbeRequestError("Their light changes with the distance in another way at each place of the lamp.")
    return falloff, float(steps[there])
