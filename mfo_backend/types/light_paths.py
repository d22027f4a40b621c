# SPDX-License-Identifier: Apache-2.0
"""What Cycles does to light that arrives over other surfaces, as a scene's render settings say."""

from __future__ import annotations

from dataclasses import dataclass

NO_LIMIT = 1024  # bounces: Blender's largest
TRANSPARENT_BOUNCES = 8  # Blender's default


@dataclass(frozen=True)
class LightPaths:
    """Settings of the panel Light Paths that change indirect light only; the defaults change nothing.

    Attributes
    ----------
    filter_glossy
        Blender's Filter Glossy: reflections seen over an unlikely bounce are at least so rough. 0 is off.
    clamp_indirect
        Largest mean of the three channels one sample of indirect light may have, with Cycles' film exposure in the
        lights. 0 is off.
    diffuse_bounces, glossy_bounces, transmission_bounces
        Bounces of one kind after which a path ends.
    transparent_bounces
        Surfaces that light goes straight through one after the other.
    min_light_bounces, min_transparent_bounces
        How many of these a path has before chance may end it: which is seen where samples are clamped alone.
    """

    filter_glossy: float = 0.0
    clamp_indirect: float = 0.0
    diffuse_bounces: int = NO_LIMIT
    glossy_bounces: int = NO_LIMIT
    transmission_bounces: int = NO_LIMIT
    transparent_bounces: int = TRANSPARENT_BOUNCES
    min_light_bounces: int = 0
    min_transparent_bounces: int = 0
