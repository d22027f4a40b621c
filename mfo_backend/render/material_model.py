# SPDX-License-Identifier: Apache-2.0
"""The material models a fit can work on. A new model is one function here and one line in `MODELS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..material.mitsuba_parameters import eta_to_specular, select_parameters, specular_to_eta
from ..scene.scene_xml import Element, Target, read_values, require_principled, unwrap_twosided, write_values
from ..types.errors import BadInputError
from ..types.parameter import ParameterTable

Materials = Mapping[str, Mapping[str, Any]]  # `materials` of request.json


@dataclass(frozen=True)
class PreparedMaterial:
    """A scene whose target material can be differentiated.

    `key_ends` names, for each parameter, how its key ends in `mi.traverse`; the key begins with the target's BSDF id.
    """

    table: ParameterTable
    start: NDArray[np.float64]
    target: Target
    key_ends: Mapping[str, str]


Prepare = Callable[[Element, Target, str | Sequence[str], Materials], PreparedMaterial]


def prepare_mitsuba_principled(
    scene: Element, target: Target, selection: str | Sequence[str], materials: Materials
) -> PreparedMaterial:
    """Give every fitted parameter a value inside its box, so that no lobe is compiled out; the fixed ones stay.

    A fixed weight of 0 stays absent, which keeps its lobe out of the kernel (Mitsuba 3.9.1, `get_flag`).
    """
    require_principled(target)
    values, linked = read_values(target.inner)
    present = [name for name, value in values.items() if value != 0.0]
    table = select_parameters(selection, present=present, linked=linked)
    if "eta" in table.names and "specular" in values:
        values.setdefault("eta", specular_to_eta(_scalar(values.pop("specular"))))
    elif "specular" in table.names and "eta" in values:
        values.setdefault("specular", eta_to_specular(_scalar(values.pop("eta"))))
    start = table.clip(table.pack(values))
    if "spec_trans" in {*present, *linked, *table.names}:
        target = unwrap_twosided(target)
    other = {"eta": ("specular",), "specular": ("eta",)}
    drop = tuple(name for kept in table.names for name in other.get(kept, ()))
    write_values(target.inner, table.unpack(start), drop=drop)
    ends = {name: name if name in ("specular", "eta") else f"{name}.value" for name in table.names}
    return PreparedMaterial(table, start, target, ends)


MODELS: dict[str, Prepare] = {"mitsuba_principled": prepare_mitsuba_principled}


def material_model(name: str) -> Prepare:
    """The model called `name`.

    Raises
    ------
    BadInputError
        If there is none.
    """
    if name not in MODELS:
        raise BadInputError(f"Unknown material model {name!r}: choose one of {', '.join(map(repr, MODELS))}.")
    return MODELS[name]


def _scalar(value: float | tuple[float, ...]) -> float:
    if isinstance(value, tuple):
        raise BadInputError(f"A reflectance of three numbers {value} was given where one is needed.")
    return value
