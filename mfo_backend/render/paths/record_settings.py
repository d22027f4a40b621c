# SPDX-License-Identifier: Apache-2.0
"""How many rays a recording takes, of what, and what each lane keeps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...material.plugins.seen_surface import SeenSurface
from ...types.light_paths import LightPaths
from ..camera.highlight_cells import Highlights
from .proposal import DefensiveProposal


@dataclass(frozen=True)
class RecordSettings:
    """How many rays a recording takes.

    `grid` squared camera rays start in each pixel; it is a number or an array (height, width). Point, spot and
    directional lights take one sample for each of them; the other lights one light sample and one sample of the
    proposal. `depth` is the path length of light that arrives over other surfaces: 2 leaves it out. `hide_emitters`
    leaves lights out of the background, as the integrator's option does. Only every `stride`-th tile of pixels along
    both axes is recorded, which bounds the memory of large pictures. `two_sided` says that back faces reflect without a
    wrapper. `held` names values of the target's material that textures give; its plugin tells them. `bumped` says that
    nodes give it normals, `cut_out` that camera rays pass where its alpha is below 1, and `mixed` that it is a
    `closure_tree`. With a `surface`, lanes keep their `subpixel` on it.
    With `light_paths` light over other surfaces has Cycles' blur, clamping and limits. `pixels` (height, width) are the
    only ones looked at; where they hold all that see the target, nothing is missed. With `highlights` more rays start
    where lights of no extent are mirrored. Every camera ray meets the lights with extent in as many independent
    `samples`, or in samples of the same directions if they are `alike`. The first `direct_samples` leave light over
    other surfaces out and need no other kernels than a recording with it. With `glows` the target's own light is no
    part of the constant picture but a lane without direction for each camera ray.
    Light below the surface is recorded for the extinctions that the material has times those of `walks`, if there are
    any: a walk is a lane without direction, too, and every lane has the numbers of `random_walk.WALK`.
    """

    grid: int | NDArray[np.int64] = 2
    seed: int = 0
    depth: int = 2
    proposal: DefensiveProposal = field(default_factory=DefensiveProposal)
    hide_emitters: bool = False
    stride: int = 1
    two_sided: bool = False
    held: tuple[str, ...] = ()
    bumped: bool = False
    cut_out: bool = False
    surface: SeenSurface | None = None
    mixed: bool = False
    light_paths: LightPaths | None = None
    pixels: NDArray[np.bool_] | None = None
    highlights: Highlights | None = None
    samples: int = 1
    alike: bool = False
    direct_samples: int = 0
    glows: bool = False
    walks: tuple[float, ...] = ()
    sensor: Any = None  # a camera that the scene lacks
