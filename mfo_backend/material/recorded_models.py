# SPDX-License-Identifier: Apache-2.0
"""The material models that recorded paths can evaluate: reflecting ones, as plain functions of two directions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any, Protocol

from ..types.errors import UnrecordableError
from ..types.parameter import ParameterTable, Value
from .arrays.grid_table import loaded_buffers
from .cycles_model import CyclesModel
from .mitsuba_principled import MitsubaPrincipled
from .principled.blender_principled import BLENDER_5_0, blender_principled
from .principled.bumped_normals import BUMPED_NORMALS
from .principled.needed_lobes import needed_lobes
from .principled.principled_parameters import BLENDER_PRINCIPLED

# (values by name, wi, wo) -> BSDF times cosine; directions in the shading frame, a value of exactly 0.0 is a lobe left
# out
Evaluate = Callable[[Mapping[str, Any], Any, Any], Any]


class RecordedModel(Protocol):
    """A reflecting material as a plain Dr.Jit function.

    Attributes
    ----------
    normals
        Directions that the functions take besides, where nodes give the surface normals.
    scanned
        Values a global start scans: the main lobe's width first.
    two_sided
        Whether back faces reflect like front faces without a wrapper.
    limited_width
        Whether the larger width of an anisotropic lobe is at most 1, as in Cycles.
    """

    name: str
    table: ParameterTable
    normals: ParameterTable
    scanned: tuple[str, ...]
    two_sided: bool
    limited_width: bool

    def values(self, given: Mapping[str, Value | None], free: Collection[str]) -> dict[str, Value | None]:
        """Every value `bind` needs besides the free ones, from those of a material; None is one of a texture.

        Raises
        ------
        UnrecordableError
            If the material transmits light.
        """
        ...

    def bind(self, fixed: Mapping[str, Value | None], free: Collection[str]) -> Evaluate:
        """The function of all values, without the lobes that cannot contribute."""
        ...

    def buffers(self) -> list[Any]:
        """Evaluated Dr.Jit arrays that the bound functions read."""
        ...


class BlenderPrincipledModel:
    """Blender's Principled BSDF, opaque."""

    name: str = "blender_principled"
    table: ParameterTable = BLENDER_PRINCIPLED
    normals: ParameterTable = BUMPED_NORMALS
    scanned: tuple[str, ...] = ("roughness", "coat_roughness")
    two_sided: bool = True
    limited_width: bool = True

    def __init__(self, cycles: CyclesModel = BLENDER_5_0) -> None:
        self._cycles = cycles

    def values(self, given: Mapping[str, Value | None], free: Collection[str]) -> dict[str, Value | None]:
        """See `RecordedModel`."""
        for name, opaque in (("transmission_weight", 0.0), ("alpha", 1.0)):
            if name in free or given.get(name, opaque) != opaque:
                raise UnrecordableError(f"The material has {name!r} and recorded paths hold reflected light only.")
        return {p.name: given.get(p.name, p.default) for p in self.table if p.name not in free}

    def bind(self, fixed: Mapping[str, Value | None], free: Collection[str]) -> Evaluate:
        """See `RecordedModel`."""
        lobes = needed_lobes(fixed, free)
        return lambda parameters, wi, wo: blender_principled(parameters, wi, wo, lobes, self._cycles)

    def buffers(self) -> list[Any]:
        """See `RecordedModel`: the albedo tables."""
        return loaded_buffers()


def recorded_model(name: str, bsdf: Any) -> RecordedModel:
    """The recorded version of model `name`, with the switches of the scene's `bsdf`.

    Raises
    ------
    UnrecordableError
        If there is none.
    """
    if name == "mitsuba_principled":
        return MitsubaPrincipled()
    if name == "blender_principled":
        return BlenderPrincipledModel(getattr(bsdf, "model", BLENDER_5_0))
    raise UnrecordableError(f"Material model {name!r} has no recorded-path version.")
