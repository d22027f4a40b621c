# SPDX-License-Identifier: Apache-2.0
"""The materials of a scene by kind: those that differ in their values alone are traced once.

Dr.Jit traces a virtual call in Python for every material that there is, reached or not, and only then sees that most of
them are the same code: with 20 plain materials that was half of the time of a queue, and more with 50
(docs/notebook/several_materials.md). Here one of each kind is traced, with values read from a table. Choose the variant
before importing this.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..arrays.own_memory import own_memory


class MaterialKinds:
    """Evaluates and samples whatever material a surface point has, without derivatives."""

    def __init__(self, scene: mi.Scene) -> None:
        kinds: dict[Hashable, list[Any]] = {}
        for number, material in _materials(scene).items():
            kinds.setdefault(getattr(material, "kind", None) or number, []).append(material)
        self._alike = any(len(kind) > 1 for kind in kinds.values())
        if not self._alike:  # nothing to gain, and virtual calls have the kernels that they had
            return
        self._kinds = [_Kind(materials) for materials in kinds.values()]
        self._kind_of, self._row_of = _tables(list(kinds.values()))

    def eval_pdf(
        self, bsdf: mi.BSDFPtr, context: mi.BSDFContext, si: mi.SurfaceInteraction3f, wo: mi.Vector3f, active: mi.Bool
    ) -> tuple[mi.Color3f, mi.Float]:
        """See `mi.BSDF.eval_pdf`."""
        if not self._alike:
            return bsdf.eval_pdf(context, si, wo, active)

        def of(kind: _Kind) -> Any:
            return lambda row, si, wo, active: kind.first.eval_pdf(context, si, wo, active, **kind.values(row, active))

        return self._called([of(kind) for kind in self._kinds], bsdf, active, si, wo)

    def sample(
        self,
        bsdf: mi.BSDFPtr,
        context: mi.BSDFContext,
        si: mi.SurfaceInteraction3f,
        u1: mi.Float,
        u2: mi.Point2f,
        active: mi.Bool,
    ) -> tuple[mi.BSDFSample3f, mi.Color3f]:
        """See `mi.BSDF.sample`."""
        if not self._alike:
            return bsdf.sample(context, si, u1, u2, active)

        def of(kind: _Kind) -> Any:
            return lambda row, si, u1, u2, active: kind.first.sample(
                context, si, u1, u2, active, **kind.values(row, active)
            )

        return self._called([of(kind) for kind in self._kinds], bsdf, active, si, u1, u2)

    def _called(self, of_kinds: list[Any], bsdf: mi.BSDFPtr, active: mi.Bool, *arguments: Any) -> Any:
        number = dr.reinterpret_array(mi.UInt32, bsdf)
        active = mi.Bool(active) & (number != 0)  # 0 where there is no surface
        kind, row = (dr.gather(mi.UInt32, table, number, active) for table in (self._kind_of, self._row_of))
        return dr.switch(kind, of_kinds, row, *arguments, active)


class _Kind:
    """Materials that the `first` of them stands for."""

    def __init__(self, materials: list[Any]) -> None:
        self.first = materials[0]
        self._table = None
        if len(materials) > 1:
            self._names = self.first.opened
            self._table = own_memory(np.array([material.row for material in materials]), mi.Float)

    def values(self, row: mi.UInt32, active: mi.Bool) -> dict[str, Any]:
        """The values of the material in a row, by name; empty where there is but one."""
        if self._table is None:
            return {}
        sizes = {name: 3 if isinstance(getattr(self.first, name), mi.Color3f) else 1 for name in self._names}
        place, values = row * sum(sizes.values()), {}
        for name, size in sizes.items():
            entries = [dr.gather(mi.Float, self._table, place + k, active) for k in range(size)]
            values[name] = mi.Color3f(*entries) if size == 3 else entries[0]
            place += size
        return values


def _materials(scene: mi.Scene) -> dict[int, Any]:
    """The materials of the shapes, by their numbers in this process."""
    found = (shape.bsdf() for shape in scene.shapes())
    return {_number(material): material for material in found if material is not None}


def _number(material: mi.BSDF) -> int:
    return int(dr.reinterpret_array(mi.UInt32, mi.BSDFPtr(material))[0])


def _tables(kinds: list[list[Any]]) -> list[mi.UInt32]:
    """The number of each material's kind, and its row there, by the number that the material has in this process."""
    places = {_number(m): (kind, row) for kind, members in enumerate(kinds) for row, m in enumerate(members)}
    tables = np.zeros((2, max(places) + 1), np.uint32)
    for number, place in places.items():
        tables[:, number] = place
    return [own_memory(table, mi.UInt32) for table in tables]
