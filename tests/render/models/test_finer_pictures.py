# SPDX-License-Identifier: Apache-2.0
"""Finer pictures that are changed as those of a solve are, and when they are rendered."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.models.finer_pictures import KEPT_FINER, LITTLE, FinerPictures, Shown
from mfo_backend.types.parameter import Vector

RANDOM = np.random.default_rng(0)
NEAR = RANDOM.uniform(0.2, 1.0, (4, 6, 1)).astype(np.float32)  # four subpixels by six, of which the first row sees none
FAR = RANDOM.uniform(0.2, 1.0, (8, 12, 1))  # at twice the fineness
WIDTH = 5.0  # of the range of the power
SEEN = np.ones((4, 6), bool)
SEEN[0] = False
ELSEWHERE = RANDOM.uniform(0.0, 1.0, (6, 3, 1)).astype(np.float32)


def finer(x: float) -> np.ndarray:
    return (NEAR**x).repeat(2, axis=0).repeat(2, axis=1)


class Nodes:
    """A picture to a power, and how often it was asked for; a second value shows on the far side alone."""

    def __init__(self) -> None:
        self.rendered: list[float] = []
        self.flat: list[float] = []
        self.pictures = FinerPictures(self.render, self.look, lambda: SEEN, np.array([WIDTH, 1.0]))

    def render(self, vector: Vector) -> dict[str, Shown]:
        x = float(vector[0])
        self.rendered.append(x)
        picture = np.concatenate([finer(x), 2.0 * float(vector[1]) * FAR**x])
        return {"roughness": Shown(picture, ELSEWHERE, np.array([(NEAR**x)[SEEN].mean()]))}

    def look(self, vector: Vector) -> dict[str, np.ndarray]:
        x = float(vector[0])
        self.flat.append(x)
        picture = (NEAR**x).reshape(-1, 1)
        return {"roughness": np.concatenate([picture, np.array([[(NEAR**x)[SEEN].mean()]], np.float32)])}

    def at(self, x: float, behind: float = 0.5) -> Shown:
        return self.pictures.at(np.array([x, behind]))["roughness"]


def apart(a: float, b: float) -> float:
    return float(np.sqrt(np.mean(np.square(NEAR**a - NEAR**b)[SEEN])))


def test_a_picture_near_a_rendered_one_is_changed_as_the_camera_sees_it() -> None:
    nodes = Nodes()
    first, near = nodes.at(1.0), nodes.at(1.02)
    assert apart(1.0, 1.02) < LITTLE
    assert nodes.rendered == [1.0]
    np.testing.assert_allclose(near.picture[:8], finer(1.02), atol=1e-6)
    np.testing.assert_array_equal(near.picture[8:], FAR)  # the far side is that of the rendered one
    assert near.elsewhere is ELSEWHERE
    assert near.outside == pytest.approx([(NEAR**1.02)[SEEN].mean()], abs=1e-6)
    np.testing.assert_array_equal(first.picture[:8], finer(1.0))  # which it left alone


def test_a_picture_far_from_all_rendered_ones_is_rendered() -> None:
    nodes = Nodes()
    for x in (1.0, 1.5, 1.51, 1.01, 1.5):
        nodes.at(x)
    assert apart(1.0, 1.5) > LITTLE
    assert nodes.rendered == [1.0, 1.5]


def test_small_changes_do_not_add_up() -> None:
    """Each is told from a rendered picture, never from one that was changed."""
    nodes = Nodes()
    steps = [1.0 + 0.03 * k for k in range(10)]
    for x in steps:
        nodes.at(x)
    wanted = [1.0]
    for x in steps:
        if apart(x, min(wanted, key=lambda known: apart(x, known))) > LITTLE:
            wanted.append(x)
    assert nodes.rendered == wanted
    assert len(wanted) == 4


def test_the_nearest_rendered_picture_is_changed() -> None:
    nodes = Nodes()
    nodes.at(1.0)
    nodes.at(1.1)
    np.testing.assert_array_equal(nodes.at(1.056).picture[8:], FAR**1.1)
    np.testing.assert_array_equal(nodes.at(1.044).picture[8:], FAR)
    assert len(nodes.rendered) == 2


def test_what_the_camera_does_not_see_counts_by_its_value() -> None:
    nodes = Nodes()
    first = nodes.at(1.0)
    assert nodes.at(1.0, 0.5 + 0.9 * LITTLE).picture.tolist() == first.picture.tolist()
    assert len(nodes.rendered) == 1
    np.testing.assert_array_equal(nodes.at(1.0, 0.9).picture[8:], 1.8 * FAR)
    assert len(nodes.rendered) == 2


def test_what_is_asked_again_is_neither_rendered_nor_looked_at() -> None:
    nodes = Nodes()
    shown = [nodes.at(1.0 + k) for k in range(KEPT_FINER)]
    asked = len(nodes.flat)
    assert [nodes.at(1.0 + k) for k in range(KEPT_FINER)] == shown
    assert (len(nodes.rendered), len(nodes.flat)) == (KEPT_FINER, asked)


def test_pictures_that_are_coarser_than_those_of_a_solve_are_rendered() -> None:
    nodes = Nodes()
    coarse = Shown(np.ones((4, 3, 1), np.float32))
    nodes.pictures.note(np.array([1.0, 0.5]), {"roughness": coarse})
    assert nodes.at(1.0) is coarse
    nodes.at(1.001)
    assert nodes.rendered == [1.001]


def test_what_was_asked_last_is_kept() -> None:
    nodes = Nodes()
    for x in (*range(1, 1 + KEPT_FINER), 1, 1 + KEPT_FINER):  # the last one takes the place of the second
        nodes.at(float(x))
    nodes.at(1.0)
    assert nodes.rendered == [1.0 + k for k in range(KEPT_FINER + 1)]
