# SPDX-License-Identifier: Apache-2.0
"""What a material model hands to the renderer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...material.principled.mix_values import MixValues
from ...scene.scene_xml import Target
from ...types.parameter import ParameterTable

Materials = Mapping[str, Mapping[str, Any]]  # `materials` of request.json
EMISSION = "emission_color"  # the one parameter that belongs to an emitter beside the BSDF
RADIANCE_KEY = "emitter.radiance.value"  # of a glow, below its shape


@dataclass(frozen=True)
class PreparedMaterial:
    """A scene whose target material can be differentiated.

    `key_ends` names, for each parameter, how its key ends in `mi.traverse`; the key begins with the target's BSDF id,
    that of an emitter with its shape's. What the scene has there is the parameter times its factor in `factors`, 1 for
    most. Of a mix of shaders `mix` says what is free beside the fitted one.
    """

    table: ParameterTable
    start: NDArray[np.float64]
    target: Target
    key_ends: Mapping[str, str]
    factors: Mapping[str, float] = field(default_factory=dict)
    mix: MixValues | None = None
