# SPDX-License-Identifier: Apache-2.0
"""What is free of a mix of shaders beside its fitted leaf, as request.json says it: sockets of leaves, Mix factors."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...material.principled.principled_parameters import PARAMETER_OF_SOCKET
from ...types.errors import BadInputError
from .checked_object import CheckedObject

MIX_KEYS = ("free", "factors", "ways", "varies")
MOST_FACTORS = 64  # of a mix
MOST_WAYS = 256  # to a leaf, as in the add-on
LARGEST_SHARE = 1e6  # of a way: a weight whose share is 1 / this is not seen


@dataclass(frozen=True)
class MixFactor:
    """A Mix Shader's factor that is fitted: what a user calls it, and its value in the scene."""

    name: str
    value: float


@dataclass(frozen=True)
class MixWay:
    """A part of a weight: a share, times 1 - f for the factors `first` by number and f for those of `second`."""

    share: float
    first: tuple[int, ...] = ()
    second: tuple[int, ...] = ()


def factors_from_json(material: CheckedObject) -> tuple[MixFactor, ...]:
    """The checked entry `factors`; raises `BadInputError`."""
    entries = _listed(material, "factors", MOST_FACTORS)
    found = [CheckedObject(entry, f"{material.where}.factors[{k}]", ("name", "value")) for k, entry in entries]
    return tuple(MixFactor(_name(entry, entry.text("name")), entry.number("value", 0.0, 1.0)) for entry in found)


def ways_from_json(material: CheckedObject) -> tuple[MixWay, ...]:
    """The checked entry `ways`; raises `BadInputError`."""
    keys = ("share", "first", "second")
    entries = _listed(material, "ways", MOST_WAYS)
    found = [CheckedObject(entry, f"{material.where}.ways[{k}]", keys) for k, entry in entries]
    return tuple(
        MixWay(entry.number("share", 0.0, LARGEST_SHARE), _numbers(entry, "first"), _numbers(entry, "second"))
        for entry in found
    )


def free_from_json(material: CheckedObject, sockets: Mapping[str, Any]) -> dict[str, str]:
    """The checked entry `free` of a leaf with these sockets; raises `BadInputError`."""
    free = material.mapping("free", {})
    for socket, name in free.items():
        if socket not in PARAMETER_OF_SOCKET or socket not in sockets or sockets[socket].linked:
            raise material.wrong("free", f"names by unlinked sockets, and {socket!r} is none")
        if not isinstance(name, str):
            raise material.wrong("free", "names by sockets")
        _name(material, name)
    return dict(free)


def check_mix(where: str, factors: Sequence[MixFactor], leaves: Sequence[Any]) -> None:
    """Raise `BadInputError` where names of a mix are met twice, or a way names a factor that is not there.

    `leaves` are all of them, the fitted one too.
    """
    names = [factor.name for factor in factors] + [name for leaf in leaves for name in leaf.free.values()]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise BadInputError(f"{where}: the name {twice[0]!r} is given twice: each value has its own.")
    asked = {k for leaf in leaves for way in leaf.ways for k in (*way.first, *way.second)}
    if asked and max(asked) >= len(factors):
        raise BadInputError(f"{where}: ways name the factor {max(asked)}, and there are {len(factors)}.")


def _name(entry: CheckedObject, name: str) -> str:
    """A name that no parameter of a plain material has."""
    if "/" not in name or not name.isprintable() or len(name) > 400:
        raise BadInputError(f"{entry.where}: {name[:40]!r} must be a node's name, a slash and a value's name.")
    return name


def _listed(material: CheckedObject, key: str, most: int) -> list[tuple[int, Any]]:
    entries = material.raw(key, ())
    if not isinstance(entries, (list, tuple)) or len(entries) > most:
        raise material.wrong(key, f"a list of at most {most}")
    return list(enumerate(entries))


def _numbers(entry: CheckedObject, key: str) -> tuple[int, ...]:
    values = entry.raw(key, ())
    if not isinstance(values, (list, tuple)) or not all(
        isinstance(k, int) and not isinstance(k, bool) and 0 <= k < MOST_FACTORS for k in values
    ):
        raise entry.wrong(key, "a list of numbers of factors")
    return tuple(values)
