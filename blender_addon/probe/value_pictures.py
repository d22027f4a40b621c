# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `values`: what the target's sockets hold for other values of its nodes, and how that changes with them.

One render holds many variants of the nodes. Each is a copy of the material's whole tree; Cycles merges what is the same
in all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..export.nodes.displacement import SHADING_NORMAL
from ..graph_values.place import Place, write
from .aov_render import Frame, world_to_frame
from .closure_tree import ClosureTree
from .depths import FAR_SCALE, FAR_SIDE, joined_depths, peeled, with_far_side
from .graph_copy import node_at, own_copy, remove_copy, variant_of
from .other_views import ELSEWHERE_SCALE, asks_ray, cosines_of, see_from_elsewhere
from .server import ProbeRequestError
from .socket_pictures import (
    MASK,
    POSITION,
    SEEN,
    Target,
    cleaned,
    from_origin,
    make_opaque,
    widen_bumps,
    write_outputs,
    write_weight,
)

# of the nodes in one render: more overflow the memory that Cycles has for a material's nodes, at 128 noises all of it
MOST_VARIANTS = 32

_Picture = NDArray[np.float32]
_Found = dict[tuple[int, str] | str, _Picture]  # by variant and socket; mask and position by their names
_Take = Callable[[int, str, _Picture], None]  # of a variant's number and a socket's name


@dataclass(frozen=True)
class _Variant:
    """A value for every place, the names of the sockets that are looked at, and for rays that do not come from the
    camera the cosine of their angle to the normal."""

    values: Sequence[Any]
    names: Sequence[str]
    cosine: float | None = None


def answer(request: Mapping[str, Any]) -> dict[str, Any]:
    """Write one .npy file, float32 (height, width, 1 or 3), for each socket of each variant.

    Requested are `scene`, `layer`, `object` and `slot` as of the command `sockets`, with the `view` of a picture,
    its `camera`, `frame`, `width`, `height`, `region` and `origin`, where it may be another one than the file's,
    the `sockets` by name, each a path of names to it, of which the last is empty for the weight of a shader in a
    mix, the `places` of the values (entries of request.json), `variants`, each with a number or colour for every
    place in `values` and with the names of its `sockets`, the `scale` in subpixels along a pixel, `samples` of each
    subpixel and the `folder` for the files; `elsewhere` where the files of that name are asked for, too, for the
    first variant, and `far_side` as there. Answered are `files`, by socket for each variant, `elsewhere`, by socket as
    of the command `sockets`, and of the target the file `positions`, NaN beside it, and the `camera` of that command.

    Raises
    ------
    ProbeRequestError
        If the camera does not see the target, a value's node is gone, or Blender cannot render.
    """
    target = Target.of(request)
    renders = _Renders(
        target, [Place.of_request(entry) for entry in request["places"]], request["sockets"], request["samples"]
    )
    variants = [_Variant(variant["values"], variant["sockets"]) for variant in request["variants"]]
    folder = Path(request["folder"])
    files: list[dict[str, str]] = [{} for _ in variants]

    def take(k: int, name: str, values: _Picture) -> None:
        files[k][name] = f"value_{k:02d}_{len(files[k]):02d}.npy"
        np.save(folder / files[k][name], values)

    found, frame = renders.pictures(variants, request["scale"], take, far_side=bool(request.get("far_side")))
    mask = found[MASK]
    positions = np.where(mask > SEEN, found[POSITION] / np.maximum(mask, SEEN), np.float32(np.nan))
    np.save(folder / "positions.npy", (positions - target.origin).astype(np.float32))
    camera = from_origin(world_to_frame(target.scene, frame), target.origin).tolist()
    elsewhere = {}
    if request.get("elsewhere") and asks_ray(target.material.node_tree):
        elsewhere = _elsewhere(renders, variants[0], folder)
    of_target = {"positions": "positions.npy", "camera": camera, "scale": frame.scale}
    return {"files": files, "elsewhere": elsewhere, **of_target}


def _elsewhere(renders: _Renders, variant: _Variant, folder: Path) -> dict[str, str]:
    """Files by socket of what rays from elsewhere find of a variant, at each angle."""
    ways: dict[str, list[_Picture]] = {name: [] for name in variant.names}
    angles = [replace(variant, cosine=cosine) for cosine in cosines_of(renders.target.material.node_tree)]
    renders.pictures(angles, ELSEWHERE_SCALE, lambda _, name, values: ways[name].append(values))
    files = {name: f"elsewhere_{number:02d}.npy" for number, name in enumerate(ways)}
    for name, file in files.items():
        np.save(folder / file, np.concatenate(ways[name]))
    return files


class _TooManyError(Exception):
    """So many variants do not fit into one render."""


@dataclass(frozen=True)
class _Renders:
    """Renders of a target's material with other values at `places`; `paths` are those of its sockets by name."""

    target: Target
    places: Sequence[Place]
    paths: Mapping[str, Sequence[str]]
    samples: int

    def pictures(
        self, variants: Sequence[_Variant], scale: int, take: _Take, *, far_side: bool = False
    ) -> tuple[_Found, Frame]:
        """Render the variants and hand on what each socket holds, in their order; returns mask and positions, and the
        frame."""
        most = max(min(len(variants), MOST_VARIANTS), 1)
        while True:
            frame = self.target.frame(scale, _outputs_of(variants[:most]))
            if frame.scale < scale and most > 1:  # all answers of a fit have one size
                most //= 2
                continue
            try:
                return self._in_parts(variants, frame, most, take, far_side=far_side), frame
            except _TooManyError:  # of the first part, which is as large as any
                most //= 2

    def _in_parts(
        self, variants: Sequence[_Variant], frame: Frame, most: int, take: _Take, *, far_side: bool
    ) -> _Found:
        found: _Found = {}
        kinds = _kinds(self.target.material, self.paths)
        for begin in range(0, len(variants), most):
            some = variants[begin : begin + most]
            found = self._rendered(some, frame)
            if far_side:
                coarse = self.target.frame(FAR_SCALE, _outputs_of(some))
                found = with_far_side(found, self._rendered(some, coarse, FAR_SIDE))
            mask = found[MASK]
            seen = mask[..., 0] > SEEN
            if not seen.any():  # Cycles shows nothing of a material that is too large for it
                if most > 1:
                    raise _TooManyError
                raise self.target.why_nothing(frame, self.samples)
            for k, variant in enumerate(some):
                for name in variant.names:
                    values, own = found[k, name] / np.maximum(mask, SEEN), self.paths[name][-1]
                    take(begin + k, name, cleaned(values, seen, own, kinds[name]))
        return found

    def _rendered(self, variants: Sequence[_Variant], frame: Frame, depth: int = 0) -> _Found:
        material = self.target.material
        copy, base = own_copy(material), own_copy(material)
        try:
            make_opaque(copy)
            widen_bumps(base.node_tree, frame.scale)
            wanted = [(MASK, False), (POSITION, True)]
            for k, variant in enumerate(variants):
                tree = variant_of(base.node_tree)
                copy.node_tree.nodes.new("ShaderNodeGroup").node_tree = tree
                if variant.cosine is not None:
                    see_from_elsewhere(tree, variant.cosine)
                _put(tree, self.places, variant.values, material.name)
                outputs = {name: _name(k, i) for i, name in enumerate(variant.names)}
                kinds = _put_outputs(tree, self.paths, outputs)
                wanted += [(output, kinds[name] != "VALUE") for name, output in outputs.items()]
            at_depths = peeled(copy.node_tree, wanted, depth + 1)
            found = joined_depths(self.target.outputs(copy, at_depths, frame, self.samples), wanted, (depth,))
        finally:
            remove_copy(copy)
            remove_copy(base)
        of_each = [(k, name, _name(k, i)) for k, each in enumerate(variants) for i, name in enumerate(each.names)]
        return {(k, name): found[output] for k, name, output in of_each} | {key: found[key] for key in (MASK, POSITION)}


def _outputs_of(variants: Sequence[_Variant]) -> int:
    return sum(len(variant.names) for variant in variants) + 2  # mask and position


def _name(variant: int, socket: int) -> str:
    return f"mfo {variant} {socket}"


def _put(tree: bpy.types.NodeTree, places: Sequence[Place], values: Sequence[Any], material: str) -> None:
    for place, value in zip(places, values, strict=True):
        try:
            write(tree, place, value)
        except (KeyError, IndexError, AttributeError, StopIteration) as error:
            raise ProbeRequestError(
                f"The node '{place.path[-1]}' of material '{material}' is not what it was when the fit began."
            ) from error


def _put_outputs(
    tree: bpy.types.NodeTree, paths: Mapping[str, Sequence[str]], outputs: Mapping[str, str]
) -> dict[str, str]:
    """Put an output node of the given name on each of these sockets of a variant; returns the sockets' types."""
    closures = ClosureTree(tree, own_groups=False) if not all(paths[name][-1] for name in outputs) else None
    for node in list(_outputs(tree)):  # what only a material has
        tree.nodes.remove(node)
    kinds = {}
    for name, output in outputs.items():
        *shader, socket = paths[name]
        if socket:
            kinds[name] = write_outputs(tree, shader, {socket: output})[socket]
        else:
            assert closures is not None
            kinds[name] = write_weight(tree, closures, shader, output)
    return kinds


def _outputs(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Node]:
    yield from (node for node in tree.nodes if node.bl_idname in ("ShaderNodeOutputMaterial", "ShaderNodeOutputAOV"))


def _kinds(material: bpy.types.Material, paths: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """The types of the sockets at these paths, by name."""
    kinds = {}
    for name, (*path, socket) in paths.items():
        if socket == SHADING_NORMAL:  # no socket of the shader
            kinds[name] = "VECTOR"
            continue
        _, shader = node_at(material.node_tree, path)
        found = shader.inputs[socket].type if socket else "VALUE"
        kinds[name] = found if found in ("RGBA", "VECTOR") else "VALUE"
    return kinds
