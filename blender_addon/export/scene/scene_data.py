# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything an export takes out of Blender, as plain data. Knows nothing of bpy."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..camera.camera_model import Camera, PixelFilter
from ..files.ply_file import TriangleMesh
from ..lights.light_model import Light
from ..material_model import Material
from .world_model import World

TARGET_SHAPE = "target"
TARGET_BSDF = "target_bsdf"


def target_shape(number: int) -> str:
    """The id of the shape of a fitted material, counted from 0 in the order of the job."""
    return TARGET_SHAPE if number == 0 else f"{TARGET_SHAPE}_{number + 1}"


def target_bsdf(number: int) -> str:
    """The id of its BSDF."""
    return f"{target_shape(number)}_bsdf"


@dataclass(frozen=True)
class Terminator:
    """What Cycles does to shadows of smooth-shaded facets: Blender's Geometry Offset and Shading Offset, in [0, 1]."""

    geometry_offset: float = 0.1
    shading_offset: float = 0.0


@dataclass(frozen=True)
class Hidden:
    """The kinds of `rays`, of diffuse, glossy and transmission, that pass the object `owner`."""

    owner: str = ""
    rays: tuple[str, ...] = ()


@dataclass(frozen=True)
class Shape:
    """One mesh with one material; `identifier` is its id in the scene file.

    `shadow_transmission` is what shadow rays keep at its surface, None where that follows from its alpha. Where
    `camera_hidden` rays of the camera pass it as if it were not there. Shapes of one `body`, above 0, are one object
    below the surface. `linked` is the object's name where the light it gives is linked to some objects. Rays may pass
    what is `hidden` from them. What is `seen_otherwise` Cycles shows the camera as something else, as
    a shadow catcher.
    """

    identifier: str
    mesh: TriangleMesh
    bsdf: str
    terminator: Terminator = Terminator()
    shadow_transmission: float | None = None
    camera_hidden: bool = False
    body: int = 0
    linked: str = ""
    hidden: Hidden = Hidden()
    seen_otherwise: bool = False


@dataclass(frozen=True)
class RenderSettings:
    """What the picture needs beside the scene. `exposure` is Cycles' film exposure, already in every light.

    `light_paths` is that object of request.json: what Cycles does to indirect light. With a `light_tree` Cycles
    chooses among lights by what they give without their nodes. `gives_below_zero` says that a Principled BSDF whose
    emission is negative takes light away.
    """

    pixel_filter: PixelFilter
    max_depth: int
    film_transparent: bool
    exposure: float
    spp: int
    light_paths: dict[str, float | int] = field(default_factory=dict)
    light_tree: bool = False
    gives_below_zero: bool = False


@dataclass
class SceneData:
    """A whole scene: shape and BSDF of the first fitted material are `target` and `target_bsdf`.

    Where several are fitted, `target_count` of them, the others' have numbers: `target_2` and `target_2_bsdf`. All
    places count from `origin`, a place in Blender's world.
    """

    camera: Camera
    settings: RenderSettings
    world: World
    lights: list[Light] = field(default_factory=list)
    shapes: list[Shape] = field(default_factory=list)
    materials: dict[str, Material] = field(default_factory=dict)
    target_count: int = 1
    origin: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    # why no ray of the camera was found for a fitted material, by its number
    unseen: dict[int, str] = field(default_factory=dict)
    # what bends all views of a fitted material, "" where one is straight
    behind: dict[int, str] = field(default_factory=dict)

    @property
    def target(self) -> Shape | None:
        """The shape whose material is fitted, or the first of them; None if it has no faces."""
        return self.target_of(0)

    def target_of(self, number: int) -> Shape | None:
        """The shape of a fitted material, None if it has no faces."""
        return next((shape for shape in self.shapes if shape.identifier == target_shape(number)), None)

    @property
    def emitting(self) -> list[Shape]:
        """Shapes whose material gives light."""
        return [shape for shape in self.shapes if self.materials[shape.bsdf].emission.max(initial=0.0) > 0.0]

    def middle(self) -> NDArray[np.float64]:
        """Return the middle of all geometry."""
        if not self.shapes:
            return np.zeros(3)
        low = np.min([shape.mesh.positions.min(axis=0) for shape in self.shapes], axis=0).astype(np.float64)
        high = np.max([shape.mesh.positions.max(axis=0) for shape in self.shapes], axis=0).astype(np.float64)
        return 0.5 * (low + high)
