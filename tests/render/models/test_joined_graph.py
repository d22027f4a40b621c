# SPDX-License-Identifier: Apache-2.0
"""What nodes give several pictures is one behind the other, each with the row of its mean."""

from __future__ import annotations

import numpy as np

from mfo_backend.render.models.joined_graph import JoinedGraph

from .test_graph_pictures import Nodes, graph


class Fewer(Nodes):
    """The same nodes seen by a camera with two rows less."""

    def __call__(self, variants, *, scale, samples, elsewhere=False):
        found = super().__call__(variants, scale=scale, samples=samples, elsewhere=elsewhere)
        pictures = [{name: picture[2:] for name, picture in known.items()} for known in found.pictures]
        return type(found)(pictures, found.positions[2:], found.camera)


def test_rows_of_two_pictures() -> None:
    parts = graph(Nodes()), graph(Fewer())
    joined = JoinedGraph(parts)
    assert (joined.table, joined.varying, joined.scanned) == (parts[0].table, parts[0].varying, ())
    for vector in (np.array([0.2, 0.3, 0.9, 2.0]), np.array([0.7, 0.3, 0.4, 1.0])):
        state = joined.state(vector)
        assert joined.state(vector) is state
        assert joined.begins(vector) == [0, 49]
        for part, rows in zip(parts, (slice(0, 49), slice(49, 82)), strict=True):
            own = part.state(vector)
            np.testing.assert_array_equal(state.pictures["base_color"][rows], own.pictures["base_color"])
            np.testing.assert_array_equal(state.slopes["roughness"][3][rows], own.slopes["roughness"][3])
            coarse = part.coarser(own).pictures["base_color"]
            np.testing.assert_array_equal(joined.coarser(state).pictures["base_color"][rows], coarse)
            (plain,) = part.plain([vector])
            np.testing.assert_array_equal(joined.plain([vector])[0]["roughness"][rows], plain["roughness"])


def test_settling_evaluates_the_nodes_for_each_picture() -> None:
    nodes, fewer = Nodes(), Fewer()
    joined = JoinedGraph((graph(nodes), graph(fewer)))
    joined.settle(np.array([0.2, 0.3, 0.9, 2.0]))
    assert (len(nodes.variants), len(fewer.variants)) == (1, 1)
