# SPDX-License-Identifier: Apache-2.0
"""How much a fit does: on recorded light paths by preset, and on traced ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

# Of a solve that begins near its end: where light is sampled, of what is tried from there, and of FLIP itself, whose
# gradient takes about a tenth of a second at 256 x 256
NEAR_EVALUATIONS = 12
PERCEPTUAL_EVALUATIONS = 25  # of a stage, from each start
# Squared: most rays of a pixel of one of several materials. With 256 half of the residual of a chest of 411 pixels was
# the recording's own noise, which put a wrong material before the truth by a chi squared of 12; with 1024 the truth
# came first by 20 (docs/notebook/several_materials.md). Larger: more time. Smaller: chance decides on small targets.
FINEST_AMONG_OTHERS = 32


@dataclass(frozen=True)
class RecordedPlan:
    """How much a recorded fit does.

    Attributes
    ----------
    scan
        Whether to look for starts; without it only the scene's own material and a random one are tried.
    grid_first, grid_last
        Squared: camera rays a pixel of the first recording and of the one at the solution, where light is sampled.
        Each of the latter meets the light twice.
    too_noisy, low_noise, grid_finest
        Where the noise of the recording at the solution is above the first of these shares of a tile's radiance, as
        that of mirrors under small lights is, it is made anew with as many rays as make it the second, but no more
        than the square of the third.
    most_own, low_own, clean_lanes
        The same where the recording's own noise is more than the first of these parts of the mean square residual, as
        it is under references of little noise: with as many rays as make it the second, while the recording has no more
        lanes than the third. Values are as exact as all lanes together, so large pictures seldom need it.
    side_last
        Pixels along each side of the tiles of the last stage where light is sampled. Quarters of the tiles of the
        stages before see twice the detail and lose fewer pixels to the silhouette; single pixels see too much of the
        recording's own noise.
    first_tiles
        About as many of these tiles are looked at until the steps are small and while basins are compared: a few
        values need no more, and the last steps take all.
    scan_lanes, start_lanes
        Recorded lanes the scan and the fits from its nodes look at where light is sampled.
    exact_scan_lanes, exact_start_lanes, refine_lanes
        Those that they and the last stage look at where every light is exact: without noise more say nothing new. A
        large target is recorded on about as many as the last stage looks at.
    starts
        Nodes of the scan to start from, besides the best two metals, the material in the scene and a random one.
    same_cost, agreement_evaluations, exact_agreement_evaluations
        Two opposite starts get this many evaluations before the scan, where light is sampled and where every light is
        exact. It is left out where their costs differ by no more than this factor (0: never); under exact lights only
        below `seen_rms`, too, for there the right material leaves little of the picture.
    trial_evaluations
        After as many only starts within `keep_factor` of the best cost go on.
    seen_rms, solved_rms
        Root mean squares of the log residual: below the first nothing can be seen, perceptual stages are left out, and
        other starts get their trial only, because a wrong basin may come as near; below the second, about a recording's
        own, none is tried.
    other_evaluations
        Of a solve that tries to leave a basin where every light is exact.
    basins, basin_factor
        Solutions the preset `best` keeps alive to the end, and how much more than the best one they may cost.
    alike
        Whether materials that are known to be taken for the solution are tried where light is sampled, too. Under exact
        lights they always are.
    """

    scan: bool = True
    grid_first: int = 4
    grid_last: int = 4
    too_noisy: float = 0.07
    low_noise: float = 0.06
    grid_finest: int = 16
    most_own: float = 0.3
    low_own: float = 0.2
    clean_lanes: int = 2_000_000
    side_last: int = 2
    first_tiles: int = 1000
    scan_lanes: int = 20_000
    start_lanes: int = 80_000
    exact_scan_lanes: int = 8_000
    exact_start_lanes: int = 20_000
    refine_lanes: int = 80_000
    starts: int = 3
    same_cost: float = 1.02
    agreement_evaluations: int = 12
    exact_agreement_evaluations: int = 20
    trial_evaluations: int = 10
    keep_factor: float = 10.0
    seen_rms: float = 5e-3
    solved_rms: float = 2e-3
    other_evaluations: int = 25
    basins: int = 3
    basin_factor: float = 1.5
    alike: bool = False

    def among_others(self) -> RecordedPlan:
        """The same for one of several materials, which may fill few pixels: more rays for each, more basins."""
        return replace(self, grid_finest=FINEST_AMONG_OTHERS, alike=True)

    def of_a_small_target(self) -> RecordedPlan:
        """The same where there are few pixels for a recording's own noise to even out over: less of it is allowed.

        In two queues of 50 targets of 250 to 510 pixels 44 and 44 ended within 0.01 FLIP of the floor by `fast` so, 13
        and 8 without it, in 7 and 12 % more processor time (docs/notebook/several_materials.md).
        """
        return replace(self, most_own=RecordedPlan.most_own)

    @staticmethod
    def of(preset: str) -> RecordedPlan:
        """The plan of a preset.

        `fast` takes fewer camera rays at the solution where light is sampled, and is content with more noise: less
        time, and more error (docs/notebook/recorded_paths.md has both).
        """
        if preset == "fast":
            return RecordedPlan(grid_last=3, too_noisy=0.1, low_noise=0.08, grid_finest=8, most_own=1.0)
        if preset == "best":  # goes on from several solutions
            return RecordedPlan(same_cost=0.0)
        return RecordedPlan()


@dataclass(frozen=True)
class TransmissionPlan:
    """How much a fit on traced paths does.

    `*_pixels` bounds the pixels a stage looks at, `*_samples` are paths a pixel in each of the two halves and
    `polish_paths` those of all pixels, `counted_paths` the most of them where a noisy reference is compared at equal
    counts (`fit/traced/sample_count.py`); `race_steps` and `polish_steps` bound the iterations, `starts` the nodes that
    race, besides the scene's own material. The polish ends when the error that is left is expected to be below the
    share `enough` of the reference's noise (squares; 0.02 is one per cent of the root). Under a very noisy reference
    an eye may see such an error; one above `unseen` (relative) has to be the reference's doing, too, not our own.
    """

    scan_pixels: int = 500
    scan_samples: int = 4
    scan_steps: int = 2
    starts: int = 2
    race_pixels: int = 1500
    race_samples: int = 8
    race_steps: int = 7
    coat_pixels: int = 4000
    polish_pixels: int = 16_000
    polish_paths: int = 20_000
    polish_steps: int = 32
    counted_paths: int = 1 << 18
    guard_samples: int = 4
    enough: float = 0.005
    unseen: float = 0.04
