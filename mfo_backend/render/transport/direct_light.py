# SPDX-License-Identifier: Apache-2.0
"""Pictures of nothing but direct light from lamps, without the bounce that could meet no light.

`prb` samples the material and traces a second ray where its depth ends, for the light that this ray may meet. Under
lamps without extent it meets none. Mitsuba's `direct` without samples of the material takes the same random numbers for
the rest: the same bits in half the time. Choose the variant before importing this.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
from mitsuba.ad.integrators.prb import PRBIntegrator  # pyright: ignore[reportMissingImports]

from ...types.light_paths import LightPaths
from ..lamps.met_lamps import lights_have_no_extent
from .below_surface import WithBelow
from .subsurface_walks import materials_with_below


def picture_integrator(scene: mi.Scene, light_paths: LightPaths | None) -> Any:
    """The scene's integrator, one that makes the same pictures sooner, or one that sees below surfaces, too.

    It has no derivatives. `light_paths` are those of `cycles_path`.
    """
    integrator: Any = scene.integrator()
    if light_paths is not None and materials_with_below(scene):
        return WithBelow(integrator, light_paths)
    if not isinstance(integrator, PRBIntegrator) or integrator.max_depth != 2:
        return integrator
    return DirectLight(integrator) if lights_have_no_extent(scene) else integrator


class DirectLight:
    """As much of an integrator in Python as `ordered_picture` uses."""

    def __init__(self, prb: Any) -> None:
        self.prepare, self.sample_rays = prb.prepare, prb.sample_rays
        self._direct = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0})

    def sample(self, *, scene: mi.Scene, sampler: mi.Sampler, ray: Any, active: Any, **_: Any) -> tuple[Any, Any]:
        """Radiance along camera rays, and whether they meet anything."""
        radiance, valid, _ = self._direct.sample(scene, sampler, ray, None, active)
        return radiance, valid
