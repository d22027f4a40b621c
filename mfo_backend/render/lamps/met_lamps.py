# SPDX-License-Identifier: Apache-2.0
"""The lamps of a scene as rays meet them."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

if TYPE_CHECKING:
    from .lamp import Lamp  # needs a variant

DELTA = mi.EmitterFlags.DeltaPosition | mi.EmitterFlags.DeltaDirection


def lights_have_no_extent(scene: mi.Scene) -> bool:
    """Whether all light is that of points, spots and directions, which no ray can meet."""
    return all(mi.has_flag(emitter.flags(), DELTA) for emitter in scene.emitters())


class SceneLamps:
    """The lamps that a ray can meet, with the probability that `scene.sample_emitter_direction` chooses each."""

    def __init__(self, scene: mi.Scene) -> None:
        self.lamps: list[tuple[Lamp, Any]] = []
        met = [
            (index, emitter)
            for index, emitter in enumerate(scene.emitters())
            if hasattr(emitter, "crossing") and not mi.has_flag(emitter.flags(), DELTA)
        ]
        if met:
            # one number for all where they are equal
            chances = np.broadcast_to(scene.pdf_emitter(mi.UInt32([index for index, _ in met])).numpy(), len(met))
            self.lamps = [(lamp, dr.opaque(mi.Float, float(c))) for (_, lamp), c in zip(met, chances, strict=True)]

    def __bool__(self) -> bool:
        return bool(self.lamps)

    @property
    def seen(self) -> bool:
        """Whether camera rays meet one."""
        return any(lamp.camera for lamp, _ in self.lamps)

    def met(
        self,
        ray: mi.Ray3f,
        surface: mi.SurfaceInteraction3f,
        active: mi.Bool,
        *,
        density: mi.Float | None = None,
        camera: mi.Bool | bool = False,
        chance: float | None = None,
        sent_from: mi.Point3f | None = None,
    ) -> mi.Color3f:
        """Radiance of all lamps that `ray` meets before `surface`, or before infinity where that is not valid.

        Each counts by the share that `density`, with which the ray was sent out, has beside that of a light sample, its
        lamp chosen with `chance` (default: as the scene does); without `density` each counts in full. Where `camera` is
        true only lamps that cameras see are met. A ray that went straight through surfaces was `sent_from` elsewhere.
        """
        total = mi.Color3f(0)
        limit = dr.select(surface.is_valid(), surface.t, dr.inf)
        for lamp, own_chance in self.lamps:
            found = lamp.crossing(ray.o, ray.d)
            on = found.hit & active & (found.distance > 0) & (found.distance <= limit)
            if not lamp.camera:
                on &= ~mi.Bool(camera)
            share = mi.Float(1)
            if density is not None:
                other = found.density if sent_from is None else lamp.crossing(sent_from, ray.d).density
                share = density / (density + other * (own_chance if chance is None else chance))
            total += dr.select(on, lamp.radiance * (found.factor * share), 0)
        return total


def alone(ds: mi.DirectionSample3f) -> mi.Bool:
    """Whether no ray can meet the light of this sample: `delta`, which lamps say of themselves too."""
    return ds.delta & mi.has_flag(ds.emitter.flags(), DELTA)
