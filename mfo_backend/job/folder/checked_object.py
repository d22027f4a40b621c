# SPDX-License-Identifier: Apache-2.0
"""A JSON object read key by key, each with its type and range; every wrong one is a sentence for the user."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...types.errors import BadInputError

_MISSING: Any = object()


class CheckedObject:
    """The JSON object `data` found at `where` (like ``request.json: fit``), allowed to have `keys` only.

    Raises
    ------
    BadInputError
        From the constructor for anything but an object or for an unknown key, from the readers for a missing key
        without a default, a wrong type or a value out of range.
    """

    def __init__(self, data: Any, where: str, keys: Sequence[str]) -> None:
        self.where = where
        if not isinstance(data, Mapping):
            raise BadInputError(f"{where} is {shown(data)}: it must be a JSON object with {', '.join(keys)}.")
        unknown = [key for key in data if key not in keys]
        if unknown:
            raise BadInputError(f"{where} has the unknown key {shown(unknown[0])}: allowed are {', '.join(keys)}.")
        self._data = data

    def raw(self, key: str, default: Any = _MISSING) -> Any:
        """The value of `key` as it stands."""
        if key in self._data:
            return self._data[key]
        if default is _MISSING:
            raise BadInputError(f"{self.where} has no {key!r}: it is required.")
        return default

    def text(self, key: str, default: Any = _MISSING) -> str:
        """A string."""
        value = self.raw(key, default)
        if not isinstance(value, str):
            raise self.wrong(key, "a string")
        return value

    def choice(self, key: str, allowed: Sequence[str], default: Any = _MISSING) -> str:
        """One of the `allowed` strings."""
        value = self.raw(key, default)
        if value not in allowed:
            raise self.wrong(key, " or ".join(map(repr, allowed)))
        return value

    def boolean(self, key: str, default: Any = _MISSING) -> bool:
        """True or false."""
        value = self.raw(key, default)
        if not isinstance(value, bool):
            raise self.wrong(key, "true or false")
        return value

    def integer(self, key: str, lower: int, upper: int, default: Any = _MISSING) -> int:
        """A whole number from `lower` to `upper`."""
        value = self.raw(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not lower <= value <= upper:
            raise self.wrong(key, f"a whole number from {lower} to {upper}")
        return value

    def number(self, key: str, lower: float, upper: float, default: Any = _MISSING) -> float:
        """A finite number from `lower` to `upper`."""
        value = self.raw(key, default)
        if not is_number(value) or not lower <= value <= upper:
            raise self.wrong(key, f"a number from {lower:g} to {upper:g}")
        return float(value)

    def texts(self, key: str, default: Any = _MISSING) -> tuple[str, ...]:
        """A list of strings."""
        value = self.raw(key, default)
        if not isinstance(value, (list, tuple)) or not all(isinstance(item, str) for item in value):
            raise self.wrong(key, "a list of strings")
        return tuple(value)

    def mapping(self, key: str, default: Any = _MISSING) -> Mapping[str, Any]:
        """A JSON object with free keys."""
        value = self.raw(key, default)
        if not isinstance(value, Mapping):
            raise self.wrong(key, "a JSON object")
        return value

    def wrong(self, key: str, needed: str) -> BadInputError:
        """The error for a value that is not what is `needed`."""
        return BadInputError(f"{self.where}.{key} is {shown(self._data.get(key))}: it must be {needed}.")


def is_number(value: Any) -> bool:
    """Whether a JSON value is a number that a float can hold; true and false are none."""
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # JSON's whole numbers have no limit
        return False


def shown(value: Any) -> str:
    """A value as a message shows it, at most about forty characters."""
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
