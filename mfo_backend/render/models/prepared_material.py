# SPDX-License-Identifier: Apache-2.0
"""What a material model hands to the renderer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...material.principled.mix_values import MixValues
from ...scene.scene_xml import Target
from ...types.parameter import ParameterTable

Materials = Mapping[str, Mapping[str, Any]]  # `materials` of request.json
# The parameters that belong to an emitter beside the BSDF, and how their keys end below its shape
GLOW_KEYS = {"emission_color": "emitter.radiance.value", "emission_strength": "emitter.strength"}


@dataclass(frozen=True)
class PreparedMaterial:
    """A scene whose target material can be differentiated.

    `key_ends` names, for each parameter, how its key ends in `mi.traverse`; the key begins with the target's BSDF id,
    that of an emitter with its shape's. Of a mix of shaders `mix` says what is free beside the fitted one.
    """

    table: ParameterTable
    start: NDArray[np.float64]
    target: Target
    key_ends: Mapping[str, str]
    mix: MixValues | None = None
