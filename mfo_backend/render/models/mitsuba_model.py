# SPDX-License-Identifier: Apache-2.0
"""Scenes whose target material is Mitsuba's own `principled`."""

from __future__ import annotations

from collections.abc import Sequence

from ...material.mitsuba_parameters import eta_to_specular, select_parameters, specular_to_eta
from ...scene.scene_xml import Element, Target, read_values, require_principled, unwrap_twosided, write_values
from ...types.errors import BadInputError
from .prepared_material import Materials, PreparedMaterial


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


def _scalar(value: float | tuple[float, ...]) -> float:
    if isinstance(value, tuple):
        raise BadInputError(f"A reflectance of three numbers {value} was given where one is needed.")
    return value
