# SPDX-License-Identifier: Apache-2.0
"""The objects `view` and `light_paths` of request.json: what pictures are seen through, and indirect light."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...metrics.display.baked_view import BakedView
from ...metrics.display.tone_mapping import DisplayView, View
from ...scene.image_file import read_image
from ...types.errors import BadInputError
from ...types.image import Encoding, Image
from ...types.light_paths import NO_LIMIT, TRANSPARENT_BOUNCES, LightPaths
from .checked_object import CheckedObject
from .job_folder import JobFolder


@dataclass(frozen=True)
class ViewTable:
    """The file of a view's table; `metrics.display.baked_view.BakedView` has what it holds."""

    path: str
    size: int
    log2_min: float
    log2_max: float


def view_from_json(data: Any, where: str) -> DisplayView | None:
    """Exposure and gamma of the object `view`; None without it."""
    if data is None:
        return None
    view = CheckedObject(data, f"{where}: view", ("exposure_ev", "gamma", "lut"))
    # Blender allows -32 to 32 stops and a gamma of 0 to 5, of which 0 is a black picture
    return DisplayView(view.number("exposure_ev", -32.0, 32.0, 0.0), view.number("gamma", 0.01, 5.0, 1.0))


def table_from_json(data: Any, where: str) -> ViewTable | None:
    """The `lut` of the object `view`; None without it."""
    if not isinstance(data, Mapping) or data.get("lut") is None:
        return None
    table = CheckedObject(data["lut"], f"{where}: view.lut", ("path", "size", "log2_min", "log2_max"))
    return ViewTable(
        path=table.text("path"),
        size=table.integer("size", 3, 128),
        log2_min=table.number("log2_min", -64.0, 64.0),
        log2_max=table.number("log2_max", -64.0, 64.0),
    )


def view_of(folder: JobFolder, view: DisplayView | None, table: ViewTable | None, reference: Image) -> View:
    """A request's table or view, else Standard as it is, for a linear reference with an exposure that suits it.

    Raises
    ------
    BadInputError
        If the table cannot be read or is not what the request says.
    """
    if table is not None:
        return _baked(folder, table)
    if view is not None:
        return view
    return DisplayView() if reference.encoding is Encoding.SRGB else DisplayView.for_scene(reference.pixels)


def _baked(folder: JobFolder, table: ViewTable) -> BakedView:
    pixels = read_image(folder.file(table.path, what="request.json: view.lut.path")).pixels
    size = table.size
    if pixels.shape != (size, size * size, 3):
        raise BadInputError(
            f"The view's table {table.path} is {pixels.shape[1]}x{pixels.shape[0]}, but request.json says {size} "
            f"nodes, which is {size * size}x{size}: export the job again."
        )
    return BakedView(pixels.reshape(size, size, size, 3), table.log2_min, table.log2_max)


def light_paths_from_json(data: Any, where: str) -> LightPaths | None:
    """What is done to indirect light; None without it."""
    if data is None:
        return None
    counts = ("diffuse_bounces", "glossy_bounces", "transmission_bounces")
    fewest = ("min_light_bounces", "min_transparent_bounces")
    others = ("filter_glossy", "clamp_indirect", "transparent_bounces")
    paths = CheckedObject(data, f"{where}: light_paths", (*others, *counts, *fewest))
    return LightPaths(
        filter_glossy=paths.number("filter_glossy", 0.0, 1e4, 0.0),
        clamp_indirect=paths.number("clamp_indirect", 0.0, 1e12, 0.0),
        transparent_bounces=paths.integer("transparent_bounces", 0, NO_LIMIT, TRANSPARENT_BOUNCES),
        **{name: paths.integer(name, 0, NO_LIMIT, NO_LIMIT) for name in counts},
        **{name: paths.integer(name, 0, NO_LIMIT, 0) for name in fewest},
    )
