# SPDX-License-Identifier: Apache-2.0
"""What a fit needs of a renderer. Importing this module imports no renderer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...types.image import Pixels, Pullback
from ...types.light_paths import LightPaths
from ...types.parameter import ParameterTable, Vector
from ..models.graph_pictures import GraphPictures
from .pass_counter import PassCounter


class Interrupted(Exception):  # noqa: N818  # a request, not an error
    """A renderer gave up its picture because the job was asked to stop."""


class Renderer(Protocol):
    """Pictures of one scene as a function of the parameters being fitted."""

    model: str  # name of the material model
    table: ParameterTable  # the parameters being fitted
    start: Vector  # their values in the scene, moved into the bounds
    counter: PassCounter

    @property
    def passes(self) -> float:
        """Renders of one full picture so far; an image with its pull-back counts 3."""
        ...

    def image(self, vector: Vector, *, seed: int, spp: int) -> Pixels:
        """The picture, scene-linear Rec.709, float32 (height, width, 3), every pixel finite."""
        ...

    def image_and_pullback(self, vector: Vector, *, seed: int, spp: int) -> tuple[Pixels, Pullback]:
        """The picture, and the map from dLoss/dPixels to dLoss/dVector at this point."""
        ...

    def target_mask(self) -> NDArray[np.bool_]:
        """Pixels (height, width) whose footprint sees the target directly."""
        ...

    def otherwise_mask(self) -> NDArray[np.bool_]:
        """Pixels (height, width) whose footprint sees what Cycles shows otherwise, as a holdout."""
        ...


def load_renderer(
    scene_xml: Path,
    shape_id: str,
    *,
    model: str,
    parameters: str | Sequence[str],
    materials: Mapping[str, Mapping[str, Any]] | None = None,
    light_paths: LightPaths | None = None,
    graph: GraphPictures | None = None,
) -> Renderer:
    """Load a scene with the material of shape `shape_id` open to change.

    Parameters
    ----------
    model
        Name of a material model, see `material_model.MODELS`.
    parameters
        Names of its parameters, ``"all"`` or ``"reduced"``.
    materials
        `materials` of request.json, for models that are not described by the scene file.
    light_paths
        What Cycles does to indirect light; the model `mitsuba_principled` has none of it.
    graph
        Free values inside the nodes of the target, after the parameters in the table.

    Raises
    ------
    BadInputError
        If the scene, the shape, its material or a parameter cannot be used.
    SetupError
        If Mitsuba cannot be used on this machine.
    """
    from .mitsuba_renderer import load_mitsuba_renderer

    return load_mitsuba_renderer(
        scene_xml,
        shape_id,
        model=model,
        parameters=parameters,
        materials=materials or {},
        light_paths=light_paths,
        graph=graph,
    )
