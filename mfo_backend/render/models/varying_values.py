# SPDX-License-Identifier: Apache-2.0
"""What a graph gives recorded lanes for free values inside it: values and normals by subpixel, with their slopes."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false, reportAssignmentType=false
# pyright: reportReturnType=false, reportIndexIssue=false, reportGeneralTypeIssues=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...material.arrays.dual import Dual
from ...material.arrays.own_memory import own_memory
from ...material.plugins.seen_surface import SeenSurface
from ...material.principled.bumped_normals import turned_to_normals
from ...material.principled.principled_dict import DIRECTIONS
from ...types.parameter import ParameterTable
from .graph_pictures import GraphPictures, GraphState
from .joined_graph import Graph

SUBPIXEL = "subpixel"  # of each lane, in the pictures; the row behind the last where the camera does not see the hit
FRAME = ("frame_s", "frame_t", "frame_n")  # the lane's frame in the world
SHAPE = ("geometric_normal", "smooth_normal", "own_tangent")  # of the mesh, in that frame


class VaryingValues:
    """The parameters and directions that free values of a graph change, where kernels need them.

    `table` is that of the fit: its last entries are the graph's.
    """

    def __init__(self, graph: Graph, table: ParameterTable, sizes: ParameterTable) -> None:
        self._graph = graph
        self.first = table.length - graph.table.length
        self.names = tuple(graph.varying)
        self._kinds = {
            name: mi.Vector3f if name in DIRECTIONS.values() else mi.Color3f if sizes[name].size == 3 else mi.Float
            for name in self.names
        }
        self.turns = any(name in DIRECTIONS.values() for name in self.names)
        # what a recording keeps of each lane
        self.lanes = (SUBPIXEL, *FRAME, *SHAPE) if self.turns else (SUBPIXEL,)
        self._surface: SeenSurface | None = None
        self._last: tuple[GraphState, tuple[Any, ...]] | None = None

    def surface(self, vector: NDArray[np.float64]) -> SeenSurface:
        """Where the subpixels of the pictures are; those around this vector are exact from now on."""
        assert isinstance(self._graph, GraphPictures)  # of one camera
        self._graph.settle(vector[self.first :])
        if self._surface is None:
            self._surface = SeenSurface(*self._graph.seen(vector[self.first :]))
        return self._surface

    def plain_arrays(self, pictures: Mapping[str, NDArray[np.float32]]) -> tuple[Any, ...]:
        """Flat pictures without slopes, in the order in which kernels read them."""
        flat = tuple(own_memory(pictures[name], mi.Float) for name in self.names)
        dr.eval(flat)
        return flat

    def arrays(self, vector: NDArray[np.float64], *, derivatives: bool) -> tuple[Any, ...]:
        """The pictures at a vector, each followed by those of its slopes if there are to be derivatives."""
        state = self._graph.state(vector[self.first :])
        if not derivatives:
            return self.plain_arrays(state.pictures)
        if self._last is None or self._last[0] is not state:
            self._last = state, self._with_slopes(state)
        return self._last[1]

    def coarser_arrays(self, vector: NDArray[np.float64]) -> tuple[Any, ...]:
        """The same with derivatives, as of pictures of half the fineness."""
        return self._with_slopes(self._graph.coarser(self._graph.state(vector[self.first :])))

    def _with_slopes(self, state: GraphState) -> tuple[Any, ...]:
        flat = []
        for name, components in self._graph.varying.items():
            flat.append(own_memory(state.pictures[name], mi.Float))
            flat += [own_memory(state.slopes[name][j], mi.Float) for j in components]
        dr.eval(flat)
        return tuple(flat)

    def sample(self, *, derivatives: bool) -> tuple[tuple[Any, ...], list[Any]]:
        """Stand-ins for pictures and for a lane, to trace a kernel that is never run."""
        one = dr.opaque(mi.Float, 0.5, 3)
        counts = (1 + len(components) * derivatives for components in self._graph.varying.values())
        pictures = tuple(one for count in counts for _ in range(count))
        up = dr.opaque(mi.Vector3f, (0.0, 0.0, 1.0))
        return pictures, [dr.opaque(mi.UInt32, 0), *([up] * (len(self.lanes) - 1))]

    def read(
        self, pictures: tuple[Any, ...], lane: list[Any], wi: Any, wo: Any, *, derivatives: bool
    ) -> tuple[dict[str, Any], Any, Any]:
        """Parameters and normals of a lane by name, and the directions in the frame that these make."""
        index, rest = lane[0], iter(pictures)
        values: dict[str, Any] = {}
        for name, components in self._graph.varying.items():
            kind, components = self._kinds[name], components if derivatives else ()
            value, *slopes = (dr.gather(kind, next(rest), index) for _ in range(1 + len(components)))
            moving = {self.first + j: slope for j, slope in zip(components, slopes, strict=True)}
            values[name] = Dual(value, moving) if derivatives else value
        if not self.turns:
            return values, wi, wo
        *axes, geometric, smooth, tangent = [Dual(v) for v in lane[1:]] if derivatives else lane[1:]
        given = {name: values.pop(name) for name in self.names if name in DIRECTIONS.values()}
        wi, wo, normals = turned_to_normals(given, axes, geometric, smooth, tangent, wi, wo)
        return values | normals, wi, wo
