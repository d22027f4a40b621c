# SPDX-License-Identifier: Apache-2.0
"""What values a material has in a loaded scene."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...material.recorded_models import RecordedModel
from ...types.errors import UnrecordableError
from ...types.parameter import Value


def values_in_scene(bsdf: Any, model: RecordedModel) -> dict[str, Value | None]:
    """The values of a material by the model's names, None for those of a texture.

    Raises
    ------
    UnrecordableError
        If one of them is a texture and the material is a plugin that cannot be asked for its values at a point.
    """
    keys = mi.traverse(bsdf)
    values: dict[str, Value | None] = {}
    asked = hasattr(bsdf, "values_at")
    for key in keys.keys():  # noqa: SIM118  the traversed object has no iterator of keys
        parts = key.split(".")
        if parts[0].startswith("leaf_"):  # the model knows them
            continue
        name = next((part for part in parts if part in model.table.names), None)
        if name is None:
            continue
        if parts[parts.index(name) + 1 :] not in ([], ["value"]):
            if not asked:
                raise UnrecordableError(f"Parameter {name!r} is a texture: recorded paths need one value.")
            values[name] = None
            continue
        numbers = np.array(keys[key], np.float64).ravel()
        size = model.table[name].size
        values[name] = float(numbers.mean()) if size == 1 else tuple(float(v) for v in np.resize(numbers, 3))
    dr.eval()
    return values
