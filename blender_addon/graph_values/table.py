# SPDX-License-Identifier: GPL-3.0-or-later
"""The values of a graph by their names, ``"Color Ramp/Stop 0"``: what is unlinked upstream of the target's sockets."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any, ClassVar, Protocol, TypeVar

import bpy

from ..export.nodes.closure_leaves import ClosureLeaf
from ..export.nodes.graph_findings import GROUP, GROUP_INPUT, feeding
from ..export.nodes.leaf_kinds import UNUSED_SOCKETS, is_numbered, kind_of
from ..export.nodes.shader_graph import Links, plain_value, source_of
from ..export.nodes.target_shader import DIRECTIONS, TargetShader
from ..export.nodes.target_shader import Place as SocketPlace
from . import ranges
from .place import CURVE_POINT, INPUT, OUTPUT, STOP_COLOR, STOP_POSITION, Place, Value, read
from .ranges import (
    COLOR,
    DIALS,
    GAIN,
    NUMBER,
    OFFSET,
    Range,
    amounts_of,
    plain_range,
    range_of_amount,
    range_of_input,
    range_of_stop,
)
from .tint import IMAGE, TINT_GAIN, TINT_OFFSET, is_tint, tint_of

# what no fit of values inside nodes changes
LETS_THROUGH = ("Alpha", "Transmission Weight")
STRENGTH = "Emission Strength"
OF_GLOW = ("Emission Color", STRENGTH)
VALUE_NODE = "ShaderNodeValue"
WEIGHT = "Weight"  # the share of a shader in a mix, among the names of its sockets
MOST = 256  # values of one graph; what lies further upstream is not offered
_AXES = ("X", "Y", "Z", "W")


class HasName(Protocol):
    """A value that is called by its node's label and its own name: a data class."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def name(self) -> str:
        """Both, with a slash between."""
        ...

    @property
    def place(self) -> Place:
        """Where it is kept."""
        ...


Named = TypeVar("Named", bound=HasName)


class GraphValueError(Exception):
    """A value is asked for that the graph does not have; the message is one sentence for the user."""


@dataclass(frozen=True)
class GraphValue:
    """A value of a graph: its name, where it is, how far it may go, and the target's sockets that it reaches."""

    name: str
    label: str  # of its node
    place: Place
    range: Range
    sockets: tuple[str, ...]

    def request(self, value: Value) -> dict[str, Any]:
        """The entry of request.json."""
        step = self.range.step * (self.range.upper - self.range.lower)
        return {
            "name": self.name, "value": list(value) if isinstance(value, tuple) else value,
            "lower": self.range.lower, "upper": self.range.upper, "logarithmic": self.range.logarithmic, "step": step,
            "scanned": self.range.scanned,
            "sockets": list(self.sockets), "place": self.place.request(),
        }  # fmt: skip


def graph_values(target: TargetShader) -> list[GraphValue]:
    """The values of the graph of a target, in the order in which they are met on the way up from its sockets.

    Of a mix they are those of all its shaders and of their weights, whichever shader is fitted; `_reached` has the
    names of what they reach.
    """
    tree = (target.groups[0] if target.groups else target.node).id_data
    found: dict[Place, _Met] = {}
    links = Links()
    held = {met.place for place in _held(target) for met in _upstream(place.socket, place.groups, links)}
    for name, label, place in _reached(target):
        is_color = place.socket.type == "RGBA"
        for met in _tints(name, label, place):
            found[met.place] = met
        for met in _upstream(place.socket, place.groups, links):
            known = found.setdefault(met.place, met)
            known.sockets.append(name) if name not in known.sockets else None
            known.asks_color |= is_color and not met.is_grey
            known.is_direction &= met.is_direction
            known.is_amount |= met.is_amount and name not in DIRECTIONS
            if len(found) >= MOST:
                break
    return named_apart([
        _finished(met, tree)
        for met in found.values()
        if met.place not in held and not (met.is_color and met.is_direction)
    ])  # fmt: skip


def _reached(target: TargetShader) -> Iterator[tuple[str, str, SocketPlace]]:
    """The linked sockets that a fit may change, each with its name and with what a tint of it is called.

    Those of a mix's other shaders have their number and a slash before; `WEIGHT` is a factor that the weight of a
    shader hangs on.
    """
    if not target.is_mixed:
        yield from ((name, name, place) for name, place in _free_places(target))
        return
    numbered = [leaf for leaf in target.others if is_numbered(leaf.node)]
    leaves = [(f"{number}/", leaf) for number, leaf in enumerate(numbered)]
    leaves.insert(sum(is_numbered(leaf.node) for leaf in target.others[: target.before]), ("", target.leaf))
    for before, leaf in leaves:
        label = one_word(leaf.node.label or leaf.node.name)
        if kind_of(leaf.node) is not None:  # a colour that shines has no sockets
            shader = TargetShader(leaf)
            for name, place in _free_places(shader):
                if name not in DIRECTIONS:
                    yield f"{before}{name}", f"{label} {shader.own_name(name)}", place
        yield from ((f"{before}{WEIGHT}", label, place) for place in _factors_of(leaf))


def _free_places(shader: TargetShader) -> Iterator[tuple[str, SocketPlace]]:
    """The linked sockets of a shader that a fit may change; of one without light no emission."""
    left_out = {*LETS_THROUGH, *UNUSED_SOCKETS, *without_glow(shader)}
    for name, place in shader.places.items():
        if place.socket.is_linked and name not in left_out:
            yield name, place


def without_glow(shader: TargetShader) -> Sequence[str]:
    """The sockets of a shader that say nothing, for it has no light of its own."""
    strength = shader.places.get(STRENGTH)
    is_dark = strength is None or (not strength.socket.is_linked and plain_value(strength.socket) == 0.0)
    return OF_GLOW if is_dark else ()


def _factors_of(leaf: ClosureLeaf) -> list[SocketPlace]:
    """The factors that the weight of a leaf hangs on."""
    factors = [factor for way in leaf.ways for factor in way]
    return [SocketPlace(factor.socket, factor.groups) for factor in factors if factor.value is None]


def _held(target: TargetShader) -> Iterator[SocketPlace]:
    """What no value that is fitted may reach: displacement, holes, a mix's normals, and its shaders of which the fit
    holds a picture."""
    displacement = target.displacement
    if displacement is not None:
        yield SocketPlace(displacement, ())
    for leaf in (target.leaf, *target.others):
        places = TargetShader(leaf).places if kind_of(leaf.node) is not None else {}
        yield from (places[name] for name in LETS_THROUGH if name in places and places[name].socket.is_linked)
    for leaf in (target.leaf, *target.others) if target.is_mixed else ():
        directions = (leaf.node.inputs.get(name) for name in DIRECTIONS)
        yield from (SocketPlace(socket, leaf.groups) for socket in directions if socket is not None)
    for leaf in target.others:
        if kind_of(leaf.node) is None:
            yield from (SocketPlace(socket, leaf.groups) for socket in leaf.node.inputs)
        if not is_numbered(leaf.node):
            yield from _factors_of(leaf)


def named(values: Sequence[Named], wanted: Sequence[str]) -> list[Named]:
    """Those values that a list of names holds, which other names may be in.

    Raises
    ------
    GraphValueError
        If a name with a slash is none of theirs.
    """
    by_name = {plain_name(value.name): value for value in values}
    chosen = []
    for name in wanted:
        if "/" not in name:
            continue
        if plain_name(name) not in by_name:
            near = get_close_matches(plain_name(name), by_name, n=1, cutoff=0.3)
            guess = f" (the nearest is '{by_name[near[0]].name}')" if near else ""
            have = ", ".join(f"'{value.name}'" for value in values[:12]) or "no unlinked values"
            more = " and more" if len(values) > 12 else ""
            raise GraphValueError(f"The material's nodes have no value '{name}'{guess}: they have {have}{more}.")
        chosen.append(by_name[plain_name(name)])
    return list(dict.fromkeys(chosen))


def plain_name(name: str) -> str:
    """A name as the backend compares it."""
    return "_".join(name.lower().replace("_", " ").split())


@dataclass
class _Met:
    """A value on the way up, before all sockets that it reaches are known."""

    place: Place
    node: bpy.types.Node
    groups: tuple[bpy.types.Node, ...]
    inside: str  # its name within the node
    is_color: bool
    range: Range | None  # None where it hangs on the value, which is read later
    sockets: list[str]
    asks_color: bool = False
    label: str = ""  # in place of the node's
    is_direction: bool = False  # whether it comes only where its colour is a direction
    is_amount: bool = False  # whether it is what a socket of the target gets, or a part of it
    is_grey: bool = False  # whether its node's colour is a number for what asks for it here, as a mask is
    fed: bpy.types.Node | None = None  # by an input, inside of the group that it is of


def _upstream(socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...], links: Links) -> Iterator[_Met]:
    """The values upstream of a socket that lies in `groups`."""
    seen: set[tuple[Any, ...]] = set()
    ways: list[tuple[Iterator[Any], bool, bool, bpy.types.NodeSocket]] = [
        (iter([(socket, groups)]), False, True, socket)
    ]
    while ways:
        sockets, was_direction, was_amount, inner = ways[-1]
        further, within = next(sockets, (None, ()))
        if further is None:
            ways.pop()
            continue
        if further.node.bl_idname != GROUP:
            inner = further  # what an input of a group stands for
        is_direction = was_direction or (further.node.bl_idname, further.name) == ranges.DIRECTION
        is_amount = was_amount and (further == socket or _passes_amount(further))
        if not further.is_linked:
            if further.node.bl_idname != GROUP_INPUT and not is_tint(further.node):  # a tint has names of its own
                yield from _with(_input_values(further, within, inner), is_direction, is_amount)
        elif (source := source_of(further, links)) is not None and not source.node.mute:
            node = source.node
            is_grey = further.type == "VALUE" and source.type == "RGBA"  # Cycles takes the luminance
            key = (*(group.as_pointer() for group in within), node.as_pointer(), source.identifier, is_amount, is_grey)
            if key in seen or not node.is_registered_node_type():
                continue
            seen.add(key)
            if node.bl_idname not in (GROUP, GROUP_INPUT):
                is_own_amount = is_amount and node.bl_idname == VALUE_NODE
                yield from _with(_own_values(node, within, source), is_direction, is_own_amount, is_grey)
            ways.append((feeding(node, source, within), is_direction, is_amount, inner))


def _passes_amount(socket: bpy.types.NodeSocket) -> bool:
    """Whether what a socket has is passed on as it is, or as a part of a sum."""
    return socket.node.bl_idname in (GROUP, "NodeGroupOutput") or socket.name in amounts_of(socket.node)


def _with(values: Iterable[_Met], is_direction: bool, is_amount: bool, is_grey: bool = False) -> Iterator[_Met]:
    for met in values:
        met.is_direction, met.is_amount, met.is_grey = is_direction, is_amount, is_grey
        yield met


def _tints(name: str, label: str, place: SocketPlace) -> Iterator[_Met]:
    """Gain and offset of a picture that is linked to a socket as it is."""
    tint = tint_of(place.socket)
    source = source_of(place.socket if tint is None else tint.inputs[0])
    if source is None or source.node.bl_idname != IMAGE or place.socket.type not in ("RGBA", "VALUE"):
        return
    is_color, path = place.socket.type == "RGBA", _path(place.socket.node, place.groups)
    for kind, inside, limits in ((TINT_GAIN, "Gain", GAIN), (TINT_OFFSET, "Offset", OFFSET)):
        where = Place(path, kind, place.socket.identifier, size=3 if is_color else 1)
        yield _Met(where, place.socket.node, place.groups, inside, False, limits, [name], is_color, label=label)


def _path(node: bpy.types.Node, groups: tuple[bpy.types.Node, ...]) -> tuple[str, ...]:
    return (*(group.name for group in groups), node.name)


def _input_values(
    socket: bpy.types.NodeSocket, groups: tuple[bpy.types.Node, ...], inner: bpy.types.NodeSocket
) -> Iterator[_Met]:
    """The values of a socket; `inner` is the one inside of a group which it is an input of, or itself."""
    node = socket.node
    if not socket.enabled or socket.hide_value or getattr(socket, "is_unavailable", False):
        return
    if (node.bl_idname, socket.name) in ranges.LEFT_OUT:
        return
    twins = [s for s in node.inputs if s.name == socket.name and s.enabled]
    name = socket.name if twins[:1] == [socket] else f"{socket.name} {twins.index(socket) + 1}"
    place = Place(_path(node, groups), INPUT, socket.identifier)
    if socket.type == "RGBA":
        yield _Met(place, node, groups, name, True, Range(0.0, 1.0, COLOR), [])
    elif socket.type == "VALUE":
        limits = range_of_input(inner.node, inner, socket.default_value)
        if limits.group == NUMBER and not limits.scanned:  # nothing is known of it by what it feeds
            limits = range_of_input(node, socket, socket.default_value)
        yield _Met(place, node, groups, name, False, limits, [], fed=inner.node)
    elif socket.type == "VECTOR":
        for k, number in enumerate(socket.default_value):
            axis, limits = replace(place, component=k), range_of_input(node, socket, number)
            yield _Met(axis, node, groups, f"{name} {_AXES[k]}", False, limits, [], fed=inner.node)


def _own_values(
    node: bpy.types.Node, groups: tuple[bpy.types.Node, ...], source: bpy.types.NodeSocket
) -> Iterator[_Met]:
    path = _path(node, groups)
    if node.bl_idname == "ShaderNodeRGB":
        yield _Met(Place(path, OUTPUT, source.identifier), node, groups, "Color", True, Range(0.0, 1.0, COLOR), [])
    elif node.bl_idname == VALUE_NODE:
        place = Place(path, OUTPUT, source.identifier)
        yield _Met(place, node, groups, "Value", False, plain_range(source.default_value), [])
    elif node.bl_idname == "ShaderNodeValToRGB" and source.name == "Color":
        for k in range(len(node.color_ramp.elements)):
            stop = Place(path, STOP_COLOR, str(k))
            yield _Met(stop, node, groups, f"Stop {k}", True, Range(0.0, 1.0, COLOR), [])
        for k in range(len(node.color_ramp.elements)):
            place = Place(path, STOP_POSITION, str(k))
            yield _Met(place, node, groups, f"Position {k}", False, range_of_stop(node.color_ramp, k), [])
    elif node.bl_idname in ranges.CURVES:
        names = ("R ", "G ", "B ", "") if node.bl_idname == ranges.CURVES[0] else ("",)
        for c, curve in enumerate(node.mapping.curves):
            for p in range(len(curve.points)):
                place, inside = Place(path, CURVE_POINT, f"{c}/{p}", component=1), f"{names[c]}Point {p}"
                yield _Met(place, node, groups, inside, False, Range(0.0, 1.0, NUMBER), [])


def _finished(met: _Met, tree: bpy.types.NodeTree) -> GraphValue:
    """The value with what the sockets that it reaches ask of it, and a range that holds what it is."""
    place = met.place
    if met.is_color:
        place = replace(place, size=3 if met.asks_color else 1, is_grey=not met.asks_color)
    value = read(tree, place)
    numbers = value if isinstance(value, tuple) else (value,)
    limits = met.range or plain_range(numbers[0])
    of_strength = all(name.rpartition("/")[2] == STRENGTH for name in met.sockets)
    if met.is_amount and limits.group == NUMBER and (met.node.bl_idname in DIALS or of_strength):
        limits = range_of_amount(met.fed or met.node, numbers[0], of_strength=of_strength)
    limits = replace(limits, lower=min(limits.lower, *numbers, limits.upper), upper=max(limits.upper, *numbers))
    label, inside = one_word(met.label or met.node.label or met.node.name), one_word(met.inside)
    return GraphValue(f"{label}/{inside}", label, place, limits, tuple(met.sockets))


def one_word(text: str) -> str:
    """Without what separates names."""
    return text.replace("/", " ").replace(",", " ").strip()


def named_apart(values: Iterable[Named]) -> list[Named]:
    """With names that differ: those of groups before, or a number behind, where they would be the same."""
    values = list(values)
    count = Counter(plain_name(value.name) for value in values)

    def in_groups(value: Named) -> Named:
        groups = value.place.path[:-1]
        is_met_twice = groups and count[plain_name(value.name)] > 1
        return replace(value, name="/".join((*groups, value.name))) if is_met_twice else value

    longer = [in_groups(value) for value in values]
    met: Counter[str] = Counter()
    apart = []
    for value in longer:
        met[plain_name(value.name)] += 1
        number = met[plain_name(value.name)]
        apart.append(value if number == 1 else replace(value, name=f"{value.name} {number}"))
    return apart
