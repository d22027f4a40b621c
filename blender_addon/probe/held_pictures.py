# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of sockets for other values of nodes, by formulas from what these values leave as it is.

Cycles renders the first variants, and with them what does not hang on the values. A socket of which formulas give the
same pictures is theirs from then on; all others stay Cycles'.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..export.images.color_space import from_rec709
from ..export.material_model import SHADING_NORMAL
from ..export.nodes.closure_leaves import OUTPUT
from ..graph_values.place import holder_of
from ..node_formulas.formulas import OF_ONE_SETTING, NoFormulaError
from ..node_formulas.walk import NORMAL, NodeWalk
from .graph_copy import nodes_of, own_copy, remove_copy
from .target import SEEN, cleaned
from .variant_pictures import Picture, Surface, Take, Variant, VariantPictures

# Root mean square of what formulas may differ by from Cycles' pictures: a tenth of what a fit extrapolates by. It is
# 3e-8 in the mean, and 1e-5 behind a steep ramp of waves (docs/notebook/graph_values.md)
DIFFERENCE = 1e-4
KEPT_BYTES = 300_000_000  # of pictures for questions to come, as of the backend's states
_HELD = "held "  # before the number of an output, among the names of sockets

Held = Mapping[tuple[str, ...], NDArray[np.float32]]  # numbers of outputs by their paths
_kept: OrderedDict[str, _Kept] = OrderedDict()


@dataclass(frozen=True)
class _Kept:
    """What a question leaves for others of its kind: the sockets that formulas give, the held outputs' numbers where
    the target is seen, (places, 3), by their paths, and the surface."""

    names: frozenset[str]
    held: Held
    surface: Surface

    @property
    def bytes(self) -> int:
        """Memory of all of it."""
        pictures = (*self.held.values(), self.surface.mask, self.surface.position)
        return sum(picture.nbytes for picture in pictures)


def take_values(
    renders: VariantPictures, variants: Sequence[Variant], scale: int, take: Take, *, key: str, **looked_at: Any
) -> Surface:
    """What `VariantPictures.take` does; questions of one `key` differ in the variants alone."""
    if renders.samples > 1 or renders.has_holes:  # a mean is not what its mean inputs give, and holes have weights
        return renders.take(variants, scale, take, **looked_at)
    known = _kept.get(key)
    if known is not None:
        _kept.move_to_end(key)
        return _answered(renders, known, variants, scale, take, **looked_at)
    found: dict[tuple[int, str], Picture] = {}

    def keep(k: int, name: str, values: Picture) -> None:
        found[k, name] = values
        if k < len(variants):
            take(k, name, values)

    with _walked(renders, variants) as tree:
        paths = {f"{_HELD}{k}": list(path) for k, path in enumerate(tree.held)}
        if not paths:
            return renders.take(variants, scale, take, **looked_at)
        at_known = Variant(list(paths), tree.at_known_settings(variants[0].values))
        with_held = replace(renders, paths={**renders.paths, **paths})
        surface = with_held.take([*variants, at_known], scale, keep, **looked_at)
        seen = surface.mask[..., 0] > SEEN
        of_held = zip(tree.held, paths, strict=True)
        held = {path: _numbers(path, found[len(variants), name][seen]) for path, name in of_held}
        cycles = {key: picture[seen] for key, picture in found.items()}
        _kept[key] = _Kept(_agreeing(tree, variants, held, cycles), held, surface)
    while len(_kept) > 1 and sum(each.bytes for each in _kept.values()) > KEPT_BYTES:
        _kept.popitem(last=False)
    return surface


def _agreeing(
    tree: _Tree, variants: Sequence[Variant], held: Held, cycles: Mapping[tuple[int, str], NDArray[np.float32]]
) -> frozenset[str]:
    """The sockets for which formulas give what Cycles gives, in every variant."""
    names = set(tree.names)
    try:
        for k, variant in enumerate(variants):
            for name, values in tree.values(variant, names & set(variant.names), held):
                if np.sqrt(np.mean(np.square(values - cycles[k, name]), dtype=np.float64)) > DIFFERENCE:
                    names.discard(name)
    except RecursionError:  # of a chain of hundreds of nodes
        names.clear()
    return frozenset(names)


def _answered(
    renders: VariantPictures, known: _Kept, variants: Sequence[Variant], scale: int, take: Take, **looked_at: Any
) -> Surface:
    """Hand on what formulas give, and of other sockets what Cycles renders."""
    rest = [
        (k, replace(each, names=names))
        for k, each in enumerate(variants)
        if (names := [name for name in each.names if name not in known.names])
    ]
    numbers = [k for k, _ in rest]

    def hand_on(k: int, name: str, values: Picture) -> None:
        take(numbers[k], name, values)

    surface = known.surface
    if rest:
        surface = renders.take([each for _, each in rest], scale, hand_on, **looked_at)
    seen = known.surface.mask[..., 0] > SEEN
    with _walked(renders, variants) as tree:
        for k, each in enumerate(variants):
            for name, values in tree.values(each, known.names & set(each.names), known.held):
                picture = np.zeros((*seen.shape, values.shape[1]), np.float32)
                picture[seen] = values
                take(k, name, picture)
    return surface


class _Tree:
    """A copy of the material's nodes with outputs on its sockets, whose values are put and walked."""

    def __init__(self, renders: VariantPictures, tree: bpy.types.NodeTree, variants: Sequence[Variant]) -> None:
        self._renders, self._tree = renders, tree
        names = dict.fromkeys(name for variant in variants for name in variant.names)
        outputs = {name: f"mfo {k}" for k, name in enumerate(names)}
        renders.put(tree, variants[0].values)
        own = {node.as_pointer(): node.name for node in nodes_of(tree)}  # and not what an output is put on
        self._kinds, _ = renders.put_outputs(tree, outputs)
        ends = {node.aov_name: node for node in nodes_of(tree) if node.bl_idname == "ShaderNodeOutputAOV"}
        self._inputs = {
            name: next(each for each in ends[output].inputs if each.is_linked) for name, output in outputs.items()
        }
        self._walk = NodeWalk(tree, renders.places, own)
        self.names, self._outputs = list[str](), dict[tuple[str, ...], bpy.types.NodeSocket]()
        for name, end in self._inputs.items():
            try:
                held = {(*self._walk.path_of(each), OUTPUT + each.identifier): each for each in self._walk.held(end)}
            except (NoFormulaError, RecursionError):
                continue
            self.names.append(name)
            self._outputs |= held
        self._normal = (*renders.paths[next(iter(names))][:-1], SHADING_NORMAL)

    @property
    def held(self) -> list[tuple[str, ...]]:
        """The paths of the outputs that stay as they are, and of the surface's normal where one setting bends it."""
        is_bent = any(self._walk.setting_of(each) is not None for each in self._outputs.values())
        return [*self._outputs, *([self._normal] if is_bent else [])]

    def at_known_settings(self, values: Sequence[Any]) -> list[Any]:
        """Values with those at which outputs of one setting are known."""
        known = {
            setting.as_pointer(): OF_ONE_SETTING[each.node.bl_idname, each.name][1]
            for each in self._outputs.values()
            if (setting := self._walk.setting_of(each)) is not None
        }
        holders = (holder_of(self._tree, place)[0] for place in self._renders.places)
        return [known.get(holder.as_pointer(), value) for holder, value in zip(holders, values, strict=True)]

    def values(self, variant: Variant, names: Iterable[str], held: Held) -> Iterator[tuple[str, NDArray[np.float32]]]:
        """What these sockets of a variant hold where the target is seen."""
        self._renders.put(self._tree, variant.values)
        known = {
            each.as_pointer(): held[path] if each.type in ("RGBA", "VECTOR") else held[path][:, :1]
            for path, each in self._outputs.items()
            if path in held
        }
        if self._normal in held:
            known[NORMAL] = held[self._normal]
        met: dict[int, NDArray[np.float32]] = {}
        count = len(next(iter(held.values())))
        for name in names:
            values = self._walk.value(self._inputs[name], known, met)
            rows = np.broadcast_to(values, (count, values.shape[1]))[None]
            own = self._renders.paths[name][-1]
            yield name, cleaned(rows, np.ones(rows.shape[:2], bool), own, self._kinds[name])[0]


@contextmanager
def _walked(renders: VariantPictures, variants: Sequence[Variant]) -> Iterator[_Tree]:
    copy = own_copy(renders.target.material)
    try:
        yield _Tree(renders, copy.node_tree, variants)
    finally:
        remove_copy(copy)


def _numbers(path: tuple[str, ...], picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """What an output holds, whose picture is that of a colour; of the surface's normal the picture itself."""
    return picture if path[-1] == SHADING_NORMAL else from_rec709(picture).astype(np.float32)
