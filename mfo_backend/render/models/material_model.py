# SPDX-License-Identifier: Apache-2.0
"""The material models a fit can work on. A new model is one function and one line in `MODELS`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ...scene.scene_xml import Element, Target
from ...types.errors import BadInputError
from .blender_model import prepare_blender_principled
from .mitsuba_model import prepare_mitsuba_principled
from .prepared_material import Materials, PreparedMaterial

# (scene, target, selection of parameters, `materials` of request.json); rewrites the scene
Prepare = Callable[[Element, Target, str | Sequence[str], Materials], PreparedMaterial]

MODELS: dict[str, Prepare] = {
    "mitsuba_principled": prepare_mitsuba_principled,
    "blender_principled": prepare_blender_principled,
}


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
