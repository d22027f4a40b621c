# SPDX-License-Identifier: Apache-2.0
"""What is said of the values that nodes give a job's target."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from mfo_backend.job.run.job_scene import MOST_NAMED, graph_notes
from mfo_backend.types.verdict import Verdict

STAYED = tuple(f"Noise Texture/{number}" for number in range(MOST_NAMED + 2))


def notes(verdict: Verdict | None, stayed: tuple[str, ...]) -> tuple[str, ...]:
    material = SimpleNamespace(all_sockets=(("Roughness", SimpleNamespace(graph="graph/socket_00.npy")),))
    request: Any = SimpleNamespace(
        materials={"target_bsdf": material}, target=SimpleNamespace(bsdf_id="target_bsdf"),
        graph=SimpleNamespace(held=stayed, depths=1),
    )  # fmt: skip
    judgement = None if verdict is None else SimpleNamespace(verdict=verdict)
    result: Any = SimpleNamespace(model="blender_principled", notes=(), judgement=judgement)
    return graph_notes(request, result)


@pytest.mark.parametrize("verdict", [Verdict.CLOSE, Verdict.DIFFERENT])
def test_values_that_stayed_are_named_where_the_result_is_not_the_same(verdict: Verdict) -> None:
    (said,) = notes(verdict, STAYED[:2])
    assert "(Noise Texture/0, Noise Texture/1)" in said
    (said,) = notes(verdict, STAYED)
    assert said.count("Noise Texture") == MOST_NAMED
    assert ", ...)" in said


def test_nothing_is_said_where_it_is_the_same_or_nothing_stayed() -> None:
    assert notes(Verdict.SAME, STAYED) == notes(None, STAYED) == notes(Verdict.DIFFERENT, ()) == ()
