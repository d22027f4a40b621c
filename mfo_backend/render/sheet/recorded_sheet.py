# SPDX-License-Identifier: Apache-2.0
"""Several scenes' recorded paths as those of one contact sheet: normal equations of pictures add up."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...types.errors import BadInputError
from ...types.image import Pixels
from ..models.joined_graph import JoinedGraph
from ..models.varying_values import SUBPIXEL
from ..paths.merged_lanes import summed
from ..paths.recorded_image import RecordedImage
from ..paths.recorded_paths import LaneGroups, RecordedPaths, ReturnedLight
from ..paths.recorded_scene import MOST_LANES, RecordedScene, SceneNeeds
from .contact_sheet import ContactSheet
from .sheet_renderer import SheetRenderer

_SCENES_APART = 0x9E3779B1  # between the seeds of two pictures' recordings


class RecordedSheet:
    """What `RecordedScene` is for one picture, for all pictures of a sheet; `counts` is over its pixels.

    Pictures that do not show the target say nothing of it, and are left out. All of them together have the lanes and
    the rays of one, so they take about the time and the memory of one.

    Raises
    ------
    UnrecordableError
        If the material has a lobe that recorded paths cannot hold.
    """

    def __init__(self, renderer: SheetRenderer, counts: NDArray[np.bool_] | None = None) -> None:
        self.renderer = renderer
        count = len(renderer.renderers)
        parts = [None if counts is None else renderer.sheet.cut(counts, number) for number in range(count)]
        masks = [r.target_mask() for r in renderer.renderers]
        covered = [int((m if of is None else m & of).sum()) for m, of in zip(masks, parts, strict=True)]
        self._numbers = [number for number, pixels in enumerate(covered) if pixels]  # of the pictures that show it
        self._parts = [covered[number] / sum(covered) for number in self._numbers]
        graphs = [graph for number in self._numbers if (graph := renderer.renderers[number].graph) is not None]
        self.graph = JoinedGraph(graphs) if graphs else None
        self._scenes = [
            RecordedScene(renderer.renderers[number], covered[number], part, parts[number], self.graph)
            for number, part in zip(self._numbers, self._parts, strict=True)
        ]
        self.model = self._scenes[0].model

    @property
    def first(self) -> RecordedScene:
        """That of the first picture that shows the target."""
        return self._scenes[0]

    @property
    def lights_exact(self) -> bool:
        """See `RecordedScene.lights_exact`; so of all pictures."""
        return all(scene.lights_exact for scene in self._scenes)

    @cached_property
    def needs(self) -> SceneNeeds:
        """What any of the pictures needs."""
        found = [scene.needs for scene in self._scenes]
        depth = max(needs.depth for needs in found)
        notes = found[0].notes if depth == 2 else ()
        return SceneNeeds(any(n.sampled for n in found), depth, notes, max(n.held for n in found))

    def record(
        self,
        vector: NDArray[np.float64],
        *,
        grid: int | NDArray[np.int64],
        seed: int,
        near: bool,
        samples: int = 1,
        enough: float = MOST_LANES,
    ) -> RecordedPaths:
        """See `RecordedScene.record`; `grid` is over the sheet, `enough` lanes are those of all pictures."""
        parts = {}
        for number, scene, part in zip(self._numbers, self._scenes, self._parts, strict=True):
            own = grid if isinstance(grid, int) else self.renderer.sheet.cut(grid, number)
            try:
                parts[number] = scene.record(
                    vector, grid=own, seed=(seed + number * _SCENES_APART) % 2**32, near=near, samples=samples,
                    enough=part * enough, needs=self.needs,
                )  # fmt: skip
            except BadInputError as error:
                raise BadInputError(f"Picture {self.renderer.sheet.labels[number]}: {error}") from error
        if self.graph is not None:
            begins = self.graph.begins(vector[len(vector) - self.graph.table.length :])
            parts = {n: _on_rows(paths, begin) for (n, paths), begin in zip(parts.items(), begins, strict=True)}
        return joined(parts, self.renderer.sheet)

    def finest_grid(self, samples: int, lanes: float) -> int:
        """See `RecordedScene.finest_grid`."""
        return min(
            scene.finest_grid(samples, part * lanes) for scene, part in zip(self._scenes, self._parts, strict=True)
        )

    def returned_change(self, paths: RecordedPaths, vector: NDArray[np.float64]) -> float:
        """See `RecordedScene.returned_change`."""
        return self._scenes[0].returned_change(paths, vector)

    def images_of(
        self, paths: RecordedPaths, groups: LaneGroups, vector: NDArray[np.float64]
    ) -> Callable[[Mapping[str, NDArray[np.float32]]], NDArray[np.float32]]:
        """See `RecordedScene.images_of`; the graph's pictures are those of all pictures."""
        return self._scenes[0].images_of(paths, groups, vector)

    def pictures(self, paths: RecordedPaths, groups: LaneGroups) -> RecordedImage:
        """See `RecordedScene.pictures`."""
        return self._scenes[0].pictures(paths, groups)

    def evaluator(
        self, paths: RecordedPaths, groups: LaneGroups, recalled: int = 1, *, coarser: bool = False
    ) -> RecordedImage:
        """See `RecordedScene.evaluator`."""
        return self._scenes[0].evaluator(paths, groups, recalled, coarser=coarser)


def _on_rows(paths: RecordedPaths, begin: int) -> RecordedPaths:
    """A recording whose graph's pictures begin at this row of all pictures'."""
    moved = paths.held[SUBPIXEL] + dr.opaque(mi.UInt32, begin)
    return replace(paths, held={**paths.held, SUBPIXEL: moved})


def joined(recorded: Mapping[int, RecordedPaths], sheet: ContactSheet) -> RecordedPaths:
    """The recording of a sheet from those of its pictures by number, some of which may have none.

    A sample's lanes follow each other, picture by picture, as those of one picture do.
    """
    parts = list(recorded.values())
    begins, ranges, total = [], [], 0
    for sample in range(len(parts[0].first)):
        at, row = [], []
        for number, paths in enumerate(parts):
            first = paths.first[sample]
            at.append(total - int(first[0]))
            row.append(first[:-1] + at[-1])
            ranges.append((number, int(first[0]), int(first[-1]) - int(first[0]), total))
            total += int(first[-1]) - int(first[0])
        begins.append(np.concatenate([*row, [total]]))
    gains = [dr.opaque(mi.Float, sheet.gains[number]) for number in recorded]
    merge = partial(_merged, ranges=ranges, total=total)
    tiles = np.cumsum([0, *(int(paths.tile.max(initial=-1)) + 1 for paths in parts)])
    return RecordedPaths(
        wi=merge([paths.wi for paths in parts]),
        wo=merge([paths.wo for paths in parts]),
        weight=merge([paths.weight * gain for paths, gain in zip(parts, gains, strict=True)]),
        pixel=np.concatenate([sheet.on_sheet(paths.pixel, number) for number, paths in recorded.items()]),
        tile=np.concatenate([paths.tile + begin for paths, begin in zip(parts, tiles[:-1], strict=True)]),
        first=np.stack(begins),
        coverage=np.concatenate([paths.coverage for paths in parts]),
        constant=_on_sheet({number: paths.constant for number, paths in recorded.items()}, sheet),
        held={name: merge([paths.held[name] for paths in parts]) for name in parts[0].held},
        returned=_returned_light(parts, gains, merge),
        vector=parts[0].vector,
    )


def _returned_light(
    parts: Sequence[RecordedPaths], gains: Sequence[mi.Float], merge: Callable[[list[mi.Color3f]], mi.Color3f]
) -> ReturnedLight | None:
    """Light that returns to the target in all pictures, reflected as often as in the mean of them."""
    if all(paths.returned is None for paths in parts):
        return None
    none = mi.Color3f(dr.zeros(mi.Float, max(paths.lanes for paths in parts)))
    lights = [paths.returned for paths in parts]
    weights = [none if light is None else light.weight * gain for light, gain in zip(lights, gains, strict=True)]
    sums = np.array([summed(weight) for weight in weights])
    orders = np.array([np.ones(3) if light is None else light.order for light in lights])
    total = sum(summed(paths.weight * gain) for paths, gain in zip(parts, gains, strict=True))
    order = (sums * orders).sum(axis=0) / np.maximum(sums.sum(axis=0), 1e-30)
    return ReturnedLight(merge(weights), order, sums.sum(axis=0) / total)


def _on_sheet(pictures: Mapping[int, Pixels], sheet: ContactSheet) -> Pixels:
    """Pictures of radiance by number, black where there is none."""
    black = (np.zeros((*size, 3), np.float32) for size in sheet.sizes)
    return sheet.radiance([pictures.get(number, nothing) for number, nothing in enumerate(black)])


def _merged(arrays: Sequence[Any], ranges: Sequence[tuple[int, int, int, int]], total: int) -> Any:
    """One array of `total` entries with runs of others: number of the array, first entry, length and place."""
    whole = dr.zeros(type(arrays[0]), total)
    dr.eval(whole)
    for number, begin, length, place in ranges:
        if length:
            index = dr.arange(mi.UInt32, length)
            value = dr.gather(type(arrays[0]), arrays[number], index + dr.opaque(mi.UInt32, begin))
            dr.scatter(whole, value, index + dr.opaque(mi.UInt32, place), mode=dr.ReduceMode.Permute)
    dr.eval(whole)
    return whole
