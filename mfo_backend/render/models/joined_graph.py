# SPDX-License-Identifier: Apache-2.0
"""What nodes give the target in several pictures, one behind the other as in one picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ...types.parameter import ParameterTable, Vector
from .graph_pictures import GraphPictures, GraphState


class Graph(Protocol):
    """Flat pictures of a graph's sockets for any values inside it; see `GraphPictures`."""

    @property
    def table(self) -> ParameterTable:
        """The values."""
        ...

    @property
    def varying(self) -> Mapping[str, tuple[int, ...]]:
        """What they change, with the components that each changes with."""
        ...

    @property
    def scanned(self) -> tuple[int, ...]:
        """Entries of the vector that have many minima."""
        ...

    def state(self, vector: Vector) -> GraphState:
        """Pictures and derivatives."""
        ...

    def plain(self, vectors: Sequence[Vector]) -> list[Mapping[str, NDArray[np.float32]]]:
        """Pictures alone."""
        ...


class JoinedGraph:
    """The `Graph` of several pictures: the rows of the second one follow those of the first, and so on.

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
            self._last = (
                parts,
                GraphState(
                    {name: np.concatenate([part.pictures[name] for part in parts]) for name in self.varying},
                    {
                        name: {j: np.concatenate([part.slopes[name][j] for part in parts]) for j in components}
                        for name, components in self.varying.items()
                    },
                ),
            )
        return self._last[1]

    def plain(self, vectors: Sequence[Vector]) -> list[Mapping[str, NDArray[np.float32]]]:
        """Pictures alone."""
        found = zip(*(graph.plain(vectors) for graph in self._graphs), strict=True)
        return [{name: np.concatenate([part[name] for part in parts]) for name in self.varying} for parts in found]

    def begins(self, vector: Vector) -> list[int]:
        """The first row of each picture."""
        rows = [len(next(iter(graph.state(vector).pictures.values()))) for graph in self._graphs]
        return [sum(rows[:number]) for number in range(len(rows))]
