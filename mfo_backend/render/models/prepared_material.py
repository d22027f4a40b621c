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

# `materials` of request.json, and what is said of each besides: `varying` are the names that values inside nodes change
Materials = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class PreparedMaterial:
    """A scene whose target material can be differentiated.

    `key_ends` names, for each parameter, how its key ends in `mi.traverse`; the key begins with the target's BSDF id.
    Of a mix of shaders `mix` says what is free beside the fitted one.
    """

    table: ParameterTable
    start: NDArray[np.float64]
    target: Target
    key_ends: Mapping[str, str]
    mix: MixValues | None = None
