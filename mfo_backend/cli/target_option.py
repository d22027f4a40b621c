# SPDX-License-Identifier: Apache-2.0
"""`--object NAME@slot=2`: an object of the .blend file and which of its materials is fitted."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..types.errors import BadInputError

HELP = (
    "object whose active material is fitted, or NAME@slot=2 (from 1) or NAME@material=Glaze for another of its "
    "materials; once for each of several, which are fitted together"
)
_CHOICE = re.compile(r"(.+)@(slot|material)=(.+)", re.DOTALL)


@dataclass(frozen=True)
class TargetOption:
    """An object, and the slot (counted from 1) or the name of the material; neither is the active one."""

    object: str
    slot: int | None = None
    material: str | None = None

    def fields(self) -> dict[str, Any]:
        """What is given, as JSON."""
        return {name: value for name, value in vars(self).items() if value is not None}


def target_option(text: str) -> TargetOption:
    """The target that an option names; an @ that no slot or material follows is part of the object's name.

    Raises
    ------
    BadInputError
        If a slot is no number.
    """
    found = _CHOICE.fullmatch(text)
    if found is None:
        return TargetOption(text)
    name, key, value = found.groups()
    if key == "material":
        return TargetOption(name, material=value)
    if not value.isascii() or not value.isdigit() or int(value) < 1:
        raise BadInputError(f"--object {text!r}: slot is {value!r}: it must be a whole number from 1 on.")
    return TargetOption(name, slot=int(value))


def is_active(targets: Sequence[TargetOption]) -> bool:
    """Whether this is one object's active material."""
    return len(targets) == 1 and targets[0] == TargetOption(targets[0].object)
