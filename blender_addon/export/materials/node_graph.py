# SPDX-License-Identifier: GPL-3.0-or-later
"""The target's sockets that its nodes give: Cycles evaluates them in a second Blender, and the job takes the values."""

from __future__ import annotations

import shutil
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy

from ...probe.client import Probe, ProbeError
from ..findings import ExportError, Findings
from ..material_model import Material, Socket
from ..nodes.target_shader import chosen_leaf, fitted_leaves, leaf_name, target_shader
from .read_material import read_target

FOLDER = "graph"
# Subpixels along a pixel, and samples of each. Pictures of the truth differ from Cycles' by a FLIP of 0.062 at one
# subpixel and 0.013 at four, under a strong bump
SCALE, SAMPLES = 4, 4
# Times that a ray meets a target which lets light through, and finds what nodes give: of the far side, too
DEPTHS = 4


@dataclass(frozen=True)
class NodeGraph:
    """What the graph gives: the files to go into the job, and the camera's matrix they were seen through."""

    camera: list[list[float]]
    positions: Path
    files: tuple[Path, ...]
    depths: int = 1

    def request(self) -> dict[str, Any]:
        """The entry of request.json."""
        entry = {"camera": self.camera, "positions": f"{FOLDER}/{self.positions.name}"}
        return entry | {"depths": self.depths} if self.depths > 1 else entry

    def write(self, folder: Path) -> None:
        """Move the files into a job folder."""
        (folder / FOLDER).mkdir()
        for path in self.files:
            shutil.move(path, folder / FOLDER / path.name)


@contextmanager
def probe_for(obj: bpy.types.Object | None, *, always: bool = False) -> Iterator[Probe | None]:
    """A second Blender where the active material of `obj` needs one, started beside what the caller does next.

    `always` says that values of its graph are fitted, so that one is needed whatever the graph is.

    Raises
    ------
    ExportError
        If it is needed and cannot be started.
    """
    slot, slots = (0, ()) if obj is None else (obj.active_material_index, obj.material_slots)
    material = slots[slot].material if slot < len(slots) else None
    if obj is None or material is None or target_shader(material) is None:
        yield None
        return
    described = read_target(material, obj.name, slot, Findings())
    if described is None or not (always or described.asks_graph):
        yield None
        return
    try:
        with Probe() as probe:
            yield probe
    except ProbeError as error:
        raise ExportError(str(error)) from error


def largest_leaf(probe: Probe, context: bpy.types.Context, obj: bpy.types.Object) -> str | None:
    """The name of the leaf that covers most of the target in the picture; None where there is nothing to choose.

    Raises
    ------
    ProbeError
        If Cycles cannot evaluate the graph.
    """
    material = obj.active_material
    leaves = fitted_leaves(material)
    if len(leaves) < 2 or chosen_leaf(material) or not any(leaf.is_linked for leaf in leaves):
        return None
    asked = [{"node": leaf.path, "sockets": [], "weight": leaf.is_linked} for leaf in leaves]
    _send(probe, context, obj, asked, scale=1)
    answer = probe.receive()  # waited for: the scene is read by it, and must be as in the copy that was asked
    shares = [
        found["weight"]["mean"][0] if leaf.is_linked else leaf.share
        for leaf, found in zip(leaves, answer["leaves"], strict=True)
    ]
    return leaf_name(leaves[shares.index(max(shares))])


def _send(
    probe: Probe,
    context: bpy.types.Context,
    obj: bpy.types.Object,
    leaves: list[dict[str, Any]],
    scale: int,
    depths: int = 1,
) -> None:
    probe.send(
        "sockets",
        scene=context.scene.name, layer=context.view_layer.name, object=obj.name, slot=obj.active_material_index,
        leaves=leaves, scale=scale, samples=SAMPLES, folder=str(probe.folder), depths=depths,
    )  # fmt: skip


def names_by_graph(material: Material) -> list[str]:
    """The sockets that Cycles has to evaluate."""
    return [name for name, socket in material.sockets.items() if socket.by_graph]


def evaluate_graph(
    probe: Probe, context: bpy.types.Context, obj: bpy.types.Object, material: Material
) -> Generator[None, None, tuple[Material, NodeGraph]]:
    """The material with the mean of each socket of its graph, and the pictures of them; yields while Cycles works.

    Raises
    ------
    ProbeError
        If Cycles cannot evaluate the graph.
    """
    leaves = (material, *material.leaves)
    asked = [
        {
            "node": list(leaf.node),
            "sockets": [_own_name(leaf, name) for name in names_by_graph(leaf)],
            "weight": leaf.weight.by_graph,
        }
        for leaf in leaves
    ]
    depths = DEPTHS if material.passes_light else 1
    _send(probe, context, obj, asked, SCALE, depths)
    while not probe.is_answered():
        yield
    answer = probe.receive()
    files = [probe.folder / answer["positions"]]

    def seen(socket: Socket, found: dict[str, Any]) -> Socket:
        files.append(probe.folder / found["file"])
        mean = found["mean"]
        return replace(socket, value=mean if len(mean) > 1 else mean[0], seen=files[-1])

    def evaluated(leaf: Material, found: dict[str, Any]) -> Material:
        sockets = dict(leaf.sockets)
        for name in names_by_graph(leaf):
            sockets[name] = seen(sockets[name], found["sockets"][_own_name(leaf, name)])
        weight = seen(leaf.weight, found["weight"]) if leaf.weight.by_graph else leaf.weight
        return replace(leaf, sockets=sockets, weight=weight)

    fitted, *held = map(evaluated, leaves, answer["leaves"])
    return replace(fitted, leaves=tuple(held)), NodeGraph(answer["camera"], files[0], tuple(files), depths)


def _own_name(leaf: Material, name: str) -> str:
    return leaf.labels.get(name, name)
