# SPDX-License-Identifier: Apache-2.0
"""Every graph of the study is one that an export takes, and leaves something to fit."""

from __future__ import annotations

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.findings import Findings  # noqa: E402
from blender_addon.export.materials.node_graph import names_by_graph  # noqa: E402
from blender_addon.export.materials.read_material import read_target  # noqa: E402
from blender_addon.export.nodes.displacement import bends_normals, moves_faces  # noqa: E402
from studies.graphs.bumps import BUMPS  # noqa: E402
from studies.graphs.materials import GRAPHS  # noqa: E402
from studies.graphs.measure import build_scene  # noqa: E402
from studies.graphs.values import FITTED, SOCKETS, Drawn  # noqa: E402


@pytest.mark.parametrize("graph", [*GRAPHS, *BUMPS])
def test_a_graph_holds_some_sockets_and_leaves_others(graph: str) -> None:
    target, node = build_scene(graph, "lamp", 16)
    findings = Findings()
    material = read_target(target.active_material, target.name, 0, findings)
    assert material is not None
    assert findings.errors == []
    held = names_by_graph(material)
    bent = ["Shading Normal"] if bends_normals(target.active_material) else []
    assert held == [socket.name for socket in node.inputs if socket.is_linked] + bent
    assert held or moves_faces(target.active_material)
    assert set(SOCKETS) - set(held)


@pytest.mark.parametrize("graph", FITTED)
def test_the_values_that_are_sought_are_there(graph: str) -> None:
    """And what is put is what is read, with no error."""
    import random

    target, node = build_scene(graph, "lamp", 16)
    drawn = Drawn(target, node, FITTED[graph])
    truth = drawn.draw(random.Random(1))
    start = drawn.draw(random.Random(2), near=truth)
    drawn.put(start)
    assert max(drawn.errors(truth).values()) > 0.05
    drawn.put(truth)
    assert max(drawn.errors(truth).values()) < 1e-6
    assert set(truth) == set(FITTED[graph])
    assert 4 <= sum(len(value) if isinstance(value, tuple) else 1 for value in truth.values()) <= 9
