# SPDX-License-Identifier: Apache-2.0
"""The free values of a mix of shaders beside those of its fitted leaf: of the other leaves, and Mix factors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...types.parameter import Parameter, Value
from .principled_dict import held_leaves, is_mixed, socket_value
from .principled_parameters import BLENDER_PRINCIPLED, PARAMETER_OF_SOCKET

# At its ends a factor takes a shader out of the mix, whose values then have no place to go back to
LEAST_FACTOR = 1e-3


@dataclass(frozen=True)
class MixValues:
    """Which values of a mix are free, by what a user calls them.

    Attributes
    ----------
    leaves
        By the number of a leaf of the plugin `closure_tree` the names of its free values by parameter.
    factors
        Names of the factors, in the plugin's order.
    start
        The values in the scene, by name.
    """

    leaves: Mapping[int, Mapping[str, str]]
    factors: tuple[str, ...]
    start: Mapping[str, Value]

    @property
    def parameters(self) -> list[Parameter]:
        """The values as a fit changes them."""
        of_leaves = [
            replace(BLENDER_PRINCIPLED[name], name=shown)
            for names in self.leaves.values()
            for name, shown in names.items()
        ]
        return [*of_leaves, *(Parameter(name, 1, LEAST_FACTOR, 1.0 - LEAST_FACTOR, 0.5) for name in self.factors)]

    @property
    def key_ends(self) -> dict[str, str]:
        """How the key of each ends in `mi.traverse`."""
        ends = {shown: f"leaf_{leaf}.{name}" for leaf, names in self.leaves.items() for name, shown in names.items()}
        return ends | {name: f"factor_{k}" for k, name in enumerate(self.factors)}


def mix_values(material: Mapping[str, Any]) -> MixValues | None:
    """Those of a material of request.json; None where there are none, and nothing of the mix varies."""
    leaves, start = {}, {}
    for number, leaf in enumerate(held_leaves(material)):
        free = leaf.get("free", {})
        if free:
            leaves[number] = {PARAMETER_OF_SOCKET[socket]: shown for socket, shown in free.items()}
            start |= {shown: socket_value(s, leaf["sockets"][s]["value"]) for s, shown in free.items()}
    factors = material.get("factors", ())
    varies = is_mixed(material) and any(leaf.get("varies") for leaf in (material, *material.get("leaves", ())))
    if not leaves and not factors and not varies:
        return None
    start |= {factor["name"]: float(factor["value"]) for factor in factors}
    return MixValues(leaves, tuple(factor["name"] for factor in factors), start)


@dataclass(frozen=True)
class Way:
    """A part of a leaf's weight: a share, and the numbers of the Mix factors whose first or second side it is on."""

    share: float
    first: tuple[int, ...]
    second: tuple[int, ...]

    def at(self, factors: Sequence[Any]) -> Any:
        """Its share times the sides of these factors."""
        value: Any = self.share
        for k in self.first:
            value = value * (1 - factors[k])
        for k in self.second:
            value = value * factors[k]
        return value


def amount_of(ways: Sequence[Way], factors: Sequence[Any]) -> Any:
    """What the weight of a leaf is multiplied with."""
    return sum((way.at(factors) for way in ways[1:]), ways[0].at(factors)) if ways else 1.0


def ways_in(words: str) -> tuple[Way, ...]:
    """The ways in the words of a property."""
    ways = []
    for way in words.split(",") if words else ():
        share, *sides = way.split()
        first, second = (tuple(int(side[1:]) for side in sides if side[0] == sign) for sign in "-+")
        ways.append(Way(float(share), first, second))
    return tuple(ways)
