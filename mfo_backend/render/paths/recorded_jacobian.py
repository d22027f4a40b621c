# SPDX-License-Identifier: Apache-2.0
"""Pixels and their derivatives by all free values, or pixels alone, from recorded paths, in one kernel."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.dual import Dual, cast
from ...material.arrays.own_memory import own_memory
from ...material.recorded_models import RecordedModel
from ...types.parameter import ParameterTable, Value
from ..models.varying_values import VaryingValues
from .packed_lanes import Lanes
from .recorded_paths import LaneGroups


@contextmanager
def _no_garbage_collection() -> Iterator[None]:
    """Keep Python from freeing NumPy-backed arrays: Dr.Jit 1.5.0 aborts if that happens while it records a launch."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


class RecordedJacobian:
    """The image of recorded paths as a function of a material's free values.

    Parameters
    ----------
    model
        The material.
    free
        The values that vary.
    fixed
        All other values. One that is exactly 0 leaves its lobe out of the kernel; others enter as data, so that a new
        value needs no new kernel. None is a texture's, which the recording holds for each lane.
    varying
        Those of them that a graph gives, by the last entries of `free`.
    derivatives
        Without them K is 0: a kernel of its own, which takes half the time.

    Notes
    -----
    A lane of the kernel is a pixel or tile. It walks over its recorded lanes, evaluates the material and pushes one
    unit tangent after the other through the same tape (forward mode), so 3 (1 + K) sums are all that leaves the kernel.
    Sums run in a fixed order: the result is deterministic. The launch is recorded once (`dr.freeze`) and replayed; the
    output is an argument because a frozen function would keep the size it had at the recording.
    """

    def __init__(
        self,
        model: RecordedModel,
        free: ParameterTable,
        fixed: Mapping[str, Value | None],
        *,
        varying: VaryingValues | None = None,
        derivatives: bool = True,
    ) -> None:
        self.model = model
        self.table = free
        self._sockets = ParameterTable(p for p in free if p.name in model.table.names)
        self._varying = varying
        self._derivatives = derivatives
        self.width = 1 + free.length * derivatives
        values = {name: value for name, value in fixed.items() if name not in free.names}
        self._absent = [name for name, value in values.items() if value == 0.0]
        tables = (model.table, model.normals, model.walks)
        given = () if varying is None else (*varying.names, *(model.normals.names if varying.turns else ()))
        held = [name for name, value in values.items() if value is None and name not in given]
        self._held = [table[name] for table in tables for name in table.names if name in held]
        self._fixed_table = [model.table[n] for n, value in values.items() if value is not None and value != 0.0]
        constants = [np.atleast_1d(np.asarray(values[p.name], np.float32)) for p in self._fixed_table]
        self._constants = own_memory(np.concatenate([*constants, np.ones(1, np.float32)]), mi.Float)
        dr.eval(self._constants)
        self._evaluate = model.bind(values, self._sockets.names)
        self._warm_up()
        self.evaluations = 0
        # a recording is made anew when the relation of the array sizes changes; that is rare and no cause for a warning
        frozen = dr.freeze(auto_opaque=False, warn_after=1000, state_fn=lambda *_: model.buffers())
        self._launch = frozen(self._kernel)

    @property
    def held(self) -> tuple[str, ...]:
        """Names of the values that lanes hold."""
        return tuple(p.name for p in self._held)

    def __call__(
        self,
        vector: NDArray[np.float64],
        lanes: Lanes,
        groups: LaneGroups,
        pictures: tuple[Any, ...] | None = None,
        growth: tuple[Any, ...] = (),
    ) -> NDArray[np.float32]:
        """Mean radiance of the groups, whose `lanes` these are, without the constant part, then its derivatives:
        (samples, g, 3, 1 + K). `pictures` may stand in for those that a graph gives at the vector, and `growth` says by
        what light that returns to the target has grown, which is then the last of the lanes' arrays."""
        width = self.width
        theta = own_memory(vector, mi.Float)
        if pictures is None:
            varying = self._varying
            pictures = () if varying is None else varying.arrays(vector, derivatives=self._derivatives)
        *_, scale = groups.parts
        out = dr.zeros(mi.Float, dr.width(scale) * 3 * width)
        dr.eval(theta, out)
        # not the dataclass: Dr.Jit would run Python to look into it, which may let another thread go on, and that one
        # waits for a lock which this one holds
        with _no_garbage_collection():
            places = (lanes.start, lanes.stop, lanes.step)
            self._launch(theta, self._constants, pictures, lanes.arrays, growth, *places, scale, out)
        self.evaluations += 1
        return groups.add_parts(out.numpy().reshape(-1, 3, width))

    def _kernel(self, theta, constants, pictures, arrays, growth, start, stop, step, scale, out):
        width = self.width
        factors = self._factors(growth[0]) if growth else []

        def body(lane, stop, sums):
            wi, wo, weight, *held = (dr.gather(type(array), array, lane) for array in arrays)
            if growth:
                *held, returned = held
                weight = self._grown(weight, returned, factors)
            columns = self._columns(theta, constants, pictures, wi, wo, weight, held)
            return (
                lane + step,
                stop,
                [s + c[k] for k in range(3) for s, c in zip(sums[k * width :], columns, strict=False)],
            )

        sums = [mi.Float(0.0) for _ in range(3 * width)]
        _, _, sums = dr.while_loop(
            (mi.UInt32(start), mi.UInt32(stop), sums),
            lambda lane, stop, sums: lane < stop,
            body,
            label="recorded paths",
        )
        row = dr.arange(mi.UInt32, dr.width(scale)) * (3 * width)
        for column, total in enumerate(sums):
            dr.scatter(out, total * scale, row + column, mode=dr.ReduceMode.Permute)

    def _columns(self, theta, constants, pictures, wi, wo, weight, held) -> list[mi.Color3f]:
        """The weighted BSDF value and its derivative by each free value."""
        free, fixed = self._numbers(theta, constants)
        held, lane = held[: len(self._held)], held[len(self._held) :]
        if self._derivatives:
            free = [Dual(value, {k: mi.Float(1.0)}) for k, value in enumerate(free)]
            fixed, held, (wi, wo) = ([Dual(array) for array in arrays] for arrays in (fixed, held, (wi, wo)))
        parameters = self._parameters(free, fixed, held)
        if self._varying is not None:
            given, wi, wo = self._varying.read(pictures, lane, wi, wo, derivatives=self._derivatives)
            parameters |= given
        result = self._evaluate(parameters, wi, wo) * weight
        if not self._derivatives:
            return [mi.Color3f(result)]
        return [mi.Color3f(c) for c in (result.value, *(result.slopes.get(k, 0.0) for k in range(self.table.length)))]

    def _factors(self, growth) -> list[mi.Color3f]:
        """By how much light that returns has grown, and the derivatives of that."""
        return [
            mi.Color3f(*(dr.gather(mi.Float, growth, mi.UInt32(channel * self.width + k)) for channel in range(3)))
            for k in range(self.width)
        ]

    def _grown(self, weight, returned, factors):
        """The weight of a lane with light that returns and has grown."""
        weight = weight + returned * (factors[0] - 1.0)
        if not self._derivatives:
            return weight
        return Dual(weight, {k: returned * slope for k, slope in enumerate(factors[1:])})

    def _warm_up(self) -> None:
        """Let the model load its tables: a frozen launch cannot.

        Numbers are data here as they are there: a table's place that the compiler knows is looked up in another table.
        """
        theta = own_memory(self.table.pack({}), mi.Float)
        up = dr.opaque(mi.Vector3f, (0.0, 0.0, 1.0))
        kinds = dict.fromkeys(self.model.normals.names, mi.Vector3f)
        some = [dr.opaque(kinds.get(p.name, mi.Color3f if p.size == 3 else mi.Float), 0.5) for p in self._held]
        pictures, lane = ((), []) if self._varying is None else self._varying.sample(derivatives=self._derivatives)
        # traced, never run
        self._columns(theta, self._constants, pictures, up, up, dr.opaque(mi.Color3f, 1.0), [*some, *lane])

    def _numbers(self, theta, constants) -> tuple[list[Any], list[Any]]:
        """The components of all free values and of all fixed ones that are data."""
        counts = (self._sockets.length, sum(p.size for p in self._fixed_table))
        free, fixed = (
            [dr.gather(mi.Float, array, mi.UInt32(k)) for k in range(count)]
            for array, count in zip((theta, constants), counts, strict=True)
        )
        return free, fixed

    def _parameters(self, free: list[Any], fixed: list[Any], held: list[Any]) -> dict[str, Any]:
        parameters: dict[str, Any] = dict.fromkeys(self._absent, 0.0)
        parameters |= {p.name: value for p, value in zip(self._held, held, strict=True)}
        for table, entries in ((self._sockets, iter(free)), (self._fixed_table, iter(fixed))):
            for p in table:
                components = [next(entries) for _ in range(p.size)]
                parameters[p.name] = components[0] if p.size == 1 else cast(mi.Color3f, *components)
        return parameters
