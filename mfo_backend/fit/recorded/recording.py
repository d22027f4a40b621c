# SPDX-License-Identifier: Apache-2.0
"""The light paths of one recording, and what follows from them: groups, evaluators, pictures, noise, problems."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...metrics.display.baked_view import BakedView
from ...metrics.display.tone_mapping import DisplayView, View
from ...render.camera.primary_rays import TILE
from ...render.paths.recorded_image import RECALLED, RecordedImage
from ...render.paths.recorded_paths import LaneGroups, RecordedPaths
from ...render.paths.recorded_scene import MOST_LANES, RecordedScene
from ...render.sheet.recorded_sheet import RecordedSheet
from ...types.image import Pixels
from ...types.parameter import ParameterTable, Vector
from ..plans import RecordedPlan
from ..random_streams import Stream
from ..result.course import Course
from ..squares.problem import Problem
from ..squares.residuals import (
    CensoredResidual,
    DisplayedResidual,
    MakeResidual,
    OneSidedResidual,
    Residual,
    Rows,
    WeightedDisplayedResidual,
    WeightedResidual,
)
from ..tolerances import MODEL_ERROR
from .reference_noise import TileNoise, tile_noise
from .where_to_look import all_groups, detail_grid, without_fireflies

SAMPLES = 2  # of the light in a recording at the solution: their difference shows the recording's own noise


@dataclass(frozen=True, eq=False)
class Setting:
    """What all stages of a recorded fit stand on.

    Attributes
    ----------
    reference
        The picture as scene-linear radiance, float32 (height, width, 3).
    mask
        Pixels that see the target, True (height, width).
    clipped
        1 where the radiance is only known to be the reference's or more, else 0; None where it is known everywhere.
    display
        The view of a display-encoded reference; None for a linear one.
    """

    scene: RecordedScene | RecordedSheet
    reference: Pixels = field(repr=False)
    mask: NDArray[np.bool_] = field(repr=False)
    plan: RecordedPlan
    seed: int
    course: Course
    clipped: NDArray[np.float32] | None = field(default=None, repr=False)
    display: View | None = None

    @cached_property
    def without_fireflies(self) -> tuple[Pixels, int]:
        """The reference without fireflies, and how many there were. A start is found and noise is measured on it.

        Under lights of no extent it is the reference, for there a highlight may well be a pixel wide.
        """
        return without_fireflies(self.reference, self.mask) if self.sampled else (self.reference, 0)

    @property
    def calm(self) -> Pixels:
        """The reference without fireflies."""
        return self.without_fireflies[0]

    @property
    def table(self) -> ParameterTable:
        """The parameters that are fitted."""
        return self.scene.renderer.table

    @property
    def user(self) -> Vector:
        """The values in the user's scene."""
        return self.scene.renderer.start

    @property
    def sampled(self) -> bool:
        """Whether light is sampled, so that a recording has noise of its own."""
        return self.scene.needs.sampled

    def censored(self, make: MakeResidual) -> MakeResidual:
        """Residuals that expect no more of clipped pixels than a display shows."""
        view = self.display
        if view is None:
            return make
        if isinstance(view, BakedView):
            return lambda target: DisplayedResidual(view, target)
        assert isinstance(view, DisplayView)
        limit = 2.0**-view.exposure_ev
        return lambda target: CensoredResidual(make(target), target, limit)

    def weighted(self, target: Rows, weight: Rows) -> Residual:
        """The residual in standard deviations of the noise; `weight` is one over these."""
        if isinstance(self.display, BakedView):
            return WeightedDisplayedResidual(self.display, target, weight)
        return self.censored(lambda t: WeightedResidual(t, weight))(target)

    def record(
        self,
        x: Vector,
        grid: int | NDArray[np.int64],
        number: int,
        *,
        near: bool = True,
        samples: int = SAMPLES,
        thinned: bool = False,
        enough: float = MOST_LANES,
    ) -> Recording:
        """Record the light at the material `x`; see `RecordedScene.record`.

        A recording takes most of the memory of a fit: let the one before go first.
        """
        paths = self.scene.record(
            x, grid=grid, seed=Stream.RECORDINGS.seed(self.seed, number), near=near, samples=samples, enough=enough
        )
        return Recording(self, paths, number, thinned)


@dataclass(frozen=True, eq=False)
class Recording:
    """Light paths, the `number` of recordings before this one, and whether some of the target's pixels were left out.

    What is computed from the paths is kept, so that the same numbers are not computed twice.
    """

    setting: Setting
    paths: RecordedPaths
    number: int
    thinned: bool = False
    _tiles: dict[int, LaneGroups] = field(default_factory=dict, init=False, repr=False)
    _evaluators: dict[LaneGroups, RecordedImage] = field(default_factory=dict, init=False, repr=False)

    @property
    def complete(self) -> bool:
        """Whether the recording holds the pixels that see the target and not only some of its tiles."""
        return len(self.paths.pixel) > 0.9 * int(self.setting.mask.sum())  # the mask has other rays at the silhouette

    @cached_property
    def whole(self) -> Recording:
        """A recording of all pixels: this one unless it leaves some out.

        Only recordings under exact lights do, and those are alike for all materials.
        """
        if not self.thinned:
            return self
        setting = self.setting
        grid = detail_grid(setting.reference, setting.mask)  # few groups look at it closely
        return setting.record(setting.user, grid, self.number + 1, near=False)

    def tiles(self, side: int) -> LaneGroups:
        """All tiles of this side; their evaluations are remembered between problems."""
        if side not in self._tiles:
            groups = self._tiles[side] = all_groups(self.paths, side)
            self._evaluators[groups] = self.setting.scene.evaluator(self.paths, groups, RECALLED)
        return self._tiles[side]

    def problem(
        self, groups: LaneGroups, make: MakeResidual, *, calm: bool = False, near: Vector | None = None
    ) -> Problem:
        """The residuals of these groups, to the reference or to it without fireflies."""
        setting = self.setting
        residual = make(groups.average(setting.calm if calm else setting.reference))
        if setting.clipped is not None:
            residual = OneSidedResidual(residual, groups.average(setting.clipped) > 0)
        coarser = setting.scene.evaluator(self.paths, groups, coarser=True) if setting.scene.graph is not None else None
        return Problem(self._evaluator(groups), residual, groups, near, coarser)

    def _evaluator(self, groups: LaneGroups) -> RecordedImage:
        if groups in self._evaluators:
            return self._evaluators[groups]
        return self.setting.scene.evaluator(self.paths, groups, RECALLED)

    def picture(self, x: Vector) -> Pixels:
        """The recorded picture of a vector, linear; the reference where nothing is recorded."""
        return self.shown(self.pixels(x))

    def preview(self, x: Vector) -> Pixels:
        """The same for a look in between, of which the fit knows nothing afterwards."""
        return self.shown(self._pictures.glance(x)[:, :, 0])

    def shown(self, pixels: NDArray[np.float32]) -> Pixels:
        """The picture that these covered pixels are part of, which is the reference elsewhere."""
        image = self.setting.reference.astype(np.float32).copy()
        image.reshape(-1, 3)[self.paths.pixel] = pixels
        return image

    def pixels(self, x: Vector) -> NDArray[np.float32]:
        """Radiance of the covered pixels, (p, 3)."""
        return self._pictures(x)[:, :, 0]

    def pixels_and_tiles(self, x: Vector, groups: LaneGroups) -> NDArray[np.float32]:
        """The same by an evaluation with derivatives, which those of the tiles `groups` are made of."""
        pixels = self.setting.scene.evaluator(self.paths, self.paths.pixel_groups()).samples(x)
        self._evaluators[groups].note(x, pixels.averaged(groups.mean_of_pixels))
        return pixels.mean[:, :, 0]

    @cached_property
    def _pictures(self) -> RecordedImage:
        return self.setting.scene.pictures(self.paths, self.paths.pixel_groups())

    def noise(self, pixels: NDArray[np.float32], side: int) -> TileNoise:
        """Noise of the reference in all tiles of this side, given a model's `pixels`."""
        paths = self.paths
        return tile_noise(self.setting.calm, pixels, paths, self.tiles(side), paths.interior, side)

    def weighing(self, noise: TileNoise, side: int) -> MakeResidual:
        """Residuals of tiles of this side, or of some of them, in standard deviations of their `noise`."""
        least = MODEL_ERROR * float(self.tiles(side).average(self.setting.reference).mean())
        weight = (1.0 / np.hypot(noise.deviation, max(least, 1e-12))).astype(np.float32)
        return lambda target: self.setting.weighted(target, weight)

    def misfit(self, x: Vector) -> tuple[float, TileNoise]:
        """Root mean square difference of the tiles from the reference, in standard deviations of the noise, and that
        noise."""
        groups, pixels = self.tiles(TILE), self.pixels(x)
        noise = self.noise(pixels, TILE)
        problem = self.problem(groups, self.weighing(noise, TILE))
        values = problem.residual(groups.mean_of_pixels(pixels))[0]
        # as far as a few outliers go, it is their number that counts and not their size
        return float(np.sqrt(np.mean(np.minimum(np.abs(values), WeightedResidual.LIMIT) ** 2))), noise
