# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of what a target's sockets hold, of several variants of its nodes in one render.

Each variant is a copy of the material's whole tree; Cycles merges what is the same in all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..export.nodes.clear_objects import is_clear
from ..graph_values.place import Place, write
from .aov_render import Frame, world_to_frame
from .closure_tree import ClosureTree
from .depths import FAR_SIDE, joined_depths, peeled, scale_of_far_side, with_far_side
from .graph_copy import nodes_of, own_copy, remove_copy, variant_of
from .other_views import ELSEWHERE_SCALE, asks_ray, cosines_of, see_from_elsewhere
from .server import ProbeRequestError
from .target import (
    ALPHA,
    DIRECTIONS,
    MASK,
    POSITION,
    SEEN,
    Target,
    cleaned,
    from_origin,
    hole_weight,
    looks_by_pixels,
    make_opaque,
    remove_outputs,
    weigh_outputs,
    widen_bumps,
    write_outputs,
    write_weight,
)

# of the nodes in one render: more overflow the memory that Cycles has for a material's nodes, at 128 noises all of it
MOST_VARIANTS = 32
# By so much less than 1 is a mean of directions that scatter by 4 degrees, which shades 0.2 % brighter than they do.
# Their own samples would blur a sharp highlight where they hardly scatter: 1.7 for 0.64 at its brightest, of a coat of
# roughness 0.03 on a smooth bump
APART = 2e-3
LEAST_ALPHA = 1e-4  # of a sum over samples: less is nothing, and divides nothing

Picture = NDArray[np.float32]
_Found = dict[tuple[int, str] | str, Picture]  # by variant and socket; mask and position by their names
Take = Callable[[int, str, Picture], None]  # of a variant's number and a socket's name


@dataclass(frozen=True)
class Variant:
    """The names of the sockets that are looked at, a value for every place, and for rays that do not come from the
    camera the cosine of their angle to the normal."""

    names: Sequence[str]
    values: Sequence[Any] = ()
    cosine: float | None = None


@dataclass(frozen=True)
class Surface:
    """What the camera sees of the target, of all variants: mask, positions, and the frame."""

    mask: Picture
    position: Picture
    frame: Frame


def write_surface(target: Target, surface: Surface, folder: Path) -> dict[str, Any]:
    """Write the target's `positions`, NaN beside it; returns that file, the `camera` of its pictures and their `scale`.

    The camera is the (3, 4) matrix from the world to columns and rows of the files.
    """
    mask = surface.mask
    positions = np.where(mask > SEEN, surface.position / np.maximum(mask, SEEN), np.float32(np.nan))
    np.save(folder / "positions.npy", (positions - target.origin).astype(np.float32))
    camera = from_origin(world_to_frame(target.scene, surface.frame), target.origin).tolist()
    return {"positions": "positions.npy", "camera": camera, "scale": surface.frame.scale}


class _TooManyError(Exception):
    """So many variants do not fit into one render."""


@dataclass(frozen=True)
class VariantPictures:
    """Renders of a target's material with other values at `places`.

    `paths` are those of its sockets by name: of the shader's names and the socket's, or an empty one for the weight of
    the shader in a mix.
    """

    target: Target
    paths: Mapping[str, Sequence[str]]
    samples: int
    places: Sequence[Place] = ()

    @cached_property
    def has_holes(self) -> bool:
        """Whether a shader lets light straight on, so that pictures of others may be of what it leaves."""
        return any(map(is_clear, nodes_of(self.target.material.node_tree)))

    def put(self, tree: bpy.types.NodeTree, values: Sequence[Any]) -> None:
        """Put a value at every place of a copy of the material's nodes."""
        for place, value in zip(self.places, values, strict=True):
            try:
                write(tree, place, value)
            except (KeyError, IndexError, AttributeError, StopIteration) as error:
                raise ProbeRequestError(
                    f"The node '{place.path[-1]}' of material '{self.target.material.name}' is not what it was when "
                    "the fit began."
                ) from error

    def put_outputs(
        self, tree: bpy.types.NodeTree, outputs: Mapping[str, str]
    ) -> tuple[dict[str, str], dict[str, str]]:
        """Put an output node of the given name on each of these sockets in such a copy, for its surface.

        Returns the sockets' types, and where there are holes the output of the alpha that each was weighed with.
        """
        needs_closures = self.has_holes or not all(self.paths[name][-1] for name in outputs)
        closures = ClosureTree(tree) if needs_closures else None
        remove_outputs(tree)
        for node in [node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial"]:
            tree.nodes.remove(node)
        kinds = {}
        for name, output in outputs.items():
            *shader, socket = self.paths[name]
            if socket:
                kinds[name] = write_outputs(tree, shader, {socket: output})[socket]
            else:
                assert closures is not None
                kinds[name] = write_weight(tree, closures, shader, output)
        if not self.has_holes:
            return kinds, {}
        assert closures is not None
        return kinds, _weigh(tree, self.paths, outputs, closures)

    def _outputs_of(self, variants: Sequence[Variant]) -> int:
        """How many one render of them has: an alpha of each where there are holes, mask and position."""
        return sum(len(variant.names) + self.has_holes for variant in variants) + 2

    def take(
        self,
        variants: Sequence[Variant],
        scale: int,
        take: Take,
        *,
        depths: Sequence[int] = (0,),
        far_side: bool = False,
    ) -> Surface:
        """Render the variants and hand on what each socket holds, in their order.

        A picture shows `depths` one below the other, or with `far_side` one of it below the first, coarser where large.

        Raises
        ------
        ProbeRequestError
            If a value's node is gone, the nodes are too many for Cycles, or it shows nothing of the target.
        """
        most = max(min(len(variants), MOST_VARIANTS), 1)
        while True:
            frame = self.target.frame(scale, self._outputs_of(variants[:most]) * (depths[-1] + 1))
            if frame.scale < scale and most > 1:  # all answers of a fit have one size
                most //= 2
                continue
            try:
                found = self._in_parts(variants, frame, most, take, depths, far_side=far_side)
                return Surface(found[MASK], found[POSITION], frame)
            except _TooManyError:  # of the first part, which is as large as any
                most //= 2

    def take_elsewhere(
        self, variant: Variant, take: Callable[[str, Picture], None], depths: Sequence[int] = (0,)
    ) -> None:
        """Hand on what rays from elsewhere find in each socket where nodes ask for the ray, else nothing.

        A picture has the angles of `other_views.cosines_of` one below the other, a place a pixel.
        """
        tree = self.target.material.node_tree
        if not asks_ray(tree):
            return
        ways: dict[str, list[Picture]] = {name: [] for name in variant.names}
        angles = [replace(variant, cosine=cosine) for cosine in cosines_of(tree)]
        self.take(angles, ELSEWHERE_SCALE, lambda _, name, values: ways[name].append(values), depths=depths)
        for name, pictures in ways.items():
            take(name, np.concatenate(pictures))

    def _in_parts(
        self,
        variants: Sequence[Variant],
        frame: Frame,
        most: int,
        take: Take,
        depths: Sequence[int],
        *,
        far_side: bool,
    ) -> _Found:
        found: _Found = {}
        for begin in range(0, len(variants), most):
            some = variants[begin : begin + most]
            found, kinds = self._rendered(some, frame, depths)
            if far_side:
                behind = self.target.frame(scale_of_far_side(frame), self._outputs_of(some) * (FAR_SIDE + 1))
                found = with_far_side(found, self._rendered(some, behind, (FAR_SIDE,))[0])
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

    def _rendered(
        self, variants: Sequence[Variant], frame: Frame, depths: Sequence[int]
    ) -> tuple[_Found, dict[str, str]]:
        """What Cycles writes into the outputs of some variants, and the types of their sockets.

        Where directions scatter all is of one sample: in a mean of several bumps as fine as a subpixel are flat, and
        colours and shares of shaders belong to the sample's own direction.
        """
        material = self.target.material
        of_each = [(k, i, name) for k, each in enumerate(variants) for i, name in enumerate(each.names)]
        copy, base = own_copy(material), own_copy(material)
        try:
            make_opaque(copy)
            turned = [(_name(k, i), True) for k, i, name in of_each if self.paths[name][-1] in DIRECTIONS]
            by_pixels = looks_by_pixels(copy, turned=bool(turned))
            if not by_pixels:
                widen_bumps(base.node_tree, frame.scale)
            wanted, kinds, alphas = [(MASK, False), (POSITION, True)], {}, dict[str, str]()
            for k, variant in enumerate(variants):
                tree = variant_of(base.node_tree)
                copy.node_tree.nodes.new("ShaderNodeGroup").node_tree = tree
                if variant.cosine is not None:
                    see_from_elsewhere(tree, variant.cosine)
                self.put(tree, variant.values)
                outputs = {name: _name(k, i) for i, name in enumerate(variant.names)}
                own_kinds, own_alphas = self.put_outputs(tree, outputs)
                kinds, alphas = kinds | own_kinds, alphas | own_alphas
                wanted += [(output, kinds[name] != "VALUE") for name, output in outputs.items()]
            wanted += [(output, False) for output in dict.fromkeys(alphas.values())]
            at_depths = peeled(copy.node_tree, wanted, depths[-1] + 1)
            outputs = partial(self.target.outputs, copy, frame=frame, by_pixels=by_pixels)
            found = _of_what_is_there(joined_depths(outputs(at_depths, samples=self.samples), wanted, depths), alphas)
            if turned and self.samples > 1:
                single = _of_what_is_there(joined_depths(outputs(at_depths, samples=1), wanted, depths), alphas)
                for k, each in enumerate(variants):
                    names = [_name(k, i) for i in range(len(each.names))]
                    found |= _of_one_sample(single, found, names, {name for name, _ in turned} & set(names))
        finally:
            remove_copy(copy)
            remove_copy(base)
        pictures: _Found = {(k, name): found[_name(k, i)] for k, i, name in of_each}
        return pictures | {key: found[key] for key in (MASK, POSITION)}, kinds


def _of_one_sample(
    one: Mapping[str, Picture], mean: Mapping[str, Picture], names: Sequence[str], directions: Set[str]
) -> dict[str, Picture]:
    """Pictures of a variant with those of `one` sample where its directions scatter: their mean is shorter than they
    are. Elsewhere that mean, also where the one sample missed the target."""
    found, covered = {}, one[MASK][..., :1] > SEEN
    mask, scatters = mean[MASK][..., :1], np.zeros_like(covered)
    for name in directions:
        own, common = (np.linalg.norm(each[name], axis=-1, keepdims=True) for each in (one, mean))
        found[name] = np.where((own > SEEN) & (common < (1.0 - APART) * own), one[name], mean[name])
        scatters |= covered & (common < (1.0 - APART) * own * mask)
    for name in set(names) - directions:
        found[name] = np.where(scatters, one[name] / np.maximum(one[MASK][..., :1], SEEN) * mask, mean[name])
    return found


def _of_what_is_there(found: Mapping[str, Picture], alphas: Mapping[str, str]) -> dict[str, Picture]:
    """Pictures of which those that were weighed with an alpha are means over what it leaves of the surface.

    Where it leaves nothing, neighbours have the value: a ray may meet what no sample has.
    """
    own = dict(found)
    for name, alpha in alphas.items():
        picture, weight = found[name], np.maximum(found[alpha], 0.0)
        near, near_weight = (_summed(each) for each in (picture, weight))
        here = weight > SEEN * found[MASK]
        mean = np.where(here, picture, near) / np.maximum(np.where(here, weight, near_weight), LEAST_ALPHA)
        own[name] = (mean * found[MASK]).astype(np.float32)
    return own


def _summed(picture: Picture) -> Picture:
    """The sum over each subpixel and the eight around it."""
    padded = np.pad(picture, ((1, 1), (1, 1), (0, 0)))
    rows, columns = picture.shape[:2]
    steps = [(down, right) for down in range(3) for right in range(3)]
    return np.sum([padded[down : down + rows, right : right + columns] for down, right in steps], axis=0)


def _weigh(
    tree: bpy.types.NodeTree, paths: Mapping[str, Sequence[str]], outputs: Mapping[str, str], closures: ClosureTree
) -> dict[str, str]:
    """Weigh outputs of a variant with the alpha of their shader where that has a link, and with its weight where the
    rest is clear; returns the output of that by theirs.

    A mean that holds what alpha takes away is too dark at the edges of leaves: pictures are black where they are clear.
    """
    by_shader: dict[tuple[str, ...], list[str]] = {}
    for name, output in outputs.items():
        *shader, socket = paths[name]
        if socket and socket not in (*DIRECTIONS, ALPHA):
            by_shader.setdefault(tuple(shader), []).append(output)
    found: dict[str, str] = {}
    for shader, own in by_shader.items():
        alpha = f"{own[0]} alpha"
        weight = hole_weight(closures, list(shader)) if len(shader) == 1 else None  # of the tree that it is in
        if weigh_outputs(tree, shader, own, alpha, weight):
            found |= dict.fromkeys(own, alpha)
    return found


def _name(variant: int, socket: int) -> str:
    return f"mfo {variant} {socket}"
