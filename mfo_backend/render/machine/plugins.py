# SPDX-License-Identifier: Apache-2.0
"""Which plugin libraries a scene may load: Mitsuba's own. A library runs code as soon as it is opened."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from ...scene.scene_xml import Element
from ...types.errors import BadInputError

# registered from Python
OURS = (
    "blender_principled",
    "by_ray",
    "blender_point",
    "blender_spot",
    "blender_sharp_spot",
    "blender_area",
    "blender_sun",
    "blender_glow",
)


def trust_only_mitsuba() -> None:
    """Have plugins looked for in Mitsuba's folder alone: it begins with the working folder (3.9.1), so that a
    stranger's ``plugins/diffuse.so`` there would be taken for Mitsuba's."""
    import mitsuba as mi

    resolver: Any = mi.file_resolver()  # type: ignore[operator]  # Mitsuba's stubs call it an object
    resolver.clear()
    resolver.append(str(Path(mi.__file__).parent))


def check_plugins(scene: Element, file: str) -> None:
    """Check that a scene names plugins of Mitsuba or ours only: any other is opened by path, wherever it is found.

    Raises
    ------
    BadInputError
        If not.
    """
    for element in scene.iter():
        name = element.get("type")
        if name is not None and name not in _known():
            raise BadInputError(
                f"{file} has <{element.tag}> of type {name[:60]!r}, which is no plugin of Mitsuba: use one of its own."
            )


@cache
def _known() -> frozenset[str]:
    import mitsuba as mi

    folder = Path(mi.__file__).parent / "plugins"
    return frozenset({*(path.stem for path in folder.iterdir()), *OURS})
