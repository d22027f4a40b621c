# SPDX-License-Identifier: Apache-2.0
"""How much of a target's light comes over other surfaces."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ...types.light_paths import LightPaths
from .proposal import DefensiveProposal
from .record_paths import record_paths
from .record_settings import RecordSettings


def indirect_share(
    scene: mi.Scene,
    shape: mi.Shape,
    depth: int,
    two_sided: bool,
    light_paths: LightPaths | None = None,
    *,
    stride: int = 1,
    through: bool = False,
) -> float:
    """Irradiance of the visible target over other surfaces, relative to its irradiance from lights; one ray a pixel.

    Of a target that light comes `through` it is that of both sides.
    """
    settings = RecordSettings(
        grid=1, depth=depth, stride=stride, two_sided=two_sided, light_paths=light_paths,
        samples=2, alike=True, direct_samples=1, proposal=DefensiveProposal(through=through),
    )  # fmt: skip
    with dr.suspend_grad():
        paths = record_paths(scene, shape, settings, allow_dark=True)
        if not paths.lanes:
            return 0.0
        lit = mi.luminance(paths.weight) * dr.abs(paths.wo.z)
        with_others = dr.arange(mi.UInt32, paths.lanes) >= dr.opaque(mi.UInt32, int(paths.first[1, 0]))
        parts = [dr.select(some, lit, 0.0) for some in (with_others, ~with_others)]
        dr.eval(parts)  # at once
        everything, direct = (float(dr.sum(part)[0]) for part in parts)
    return (everything - direct) / max(direct, 1e-30)
