# SPDX-License-Identifier: GPL-3.0-or-later
"""What lamps' nodes make of their light: asked of Cycles while the scene is read, put into it when that is done."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from pathlib import Path

import bpy
import numpy as np

from ...bake.bake_cache import cache_folder
from ...bake.baker import BakeError, Baker
from ...bake.lamp_layout import CONSTANT, NORMAL, Lookup
from ...bake.requests import name_of
from ..findings import Findings
from ..images.color_space import to_rec709
from .light_model import Light, Pattern


class LampTables:
    """What is asked of `baker`, which other things may be asked of meanwhile."""

    def __init__(self, baker: Baker) -> None:
        self._baker = baker
        self._asked: dict[int, tuple[Lookup, int | BakeError]] = {}  # by the light's place in the list

    def ask(self, instance: bpy.types.DepsgraphObjectInstance, number: int, light: Light) -> None:
        """Have the nodes of a light measured, which is that of an instance and has this place in the scene's list."""
        lookup = light.nodes
        assert lookup is not None
        rim, halves = disc(light, lookup.by)
        asked = asdict(lookup) | {"rim": rim, "halves": halves}
        found: int | BakeError
        try:
            found = self._baker.ask("lamp", cache=cache_folder(), instance=name_of(instance), asked=asked)
        except BakeError as problem:
            found = problem
        self._asked[number] = lookup, found

    def finish(self, lights: list[Light], findings: Findings) -> None:
        """Wait, and give the lights what their nodes give; one that cannot be measured is an error."""
        for place, (lookup, number) in self._asked.items():
            light = lights[place]
            try:
                if not isinstance(number, int):
                    raise number
                answer, folder = self._baker.wait(number)
            except BakeError as problem:
                findings.error(f"The nodes of light '{light.name}' could not be measured by Cycles: {problem}")
                continue
            lights[place] = _shaped(light, lookup, answer, folder)
        lights[:] = [light for light in lights if light.color.max() > 0.0]


def disc(light: Light, by: str) -> tuple[float, int]:
    """Half angle in degrees and number of the discs that hold all directions or normals of a light."""
    if light.kind == "POINT" or by == NORMAL:
        return 90.0, 2
    return math.degrees(light.spot_size) / 2.0 if light.kind == "SPOT" else 90.0, 1


def _shaped(light: Light, lookup: Lookup, answer: dict[str, object], folder: Path) -> Light:
    """A light with what Cycles has told of its nodes; a pattern's mean goes into the colour."""

    def read(name: str) -> np.ndarray:
        return to_rec709(np.load(folder / str(answer[name]))).clip(0.0)

    falloff = read("falloff")[None].astype(np.float32) if "falloff" in answer else None
    if lookup.by == CONSTANT:
        color = to_rec709(answer["color"]).clip(0.0)  # type: ignore[arg-type]
        return replace(light, nodes=None, color=light.color * color, falloff=falloff)
    rim, halves = disc(light, lookup.by)
    factors = read("pattern")
    mean = factors.mean(axis=0)
    side = math.isqrt(len(factors) // halves)
    pixels = (factors / np.where(mean > 0.0, mean, 1.0)).reshape(side, halves * side, 3)
    pattern = Pattern(lookup.by, np.ascontiguousarray(pixels, dtype=np.float32), rim)
    return replace(light, nodes=None, color=light.color * mean, pattern=pattern, falloff=falloff)
