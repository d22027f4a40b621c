# SPDX-License-Identifier: Apache-2.0
"""Materials of these studies that let light travel below their surface."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def _below(method: str, **values: float | tuple[float, ...]) -> Callable[[Any, Any], None]:
    def build(_: Any, node: Any) -> None:
        node.subsurface_method = method
        node.inputs["Subsurface Weight"].default_value = 1.0
        for name, value in values.items():
            node.inputs[name.replace("_", " ")].default_value = value

    return build


SUBSURFACE = {
    "wax": _below("RANDOM_WALK", Base_Color=(0.8, 0.6, 0.3, 1.0), Subsurface_Scale=0.5, Roughness=0.4),
    "skin": _below("RANDOM_WALK_SKIN", Base_Color=(0.7, 0.4, 0.3, 1.0), Subsurface_Scale=0.2),
    "jade": _below("RANDOM_WALK", Base_Color=(0.2, 0.5, 0.3, 1.0), Subsurface_Scale=2.0, Subsurface_Anisotropy=0.6),
    "marble": _below("RANDOM_WALK", Base_Color=(0.9, 0.88, 0.85, 1.0), Subsurface_Weight=0.5),
}
