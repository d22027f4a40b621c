# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a value of a node is kept: read and written by the node's path, in a material's own tree or in a copy of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..export.images.color_space import from_rec709, to_rec709
from .tint import TINT_GAIN, TINT_OFFSET, tint_held, tint_holder, tint_of

INPUT, OUTPUT, STOP_COLOR, STOP_POSITION, CURVE_POINT = "input", "output", "stop_color", "stop_position", "curve_point"
TINTS = (TINT_GAIN, TINT_OFFSET)
Value = float | tuple[float, ...]


@dataclass(frozen=True)
class Place:
    """A value of a node.

    Attributes
    ----------
    path
        Names of the groups that hold the node and its own, in the material's tree.
    kind
        An unlinked input, the output of a Value or RGB node, colour or position of a ramp's stop, height of a curve's
        point, gain or offset of the picture that is linked to an input.
    key
        The socket's identifier, the stop's number, or curve and point as ``"3/1"``.
    component
        Which number of several; -1 for all.
    is_grey
        Whether a colour is one number, because no colour is asked for downstream.
    size
        Numbers: 1, or 3 for a colour.
    """

    path: tuple[str, ...]
    kind: str
    key: str
    component: int = -1
    is_grey: bool = False
    size: int = 1

    def request(self) -> dict[str, Any]:
        """The entry of request.json."""
        return {
            "node": list(self.path), "kind": self.kind, "key": self.key, "component": self.component,
            "grey": self.is_grey, "size": self.size,
        }  # fmt: skip

    @staticmethod
    def of_request(entry: dict[str, Any]) -> Place:
        """The place in an entry of request.json."""
        return Place(
            tuple(map(str, entry["node"])), str(entry["kind"]), str(entry["key"]), int(entry["component"]),
            bool(entry["grey"]), int(entry["size"]),
        )  # fmt: skip


def holder_of(tree: bpy.types.NodeTree, place: Place) -> tuple[Any, str]:
    """What holds the value, and the name of the attribute.

    Raises
    ------
    KeyError, IndexError, AttributeError
        If the tree has no such place.
    """
    node = node_of(tree, place)
    if place.kind in TINTS:
        return tint_holder(_input(node, place.key), place.kind)
    if place.kind == INPUT:
        return _input(node, place.key), "default_value"
    if place.kind == OUTPUT:
        return next(s for s in node.outputs if s.identifier == place.key), "default_value"
    if place.kind == CURVE_POINT:
        curve, point = map(int, place.key.split("/"))
        return node.mapping.curves[curve].points[point], "location"
    stop = node.color_ramp.elements[int(place.key)]
    return stop, "color" if place.kind == STOP_COLOR else "position"


def held(tree: bpy.types.NodeTree, place: Place) -> Value:
    """The numbers as they are kept, colours in the scene's working space and with their alpha."""
    if place.kind in TINTS:  # a look puts no node there
        return tint_held(_input(node_of(tree, place), place.key), place.kind)
    owner, name = holder_of(tree, place)
    value = getattr(owner, name)
    if isinstance(value, (int, float)):
        return float(value)
    return float(value[place.component]) if place.component >= 0 else tuple(map(float, value))


def hold(tree: bpy.types.NodeTree, place: Place, value: Value) -> None:
    """Put what `held` gave."""
    owner, name = holder_of(tree, place)
    if place.component >= 0:
        getattr(owner, name)[place.component] = value
    else:
        setattr(owner, name, value)
    if place.kind == CURVE_POINT:
        node_of(tree, place).mapping.update()


def is_there(tree: bpy.types.NodeTree, place: Place) -> bool:
    """Whether the value has a node; a tint has none before it is written."""
    return place.kind not in TINTS or tint_of(_input(node_of(tree, place), place.key)) is not None


def node_of(tree: bpy.types.NodeTree, place: Place) -> bpy.types.Node:
    """The node that has the value; of a tint, the one before whose input it is put."""
    for group in place.path[:-1]:
        tree = tree.nodes[group].node_tree
    return tree.nodes[place.path[-1]]


def _input(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket:
    return next(socket for socket in node.inputs if socket.identifier == identifier)


def read(tree: bpy.types.NodeTree, place: Place) -> Value:
    """A number, or a colour as linear Rec.709."""
    kept = held(tree, place)
    if not isinstance(kept, tuple):
        return kept
    color = to_rec709(list(kept[:3]))
    if place.is_grey:
        return float(np.dot((0.2126, 0.7152, 0.0722), color))
    return tuple(map(float, color))


def as_held(tree: bpy.types.NodeTree, place: Place, value: Value | Sequence[float]) -> Value:
    """What `hold` takes for a number or a colour as linear Rec.709, of which the place keeps the rest."""
    kept = held(tree, place)
    numbers = [float(value)] if isinstance(value, (int, float)) else [float(number) for number in value]
    if not isinstance(kept, tuple):
        return numbers[0]
    color = from_rec709(numbers[:3] if len(numbers) >= 3 else [numbers[0]] * 3)
    return (*map(float, color), *kept[3:])


def write(tree: bpy.types.NodeTree, place: Place, value: Value | Sequence[float]) -> None:
    """Put a number, or a colour as linear Rec.709."""
    hold(tree, place, as_held(tree, place, value))
