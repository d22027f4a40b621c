# SPDX-License-Identifier: Apache-2.0
"""Pictures of a graph at any values: derivatives by differences, and where nothing has to be evaluated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from mfo_backend.render.models.finer_pictures import Shown
from mfo_backend.render.models.graph_pictures import KEPT_ANSWERS, Evaluated, GraphPictures, Variant
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.node_value import NodeValue

NOISE = np.random.default_rng(0).uniform(0.0, 1.0, (6, 8, 1)).astype(np.float32)


def value(name: str, start: float | tuple[float, ...], sockets: tuple[str, ...], upper: float = 1.0) -> NodeValue:
    return NodeValue(name, start, 0.0, upper, False, 0.002 * upper, False, sockets, {})


class Nodes:
    """Base colour: a mix of a colour and grey by noise; roughness: noise to a power."""

    def __init__(self) -> None:
        self.variants: list[int] = []

    def __call__(self, variants: Sequence[Variant], *, scale: int, samples: int, elsewhere: bool = False) -> Evaluated:
        self.variants.append(len(variants))
        pictures = []
        for (color, power), sockets in variants:
            known = {
                "Base Color": (NOISE * np.array(color) + (1.0 - NOISE) * 0.5).astype(np.float32),
                "Roughness": (NOISE**power).astype(np.float32),
            }
            pictures.append({name: known[name] for name in sockets})
        positions = np.zeros((*NOISE.shape[:2], 3), np.float32)
        positions[0] = np.nan  # the first row is beside the target
        return Evaluated(pictures, positions, np.zeros((3, 4)))


def graph(nodes: Nodes) -> GraphPictures:
    values = (value("Mix/A", (0.2, 0.3, 0.4), ("Base Color",)), value("Math/Value", 1.5, ("Roughness",), 3.0))
    return GraphPictures(values, nodes, ("Base Color", "Roughness", "Metallic"))


def test_pictures_and_derivatives() -> None:
    nodes = Nodes()
    pictures = graph(nodes)
    assert pictures.table.names == ("Mix/A", "Math/Value")
    assert pictures.varying == {"base_color": (0, 1, 2), "roughness": (3,)}
    state = pictures.state(np.array([0.2, 0.3, 1.0, 2.0]))
    assert nodes.variants == [5]  # the last component is at no bound, the third is: its difference goes back
    noise = NOISE.reshape(-1, 1)
    for channel in range(3):
        wanted = np.zeros((48, 3))
        wanted[:, channel] = noise[:, 0]
        np.testing.assert_allclose(state.slopes["base_color"][channel][:-1], wanted, atol=1e-3)
    np.testing.assert_allclose(state.pictures["roughness"][:-1], noise**2, rtol=1e-6)
    np.testing.assert_allclose(state.slopes["roughness"][3][:-1], np.log(noise) * noise**2, atol=3e-3)
    # the last row stands for hits that the camera does not see
    np.testing.assert_allclose(state.pictures["roughness"][-1], (NOISE[1:] ** 2).mean(), rtol=1e-5)


def test_what_a_scene_shows_has_the_mean_for_what_the_camera_does_not_see() -> None:
    pictures = graph(Nodes())
    assert (pictures.colors_of("base_color"), pictures.colors_of("roughness")) == (("Mix/A",), ())
    shown = pictures.fine(np.array([0.2, 0.3, 1.0, 2.0]))
    assert shown["roughness"].outside == pytest.approx([(NOISE[1:] ** 2).mean()])  # beside the target nothing counts
    wanted = [(NOISE[1:] * color + (1.0 - NOISE[1:]) * 0.5).mean() for color in (0.2, 0.3, 1.0)]
    assert shown["base_color"].outside == pytest.approx(wanted)


def test_a_direction_that_nobody_sees_stays_that_of_the_mesh() -> None:
    def nodes(variants: Sequence[Variant], *, scale: int, samples: int, elsewhere: bool = False) -> Evaluated:
        up = np.broadcast_to(np.array((0.0, 0.0, 1.0), np.float32), (2, 2, 3))
        return Evaluated([{"Normal": up}], np.zeros((2, 2, 3), np.float32), np.zeros((3, 4)))

    pictures = GraphPictures((value("Bump/Strength", 0.5, ("Normal",)),), nodes, ("Normal",))
    assert pictures.fine(np.array([0.5]))["normal"].outside is None


def test_what_is_linear_is_evaluated_twice_and_never_again() -> None:
    nodes = Nodes()
    pictures = graph(nodes)
    for red in (0.1, 0.9, 0.3, 0.7):
        at = np.array([red, 0.5, 0.2, 1.5])
        found = pictures.state(at).pictures["base_color"][:-1]
        np.testing.assert_allclose(found[:, 0], NOISE.ravel() * red + (1.0 - NOISE.ravel()) * 0.5, atol=2e-3)
    assert len(nodes.variants) == 2
    pictures.settle(at)  # but the first of a recording is exact
    assert len(nodes.variants) == 3


def test_what_is_not_linear_is_extrapolated_nearby_alone() -> None:
    nodes = Nodes()
    pictures = graph(nodes)

    def roughness(power: float) -> np.ndarray:
        return pictures.state(np.array([0.5, 0.5, 0.5, power])).pictures["roughness"][:-1]

    roughness(1.0)
    roughness(1.5)
    for power in (1.52, 1.48, 2.5, 0.4, 0.42):
        error = roughness(power) - NOISE.reshape(-1, 1) ** power
        assert np.sqrt(np.mean(error**2)) < 2e-3, power
    assert len(nodes.variants) == 4  # of 7


def test_a_color_is_linear_although_its_slope_changes_with_another_value() -> None:
    """Noise to a power is the share of a colour: where the power stays the pictures are linear."""
    asked = []

    def nodes(variants: Sequence[Variant], *, scale: int, samples: int, elsewhere: bool = False) -> Evaluated:
        asked.append(len(variants))
        pictures = [
            {"Base Color": (NOISE**power * np.array(color)).astype(np.float32)} for (color, power), _ in variants
        ]
        return Evaluated(pictures, np.zeros((*NOISE.shape[:2], 3), np.float32), np.zeros((3, 4)))

    sockets = ("Base Color",)
    values = (value("Mix/A", (0.2, 0.3, 0.4), sockets), value("Math/Value", 1.5, sockets, 3.0))
    pictures = GraphPictures(values, nodes, sockets)
    for color, power in ((0.2, 0.5), (0.4, 2.5), (0.9, 2.5)):  # the third says which of the two it was
        pictures.state(np.array([color, color, color, power]))
    assert len(asked) == 3
    for color in (0.1, 0.6, 1.0):
        found = pictures.state(np.array([color, 0.3, 0.9 * color, 2.5])).pictures["base_color"][:-1]
        np.testing.assert_allclose(found[:, 0], color * NOISE.ravel() ** 2.5, atol=1e-4)
    assert len(asked) == 3
    pictures.state(np.array([0.9, 0.9, 0.9, 2.0]))
    assert len(asked) == 4


def test_coarser_pictures_are_means_of_four_subpixels_where_the_camera_sees_all() -> None:
    pictures = graph(Nodes())
    state = pictures.state(np.array([0.2, 0.3, 0.5, 2.0]))
    coarse = pictures.coarser(state)
    of = [
        (state.pictures["roughness"], coarse.pictures["roughness"]),
        (state.slopes["base_color"][1], coarse.slopes["base_color"][1]),
    ]
    for fine, found in of:
        np.testing.assert_array_equal(found[:16], fine[:16])  # of the first two rows one is beside the target
        np.testing.assert_array_equal(found[-1], fine[-1])
        for row, column in ((2, 0), (2, 6), (4, 4)):
            four = [8 * (row + down) + column + right for down in (0, 1) for right in (0, 1)]
            wanted = np.broadcast_to(np.mean([fine[k] for k in four], axis=0), (4, fine.shape[1]))
            np.testing.assert_allclose(found[four], wanted, rtol=1e-6)


def test_finer_pictures_are_kept_and_change_with_those_of_a_solve() -> None:
    nodes = Nodes()
    pictures = graph(nodes)
    at = np.array([0.5, 0.5, 0.5, 1.0])
    pictures.note(at, {"roughness": Shown(NOISE), "base_color": Shown(np.full((6, 8, 3), 0.5, np.float32))})
    assert pictures.fine(at)["roughness"].picture is NOISE
    assert nodes.variants == []
    far = pictures.fine(at + 0.25)
    np.testing.assert_allclose(far["roughness"].picture, NOISE**1.25, rtol=1e-6)
    assert nodes.variants == [1]
    near = pictures.fine(at + 0.26)
    np.testing.assert_allclose(near["roughness"].picture, NOISE**1.26, atol=2e-3)
    np.testing.assert_allclose(
        near["base_color"].picture, np.repeat(NOISE * 0.76 + (1.0 - NOISE) * 0.5, 3, axis=2), atol=2e-3
    )
    assert nodes.variants == [1, 5, 5]  # the states at both


def test_states_are_kept_as_far_as_memory_goes() -> None:
    """Starts of a fit come back to the same values: those of few slopes are known longer than those of many."""
    nodes = Nodes()
    pictures = graph(nodes)
    powers = np.linspace(0.1, 3.0, 2 * KEPT_ANSWERS)
    for power in (*powers, *powers):
        pictures.state(np.array([0.5, 0.5, 0.5, power]))
    assert len(nodes.variants) <= len(powers)


def test_nodes_that_cannot_be_evaluated_are_known_before_the_fit() -> None:
    def refuses(variants: Sequence[Variant], *, scale: int, samples: int, elsewhere: bool = False) -> Evaluated:
        raise BadInputError("Too many nodes.")

    pictures = GraphPictures((value("Mix/A", 0.5, ("Base Color",)),), refuses, ("Base Color",))
    assert pictures.refusal() == "Too many nodes."
    assert graph(Nodes()).refusal() is None


def test_normals_are_looked_at_more_finely() -> None:
    """In a picture of 200 x 200 pixels; of colours two subpixels along a pixel are enough."""
    asked = []

    def evaluate(variants: Sequence[Variant], *, scale: int, samples: int, elsewhere: bool = False) -> Evaluated:
        asked.append((scale, samples))
        raise BadInputError("Enough.")

    for socket in ("Roughness", "Normal"):
        pictures = GraphPictures([value("Bump/Strength", 0.5, (socket,))], evaluate, (socket,), pixels=200 * 200)
        with pytest.raises(BadInputError):
            pictures.state(np.array([0.5]))
    assert asked == [(2, 1), (4, 1)]
