# SPDX-License-Identifier: Apache-2.0
"""The scale of a pattern is found without its colours, the strength of bumps without those below a coat."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.recorded.scanned_values import KEPT, TRIED_SCALES, TRIED_STRENGTHS, best_scanned, placed
from mfo_backend.types.parameter import Parameter, ParameterTable

PLACES = np.linspace(0.0, 1.0, 500)
LIGHT = (0.3 + 0.7 * np.sin(3.0 * PLACES) ** 2)[:, None]
GRAPH = ParameterTable([Parameter("Noise/Scale", 1, 1.0, 16.0, 4.0), Parameter("Ramp/Stop 0", 3, 0.0, 1.0, (0.5,) * 3)])
TABLE = ParameterTable([Parameter("roughness", 1, 0.0, 1.0, 0.5), *GRAPH])


def pattern(scale: float) -> np.ndarray:
    """Values in [0, 1] that have nothing in common with those of another scale."""
    return (0.5 + 0.5 * np.sin(3.0 * scale * PLACES + np.sin(2.0 * scale * PLACES)))[:, None].astype(np.float32)


def shown(values: np.ndarray, low: Any, high: Any) -> np.ndarray:
    """A dielectric's picture: a gloss, and the light on the colour of each place."""
    return (0.02 + LIGHT * (np.array(low) * (1.0 - values) + np.array(high) * values)).astype(np.float32)


class Fake:
    """Setting and recording of a picture of the pattern at one scale in other colours."""

    def __init__(self, scale: float) -> None:
        self.set_up(shown(pattern(scale), (0.8, 0.1, 0.3), (0.1, 0.6, 0.2)), GRAPH, TABLE)

    def set_up(self, reference: np.ndarray, values: ParameterTable, table: ParameterTable) -> None:
        count = len(PLACES)
        groups = SimpleNamespace(
            average=lambda image: image, lanes_of_groups=np.ones(count, int), take=lambda which: groups, lanes=count,
            pixels=np.arange(count),
        )  # fmt: skip

        def pixel_groups(keep: np.ndarray | None = None) -> Any:
            assert keep is None or keep.any(), "Dr.Jit ends the process where it is asked for no pixel"
            return groups

        paths = SimpleNamespace(
            pixel_groups=pixel_groups, interior=np.ones(count, bool), lanes=count, pixel=groups.pixels
        )
        self.recording: Any = SimpleNamespace(paths=paths, setting=None)
        varying = dict.fromkeys(self.pictures(values.pack({})), (0,))
        plain = lambda vectors: [self.pictures(v) for v in vectors]  # noqa: E731
        graph = SimpleNamespace(scanned=(0,), table=values, varying=varying, plain=plain)
        scene = SimpleNamespace(graph=graph, images_of=lambda paths, groups, vector: partial(self.image, vector))
        course = SimpleNamespace(should_stop=lambda: False)
        self.setting: Any = SimpleNamespace(
            scene=scene, table=table, user=table.pack({}), calm=reference, course=course, plan=RecordedPlan()
        )

    @staticmethod
    def pictures(vector: np.ndarray) -> dict[str, np.ndarray]:
        values = shown(pattern(float(vector[0])), (0.2, 0.2, 0.2), (0.5, 0.5, 0.5))
        return {"base_color": np.concatenate([values, values.mean(axis=0, keepdims=True)])}

    @staticmethod
    def image(_: np.ndarray, pictures: dict[str, np.ndarray]) -> np.ndarray:
        return 0.02 + LIGHT * pictures["base_color"][:-1]


@pytest.mark.parametrize("scale", [3.1, 6.1, 14.0])
def test_a_scale_is_found_in_any_colours(scale: float) -> None:
    fake = Fake(scale)
    found = best_scanned(fake.setting, fake.recording)
    assert len(found) == KEPT
    spacing = 16.0 ** (1.0 / (TRIED_SCALES - 1))
    assert 1.0 / spacing**1.5 < found[0][1] / scale < spacing**1.5
    assert placed(fake.setting.user, found[0])[1] == found[0][1]
    assert fake.setting.user[1] == 4.0


def test_a_scale_is_found_on_what_is_thinner_than_a_pixel() -> None:
    fake = Fake(6.1)
    fake.recording.paths.interior[:] = False
    found = best_scanned(fake.setting, fake.recording)
    assert abs(np.log(found[0][1] / 6.1)) < 1.5 * np.log(16.0) / (TRIED_SCALES - 1)


class Bumped(Fake):
    """The same of bumps at one strength on a coat, whose highlights lie elsewhere at each, on another colour."""

    def __init__(self, strength: float) -> None:
        values = ParameterTable([Parameter("Bump/Strength", 1, 0.0, 1.0, 0.7)])
        table = ParameterTable([Parameter("base_color", 3, 0.0, 1.0, (0.9, 0.9, 0.9)), *values])
        truth = np.array([0.05, 0.1, 0.02, strength])
        self.set_up(self.image(truth, self.pictures(truth[3:])).astype(np.float32), values, table)

    @staticmethod
    def pictures(vector: np.ndarray) -> dict[str, np.ndarray]:
        tilt = vector[0] * np.sin(40.0 * PLACES)[:, None].astype(np.float32)
        return {"coat_normal": np.concatenate([tilt, tilt.mean(axis=0, keepdims=True)])}

    @staticmethod
    def image(vector: np.ndarray, pictures: dict[str, np.ndarray]) -> np.ndarray:
        shine = np.exp(-np.square((PLACES[:, None] - 0.5 + pictures["coat_normal"][:-1]) / 0.03))
        return LIGHT * vector[:3] + 0.1 * shine


@pytest.mark.parametrize("strength", [0.18, 0.52, 0.9])
def test_a_strength_of_bumps_is_found_on_any_colour(strength: float) -> None:
    fake = Bumped(strength)
    found = best_scanned(fake.setting, fake.recording)
    assert abs(found[0][3] - strength) < 1.0 / (TRIED_STRENGTHS - 1)


def test_without_a_scale_nothing_is_tried() -> None:
    fake = Fake(4.0)
    fake.setting.scene.graph = None
    assert best_scanned(fake.setting, fake.recording) == [{}]
