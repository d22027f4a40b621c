# SPDX-License-Identifier: Apache-2.0
"""What a node clips is not determined beyond it, however steep the picture is on this side."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mfo_backend.fit.recorded.keep_user_values import Kept
from mfo_backend.fit.recorded.plateaus import ONE_SIDED, with_plateaus
from mfo_backend.render.paths.recorded_image import TwoSamples
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.parameter import Parameter, ParameterTable

GRAPH = ParameterTable([Parameter("HSV/Saturation", 1, 0.0, 2.0, 1.0), Parameter("Mix/Color", 3, 0.0, 1.0, (0.5,) * 3)])
TABLE = ParameterTable([Parameter("roughness", 1, 0.0, 1.0, 0.5), *GRAPH])
SURE = 0.01  # deviation of every value by its slopes
PLACES = np.linspace(0.2, 1.0, 40)[:, None]


class Fake:
    """A fit that ended at `x`: a picture of a colour, brighter by a saturation that is clipped at 1.33."""

    def __init__(self, x: np.ndarray, stopped: bool = False) -> None:
        self.asked: list[int] = []
        graph = SimpleNamespace(table=GRAPH, plain=self.pictures)
        scene = SimpleNamespace(graph=graph, images_of=lambda paths, groups, vector: lambda picture: picture["shown"])
        setting = SimpleNamespace(
            scene=scene, table=TABLE, sampled=True, course=SimpleNamespace(should_stop=lambda: stopped)
        )
        problem = SimpleNamespace(
            groups=None,
            evaluate=SimpleNamespace(samples=self.samples),
            residual=lambda image: (image, np.ones_like(image)),
        )
        refined = SimpleNamespace(all=problem, rivals=())
        self.end: Any = SimpleNamespace(recording=SimpleNamespace(setting=setting, paths=None), refined=refined)
        sure = {p.name: Certainty((SURE,) * p.size, Level.DETERMINED) for p in TABLE}
        self.kept = Kept(x, (), sure, np.zeros((TABLE.length,) * 2), ("before",))

    def pictures(self, vectors: list[np.ndarray]) -> list[dict[str, np.ndarray]]:
        self.asked.append(len(vectors))
        return [{"shown": PLACES * min(v[0], 1.33) + v[1:]} for v in vectors]

    def samples(self, x: np.ndarray) -> TwoSamples:
        rows = np.zeros((len(PLACES), 3, 1 + TABLE.length), np.float32)
        rows[:, :, 0] = self.pictures([x[1:]])[0]["shown"]
        rows[:, :, 2] = PLACES  # as below the plateau
        for k in range(3):
            rows[:, k, 3 + k] = 1.0
        return TwoSamples(rows, None)


def test_a_value_before_a_plateau_is_weak_and_said() -> None:
    x = TABLE.pack({"HSV/Saturation": 1.32})
    found = with_plateaus(Fake(x).end, Fake(x).kept)
    assert found.certainty["HSV/Saturation"].level is Level.WEAK
    # of a move by 0.12 upward 0.01 changes the picture: the deviation is twelve times that of an even change
    assert found.certainty["HSV/Saturation"].sd == pytest.approx((12 * SURE,), rel=1e-3)
    assert {found.certainty[name].level for name in ("roughness", "Mix/Color")} == {Level.DETERMINED}
    assert found.notes == ("before", ONE_SIDED.format(names="HSV/Saturation"))


def test_a_value_far_from_it_stays_determined() -> None:
    x = TABLE.pack({"HSV/Saturation": 1.1})
    fake = Fake(x)
    assert with_plateaus(fake.end, fake.kept) == fake.kept
    assert fake.asked[0] == 1 + 2 * 4  # all in one


def test_nothing_is_asked_without_need() -> None:
    x = TABLE.pack({"HSV/Saturation": 1.32})
    stopped = Fake(x, stopped=True)
    assert with_plateaus(stopped.end, stopped.kept) is stopped.kept
    weak = Fake(x)
    for name in GRAPH.names:
        weak.kept.certainty[name] = Certainty((0.1,) * GRAPH[name].size, Level.WEAK)
    assert with_plateaus(weak.end, weak.kept) is weak.kept
    assert weak.asked == stopped.asked == []
