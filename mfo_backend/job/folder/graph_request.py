# SPDX-License-Identifier: Apache-2.0
"""The entry `graph` of request.json: what nodes give the target, and the values inside them that are fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from ...types.errors import BadInputError
from ...types.node_value import NodeValue
from ...types.parameter import Value
from .checked_object import CheckedObject, is_number

COPY = "graph/scene.blend"  # of the file, which a Blender evaluates while values inside its nodes are fitted
LARGEST = 1e6  # of a bound
MOST_VALUES = 256
MOST_DEPTHS = 32
NEAR_AND_FAR = 2  # depths of an opaque target: what the camera sees, and its far side
FINEST = 4  # subpixels along a pixel; fewer where the picture is large
_KEYS = ("camera", "positions", "depths", "scale", "values", "evaluate", "held")
_EVALUATE = ("scene", "layer", "object", "slot", "sockets", "view")
LARGEST_SIDE = 16384  # pixels; Blender's own limit is 65536, a fit at that size is a mistake
LAST_FRAME = 1_048_574  # as Blender's


@dataclass(frozen=True)
class NodeGraph:
    """How the target's `graph` files are seen: the (3, 4) matrix from the world to column, row and 1, and the file of
    world positions.

    Files have so many `depths` one below the other: what the camera sees, what it would see were that away, and so on.
    They have `scale` subpixels along a pixel.
    `values` are those of the nodes that are fitted, beside the sockets; `evaluate` says where the material is in the
    copy of the file, for the Blender that evaluates it, with the path of names to each socket, whose last word is empty
    for the weight of a shader in a mix, and the camera, frame and size of the picture. `held` names those that are not
    fitted.
    """

    camera: tuple[tuple[float, ...], ...]
    positions: str
    depths: int = 1
    scale: int = FINEST
    values: tuple[NodeValue, ...] = ()
    evaluate: Mapping[str, Any] | None = None
    held: tuple[str, ...] = ()


def graph_from_json(data: Any, where: str) -> NodeGraph | None:
    """The checked entry.

    Raises
    ------
    BadInputError
        For unknown or missing keys, wrong types and values out of range.
    """
    if data is None:
        return None
    graph = CheckedObject(data, f"{where}: graph", _KEYS)
    rows = graph.raw("camera")
    if not (isinstance(rows, (list, tuple)) and len(rows) == 3):
        raise graph.wrong("camera", "three rows of four numbers")
    for row in rows:
        if not (isinstance(row, (list, tuple)) and len(row) == 4 and all(map(is_number, row))):
            raise graph.wrong("camera", "three rows of four numbers")
    listed = graph.raw("values", ())
    if not isinstance(listed, (list, tuple)) or len(listed) > MOST_VALUES:
        raise graph.wrong("values", f"a list of at most {MOST_VALUES}")
    values = tuple(_value(entry, f"{where}: graph.values[{k}]") for k, entry in enumerate(listed))
    evaluate = graph.raw("evaluate", None)
    if values:
        evaluate = _evaluate(evaluate, f"{where}: graph.evaluate")
        unknown = {name for value in values for name in value.sockets} - set(evaluate["sockets"])
        if unknown:
            raise BadInputError(f"{where}: graph.evaluate.sockets has no {sorted(unknown)[0]!r}: add it.")
    camera = tuple(tuple(float(number) for number in row) for row in rows)
    depths = graph.integer("depths", 1, MOST_DEPTHS, 1)
    scale = graph.integer("scale", 1, FINEST, FINEST)
    held = graph.texts("held", ())
    if len(held) > MOST_VALUES:
        raise graph.wrong("held", f"a list of at most {MOST_VALUES}")
    return NodeGraph(camera, graph.text("positions"), depths, scale, values, evaluate, held)


def graph_to_json(graph: NodeGraph | None) -> dict[str, Any] | None:
    """The inverse of `graph_from_json`."""
    if graph is None:
        return None
    data = asdict(graph)
    return data if graph.values else {key: data[key] for key in ("camera", "positions", "depths", "scale", "held")}


def _value(data: Any, where: str) -> NodeValue:
    keys = ("name", "value", "lower", "upper", "logarithmic", "step", "scanned", "sockets", "place")
    entry = CheckedObject(data, where, keys)
    lower, upper = (entry.number(key, -LARGEST, LARGEST) for key in ("lower", "upper"))
    if not lower < upper:
        raise entry.wrong("upper", f"above {lower:g}")
    if not entry.text("name").strip():
        raise entry.wrong("name", "a name")
    logarithmic = entry.boolean("logarithmic", False)
    return NodeValue(
        name=entry.text("name"), value=_number_or_color(entry), lower=lower, upper=upper,
        logarithmic=logarithmic and lower > 0.0, step=entry.number("step", 1e-9 * (upper - lower), upper - lower),
        scanned=entry.boolean("scanned", False), sockets=entry.texts("sockets"), place=entry.mapping("place"),
    )  # fmt: skip


def _number_or_color(entry: CheckedObject) -> Value:
    value = entry.raw("value")
    if is_number(value):
        return float(value)
    if isinstance(value, (list, tuple)) and len(value) == 3 and all(map(is_number, value)):
        return tuple(map(float, value))
    raise entry.wrong("value", "a number, or a list of three")


def _evaluate(data: Any, where: str) -> dict[str, Any]:
    entry = CheckedObject(data, where, _EVALUATE)
    sockets = entry.mapping("sockets")
    for path in sockets.values():
        if not (isinstance(path, (list, tuple)) and len(path) > 1 and all(isinstance(name, str) for name in path)):
            raise entry.wrong("sockets", "paths of a node's names and a socket's by names")
    return {
        **{key: entry.text(key) for key in ("scene", "layer", "object")},
        "slot": entry.integer("slot", 0, 32766),
        "sockets": {name: list(path) for name, path in sockets.items()},
        "view": _view(entry.raw("view", None), f"{where}.view"),
    }


def _view(data: Any, where: str) -> dict[str, Any] | None:
    """What the picture shows of the copy; None for what this shows as it is."""
    if data is None:
        return None
    entry = CheckedObject(data, where, ("camera", "frame", "width", "height", "region", "origin"))
    view: dict[str, Any] = {
        "camera": entry.text("camera"),
        "frame": entry.number("frame", -LAST_FRAME, LAST_FRAME),
        "width": entry.integer("width", 1, LARGEST_SIDE),
        "height": entry.integer("height", 1, LARGEST_SIDE),
    }
    origin = entry.raw("origin", None)
    if origin is not None:
        if not (isinstance(origin, (list, tuple)) and len(origin) == 3 and all(map(is_number, origin))):
            raise entry.wrong("origin", "a list of three numbers")
        view["origin"] = [float(number) for number in origin]
    region = entry.raw("region", None)
    if region is None:
        return view
    if not (isinstance(region, (list, tuple)) and len(region) == 4 and all(type(edge) is int for edge in region)):
        raise entry.wrong("region", "left, top, right and bottom in whole pixels")
    left, top, right, bottom = region
    if not (0 <= left < right <= view["width"] and 0 <= top < bottom <= view["height"]):
        raise entry.wrong("region", "a rectangle inside of the frame")
    return view | {"region": list(region)}
