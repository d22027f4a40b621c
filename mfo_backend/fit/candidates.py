# SPDX-License-Identifier: Apache-2.0
"""What a scene has to offer for a further picture: its other cameras, and lights that can be moved or left alone."""

from __future__ import annotations

from dataclasses import dataclass

# A proposal of twelve turns, eleven cameras and a lamp, turned and alone, takes 0.4 to 0.7 s of processor time, of
# which each lamp has 0.3 (docs/notebook/several_pictures.md). Larger: results wait longer for a proposal.
MOST_CAMERAS, MOST_LIGHTS = 12, 3


@dataclass(frozen=True)
class OtherCamera:
    """A perspective camera of the scene, by its name.

    `to_world` are the 16 numbers of Mitsuba's matrix, row by row; `fov` is its field of view along x, degrees.
    """

    name: str
    to_world: tuple[float, ...]
    fov: float


@dataclass(frozen=True)
class SceneLight:
    """A light that can be moved or left alone: what the user calls it, and the id of its emitter in the scene file."""

    name: str
    emitter: str


@dataclass(frozen=True)
class Candidates:
    """The cameras and lights of a scene."""

    cameras: tuple[OtherCamera, ...] = ()
    lights: tuple[SceneLight, ...] = ()


NOTHING_ELSE = Candidates()
