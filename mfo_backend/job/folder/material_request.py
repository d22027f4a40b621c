# SPDX-License-Identifier: Apache-2.0
"""An entry of `materials` in request.json: sockets with their files, and the leaves of a mix."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ...material.cycles_model import LEAF_SHADERS, SHADERS
from ...material.principled.principled_parameters import WEIGHT
from .checked_object import CheckedObject, is_number
from .mix_request import MIX_KEYS, MixFactor, MixWay, check_mix, factors_from_json, free_from_json, ways_from_json

MOST_LEAVES = 64  # of a mix
TRANSPARENT = "transparent"  # of a mix what passes straight through
_OF_LEAVES = (*LEAF_SHADERS, TRANSPARENT)
_NORMAL_KEYS = ("displaced", "turned")  # of what a `normalmap` over it has
_MATERIAL_KEYS = (
    *("name", "distribution", "subsurface_method", "sockets", "shader", "weight", "leaves"),
    *_NORMAL_KEYS,
)
_FILES = ("texture", "graph", "elsewhere")  # of a socket
_FLAGS = ("turned", "mesh")


@dataclass(frozen=True)
class Socket:
    """A socket of a Blender Principled node; a linked one stays as it is.

    Files of the job: a `texture` over the UV map, a `graph` as the camera sees it, and `elsewhere` for other rays. A
    normal that is `turned` has the opposite direction on the surface's other side, and is mirrored there if not. A
    Tangent with `mesh` is the vertex attribute `tangent` of the meshes.
    """

    value: Any = None
    linked: bool = False
    texture: str | None = None
    graph: str | None = None
    elsewhere: str | None = None
    turned: bool = False
    mesh: bool = False


@dataclass(frozen=True)
class Material:
    """A Blender Principled material, or another `shader` by the sockets it has in common, by socket name.

    Colours are linear Rec.709. A mix has the `weight` of its fitted material and the other `leaves` with theirs, among
    them what is "transparent" (Base Color passes straight through) and "emission" (Emission Color and Strength). Values
    inside nodes change sockets or weight of one that `varies`. The `normalmap` over one that is `displaced` has normals
    that take the place of the mesh's smooth ones, and over one that is `turned` as a socket's are.
    """

    name: str
    distribution: str
    sockets: Mapping[str, Socket]
    subsurface_method: str = "RANDOM_WALK"
    shader: str = "principled"
    weight: Socket = field(default_factory=lambda: Socket(1.0))
    leaves: tuple[Material, ...] = ()
    free: Mapping[str, str] = field(default_factory=dict)
    factors: tuple[MixFactor, ...] = ()
    ways: tuple[MixWay, ...] = ()
    varies: bool = False
    displaced: bool = False
    turned: bool = False

    @property
    def graph_names(self) -> list[str]:
        """Names of what nodes give, as values inside them name what they reach: sockets, `WEIGHT`, and of the leaves
        but Transparent both after a leaf's number and a slash."""
        of_leaves = enumerate(leaf for leaf in self.leaves if leaf.shader != TRANSPARENT)
        return [*self._graph_names, *(f"{k}/{name}" for k, leaf in of_leaves for name in leaf._graph_names)]

    @property
    def _graph_names(self) -> list[str]:
        asked = ((WEIGHT, self.weight), *self.sockets.items())
        return [name for name, socket in asked if socket.graph]

    @property
    def all_sockets(self) -> Iterator[tuple[str, Socket]]:
        """Every socket with a name that says where it is, weights and those of leaves included."""
        yield "weight", self.weight
        yield from self.sockets.items()
        for leaf in self.leaves:
            yield from ((f"{name} of {leaf.name}", socket) for name, socket in leaf.all_sockets)


def material_from_json(where: str, data: Any) -> Material:
    """The checked entry of a material.

    Raises
    ------
    BadInputError
        For unknown or missing keys, wrong types and values out of range.
    """
    material = _shader(data, where, SHADERS)
    check_mix(where, material.factors, [material, *material.leaves])
    return material


def _shader(data: Any, where: str, shaders: Sequence[str]) -> Material:
    material = CheckedObject(data, where, (*_MATERIAL_KEYS, *MIX_KEYS))
    leaves = material.raw("leaves", [])
    if not isinstance(leaves, (list, tuple)) or len(leaves) > MOST_LEAVES:
        raise material.wrong("leaves", f"a list of at most {MOST_LEAVES} materials")
    if leaves and shaders is not SHADERS:
        raise material.wrong("leaves", "empty: a leaf has none")
    sockets = {name: _socket(entry, f"{where}.sockets.{name}") for name, entry in material.mapping("sockets").items()}
    is_leaf = shaders is not SHADERS
    return Material(
        name=material.text("name"),
        distribution=material.text("distribution", "MULTI_GGX"),
        sockets=sockets,
        subsurface_method=material.text("subsurface_method", "RANDOM_WALK"),
        shader=material.choice("shader", list(shaders), "principled"),
        weight=_socket(material.raw("weight", {"value": 1.0}), f"{where}.weight"),
        free=free_from_json(material, sockets) if is_leaf else {},
        factors=() if is_leaf else factors_from_json(material),
        ways=ways_from_json(material),
        varies=material.boolean("varies", False),
        displaced=material.boolean("displaced", False),
        turned=material.boolean("turned", False),
        leaves=tuple(_shader(leaf, f"{where}.leaves[{k}]", _OF_LEAVES) for k, leaf in enumerate(leaves)),
    )


def _socket(data: Any, where: str) -> Socket:
    socket = CheckedObject(data, where, ("value", "linked", *_FLAGS, *_FILES))
    value = socket.raw("value", None)
    numbers = value if isinstance(value, list) else [value]
    if not (value is None or isinstance(value, bool) or (1 <= len(numbers) <= 4 and all(map(is_number, numbers)))):
        raise socket.wrong("value", "a number, a list of one to four, true, false or null")
    files = {key: socket.text(key) for key in _FILES if socket.raw(key, None) is not None}
    linked, turned, mesh = (socket.boolean(key, False) for key in ("linked", *_FLAGS))
    return Socket(value, linked, turned=turned, mesh=mesh, **files)


def without_nothing(material: dict[str, Any]) -> None:
    """Leave out files that are not there."""
    for socket in (*material["sockets"].values(), material["weight"]):
        for key in (*_FILES, *_FLAGS):
            if not socket[key]:
                del socket[key]
    for key in (*_NORMAL_KEYS, *MIX_KEYS):
        if not material[key]:
            del material[key]
    for leaf in material["leaves"]:
        without_nothing(leaf)
