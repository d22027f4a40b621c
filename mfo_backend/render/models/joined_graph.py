# SPDX-License-Identifier: Apache-2.0
"""What nodes give the target in several pictures, one behind the other as in one picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from ...types.parameter import Vector
from .graph_pictures import GraphPictures, GraphState


class JoinedGraph:
    """As `GraphPictures`, of several pictures: the rows of the second one follow those of the first, and so on.

    Each picture's last row is its mean. They are the same values, seen by other cameras.
    """

    def __init__(self, graphs: Sequence[GraphPictures]) -> None:
        self._graphs = tuple(graphs)
        self.table, self.varying, self.scanned = graphs[0].table, graphs[0].varying, graphs[0].scanned
        self._last: tuple[list[GraphState], GraphState] | None = None

    def state(self, vector: Vector) -> GraphState:
        """Pictures and derivatives."""
        parts = [graph.state(vector) for graph in self._graphs]
        if self._last is None or any(a is not b for a, b in zip(parts, self._last[0], strict=True)):
            self._last = parts, self._joined(parts)
        return self._last[1]

    def settle(self, vector: Vector) -> None:
        """See `GraphPictures.settle`."""
        for graph in self._graphs:
            graph.settle(vector)

    def _joined(self, parts: Sequence[GraphState]) -> GraphState:
        return GraphState(
            {name: np.concatenate([part.pictures[name] for part in parts]) for name in self.varying},
            {
                name: {j: np.concatenate([part.slopes[name][j] for part in parts]) for j in components}
                for name, components in self.varying.items()
            },
        )

    def coarser(self, state: GraphState) -> GraphState:
        """See `GraphPictures.coarser`; of the state that was asked for last."""
        assert self._last is not None
        assert self._last[1] is state
        return self._joined([graph.coarser(part) for graph, part in zip(self._graphs, self._last[0], strict=True)])

    def plain(self, vectors: Sequence[Vector]) -> list[Mapping[str, NDArray[np.float32]]]:
        """Pictures alone."""
        found = zip(*(graph.plain(vectors) for graph in self._graphs), strict=True)
        return [{name: np.concatenate([part[name] for part in parts]) for name in self.varying} for parts in found]

    def begins(self, vector: Vector) -> list[int]:
        """The first row of each picture."""
        rows = [len(next(iter(graph.state(vector).pictures.values()))) for graph in self._graphs]
        return [sum(rows[:number]) for number in range(len(rows))]


Graph: TypeAlias = GraphPictures | JoinedGraph
