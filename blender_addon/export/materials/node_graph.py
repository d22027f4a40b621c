# SPDX-License-Identifier: GPL-3.0-or-later
"""The target's sockets that its nodes give: Cycles evaluates them in a second Blender, and the job takes the values."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...probe.client import Probe, ProbeError
from ...versions import node_tree_of
from ..camera.camera_model import Region, edges_of
from ..findings import ExportError, Findings
from ..fitted_slot import FittedSlot
from ..material_model import Material, Socket
from ..nodes.dependence import asked_of_side
from ..nodes.target_shader import chosen_leaf, fitted_leaves, leaf_name, target_shader
from ..steps import Pause, Steps
from .read_material import read_target

FOLDER = "graph"
# Subpixels along a pixel, and samples of each. Pictures of the truth differ from Cycles' by a FLIP of 0.062 at one
# subpixel and 0.013 at four, under a strong bump
SCALE, SAMPLES = 4, 4
# Times that a ray meets a target which lets light through, and finds what nodes give: of the far side, too
DEPTHS = 4
EMISSION_SOCKETS = ("Emission Color", "Emission Strength")


@dataclass(frozen=True)
class NodeGraph:
    """What the graph gives: the files to go into the job, and the camera's matrix they were seen through.

    `scale` is how many subpixels along a pixel they have.
    """

    camera: list[list[float]]
    positions: Path
    files: tuple[Path, ...]
    depths: int = 1
    scale: int = SCALE

    def request(self) -> dict[str, Any]:
        """The entry of request.json."""
        entry = {"camera": self.camera, "positions": f"{FOLDER}/{self.positions.name}", "scale": self.scale}
        return entry | {"depths": self.depths} if self.depths > 1 else entry

    def write(self, folder: Path) -> None:
        """Move the files into a job folder."""
        (folder / FOLDER).mkdir(exist_ok=True)
        for path in self.files:
            shutil.move(path, folder / FOLDER / path.name)


@contextmanager
def probe_for(fitted: Sequence[FittedSlot], *, always: bool = False) -> Iterator[Probe | None]:
    """A second Blender where one of the fitted materials needs one, started beside what the caller does next.

    `always` says that values of its graph are fitted, so that one is needed whatever the graph is.

    Raises
    ------
    ExportError
        If it is needed and cannot be started.
    """
    if not (always or any(asks_graph(each) for each in fitted)):
        yield None
        return
    try:
        with Probe() as probe:
            yield probe
    except ProbeError as error:
        raise ExportError(str(error)) from error


def asks_graph(fitted: FittedSlot) -> bool:
    """Whether Cycles has to evaluate nodes of the material."""
    material = fitted.material
    if material is None or target_shader(material) is None:
        return False
    described = read_target(material, fitted.object.name, fitted.slot, Findings())
    return described is not None and described.asks_graph


def asks_leaf(fitted: FittedSlot) -> bool:
    """Whether the picture says which shader of the material's mix is fitted."""
    leaves = [] if fitted.material is None else fitted_leaves(fitted.material)
    return len(leaves) > 1 and not chosen_leaf(fitted.material) and any(leaf.is_linked for leaf in leaves)


def largest_leaf(
    probe: Probe,
    context: bpy.types.Context,
    fitted: FittedSlot,
    *,
    may_miss: bool = False,
    region: Region | None = None,
) -> Steps[str | None]:
    """The name of the leaf that covers most of the target in the picture, which may show a `region` of the frame.

    None where there is nothing to choose, or the camera does not see a target that it `may_miss`. The scene is read by
    it, and must be as in the copy that was asked.

    Raises
    ------
    ProbeError
        If Cycles cannot evaluate the graph.
    """
    if not asks_leaf(fitted):
        return None
    leaves = fitted_leaves(fitted.material)
    asked = [{"node": leaf.path, "sockets": [], "weight": leaf.is_linked} for leaf in leaves]
    _send(probe, context, fitted, asked, 1, probe.folder, elsewhere=False, may_miss=may_miss, region=region)
    yield Pause(probe.is_answered, holds_scene=True)
    answer = probe.receive()
    if not answer.get("seen", True):
        return None
    shares = [
        found["weight"]["mean"][0] if leaf.is_linked else leaf.share
        for leaf, found in zip(leaves, answer["leaves"], strict=True)
    ]
    return leaf_name(leaves[shares.index(max(shares))])


def _send(
    probe: Probe,
    context: bpy.types.Context,
    fitted: FittedSlot,
    leaves: list[dict[str, Any]],
    scale: int,
    folder: Path,
    depths: int = 1,
    *,
    elsewhere: bool = True,
    far_side: bool = False,
    may_miss: bool = False,
    region: Region | None = None,
    origin: NDArray[np.float64] | None = None,
) -> None:
    probe.send(
        "sockets",
        scene=context.scene.name, layer=context.view_layer.name, object=fitted.object.name, slot=fitted.slot,
        leaves=leaves, scale=scale, samples=SAMPLES, folder=str(folder), elsewhere=elsewhere, depths=depths,
        far_side=far_side, may_miss=may_miss, region=edges_of(region),
        origin=None if origin is None else origin.tolist(),
    )  # fmt: skip


def names_by_graph(material: Material) -> list[str]:
    """The sockets that Cycles has to evaluate."""
    return [name for name, socket in material.sockets.items() if socket.by_graph]


def evaluate_graph(
    probe: Probe,
    context: bpy.types.Context,
    fitted: FittedSlot,
    material: Material,
    number: int = 0,
    *,
    may_miss: bool = False,
    region: Region | None = None,
    origin: NDArray[np.float64] | None = None,
) -> Steps[tuple[Material, NodeGraph | None]]:
    """The material with the mean of each socket of its graph, and the pictures of them; pauses while Cycles works.

    Several fitted materials have different numbers, so that their files do not meet. One that the camera does not see
    and `may_miss` stays as it is, without pictures.

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
    folder = probe.folder / f"target_{number}"
    folder.mkdir(exist_ok=True)
    depths, where = DEPTHS if material.passes_light else 1, {"may_miss": may_miss, "region": region, "origin": origin}
    far_side = depths == 1 and _far_side_is_known(fitted.material)
    _send(probe, context, fitted, asked, SCALE, folder, depths, far_side=far_side, **where)
    yield Pause(probe.is_answered)
    answer = probe.receive()
    if not answer.get("seen", True):
        return _perhaps_glowing(material), None
    files = [folder / answer["positions"]]

    def seen(socket: Socket, found: dict[str, Any]) -> Socket:
        here, mean = folder / found["file"], found["mean"]
        elsewhere = folder / found["elsewhere"] if "elsewhere" in found else None
        files.extend(path for path in (here, elsewhere) if path is not None)
        return replace(socket, value=mean if len(mean) > 1 else mean[0], seen=here, elsewhere=elsewhere)

    def evaluated(leaf: Material, found: dict[str, Any]) -> Material:
        sockets = dict(leaf.sockets)
        for name in names_by_graph(leaf):
            sockets[name] = seen(sockets[name], found["sockets"][_own_name(leaf, name)])
        weight = seen(leaf.weight, found["weight"]) if leaf.weight.by_graph else leaf.weight
        return replace(leaf, sockets=sockets, weight=weight)

    first, *held = map(evaluated, leaves, answer["leaves"])
    seen_by = NodeGraph(answer["camera"], files[0], tuple(files), answer["depths"], answer["scale"])
    return replace(first, leaves=tuple(held)), seen_by


def _far_side_is_known(material: bpy.types.Material | None) -> bool:
    """Whether the far side is from within, as the camera would see it, what it is from outside.

    Mirrors and bounces show it. With the average of the near side a ball that is black behind and white before was
    1.7 % too dark beside a mirror, a block at 16 deviations, and is 0.00 % and at 2.8.
    """
    tree = None if material is None else node_tree_of(material)
    return tree is not None and not asked_of_side(tree)


def _perhaps_glowing(material: Material) -> Material:
    """A material that this camera does not see, which gives light where nodes give its emission.

    The backend puts in what another picture shows of it, where the scene has an emitter.
    """
    glowing = {
        name: replace(socket, value=np.ones_like(socket.value, dtype=np.float64).tolist())
        for name, socket in material.sockets.items()
        if name in EMISSION_SOCKETS and socket.by_graph
    }
    leaves = tuple(map(_perhaps_glowing, material.leaves))
    return replace(material, sockets=material.sockets | glowing, leaves=leaves)


def _own_name(leaf: Material, name: str) -> str:
    return leaf.labels.get(name, name)
