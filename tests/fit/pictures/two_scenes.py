# SPDX-License-Identifier: Apache-2.0
"""One ball from several sides, as Mitsuba scenes, with pictures of a known material."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.image import Encoding, Image
from tests.render.scenes import write_scene

FROM = ("0, -4, 1", "3.5, -2, 1", "-3, -2, 2.5", "0, -1, 4")
VALUES = {"base_color": (0.6, 0.2, 0.1), "roughness": 0.35, "specular": 0.6}


def views(
    folder: Path,
    lights: list[str],
    sizes: list[int],
    parameters: list[str] | None = None,
    *,
    places: tuple[str, ...] = FROM,
) -> list:
    """A renderer for each light, from another side each, of pictures of these sizes."""
    found = []
    for number, (light, size) in enumerate(zip(lights, sizes, strict=True)):
        here = folder / str(number)
        here.mkdir(parents=True, exist_ok=True)
        file = write_scene(here, light, size=size)
        file.write_text(file.read_text("utf-8").replace(FROM[0], places[number]), "utf-8")
        names = parameters or list(VALUES)
        found.append(load_renderer(file, "target", model="mitsuba_principled", parameters=names))
    return found


def pictures_of(renderers: list, values: dict, *, spp: int = 64) -> list[Image]:
    """What each renderer shows of these values."""
    vector = renderers[0].table.pack(values)
    return [Image(r.image(vector, seed=5 + n, spp=spp), Encoding.LINEAR) for n, r in enumerate(renderers)]


def mean_light(image: Image, mask: np.ndarray) -> float:
    """Mean luminance over a mask."""
    return float((image.pixels @ np.array([0.2126, 0.7152, 0.0722], np.float32))[mask].mean())
