# SPDX-License-Identifier: Apache-2.0
"""How sure a difference of chi squared is; oracle: its scatter over many pictures of one truth."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.alike.compare import compare, rival_notes
from mfo_backend.fit.squares.problem import Rival
from mfo_backend.render.paths.recorded_image import TwoSamples
from mfo_backend.solve.bounded_least_squares import NormalEquations
from mfo_backend.types.parameter import Parameter, ParameterTable

TILES = 1200
PICTURES = 200


def picture(rng, truth, materials, *, structure=0.0, own=0.0):
    """A problem with unit noise in each tile; its `structure` is noise that the channels share."""
    noise = rng.normal(size=(TILES, 3)) + structure * rng.normal(size=(TILES, 1))
    data = truth[:, None] + noise
    rows = {}
    for name, model in materials.items():
        halves = model[:, None, None] + own * rng.normal(size=(2, TILES, 3, 1))
        mean, half_difference = 0.5 * (halves[0] + halves[1]), 0.5 * (halves[0] - halves[1])
        rows[name] = TwoSamples(mean, half_difference if own else None)

    def residual(image):
        return image - data, np.ones_like(data)

    def equations(name):
        two = rows[name]
        square = np.mean((two.mean[:, :, 0] - data) ** 2)
        if two.half_difference is not None:
            square -= np.mean(two.half_difference**2)
        return NormalEquations(0.5 * float(square), np.zeros(0), np.zeros((0, 0)))

    evaluate = SimpleNamespace(samples=rows.__getitem__)
    return SimpleNamespace(evaluate=evaluate, residual=residual, equations=equations, independent=1.5 * TILES)


@pytest.mark.parametrize(
    ("structure", "own"), [(0.0, 0.0), (1.0, 0.0), (0.0, 0.5)], ids=["noise", "shared by channels", "own noise"]
)
def test_the_deviation_is_the_scatter_between_pictures(structure, own):
    rng = np.random.default_rng(7)
    first, other = 0.1 * rng.normal(size=(2, TILES))
    truth = 0.5 * (first + other)  # both miss it by as much
    materials = {"first": first, "other": other}
    found = [
        compare(picture(rng, truth, materials, structure=structure, own=own), "first", "other") for _ in range(PICTURES)
    ]
    more = np.array([it.more for it in found])
    # the scatter of 200 numbers is known to 5 % (one deviation)
    assert np.median([it.deviation for it in found]) == pytest.approx(more.std(), rel=0.15)
    assert abs(more.mean()) < 3.0 * more.std() / np.sqrt(PICTURES)
    # as good as each other: either wins in half of the pictures, and a probability is uniform
    better = np.array([it.better for it in found])
    assert np.mean(better) == pytest.approx(0.5, abs=3.0 * 0.29 / np.sqrt(PICTURES))
    assert np.mean((better > 0.05) & (better < 0.95)) == pytest.approx(0.9, abs=0.07)
    # in units of residuals; the recording's own noise does not count
    unit = 1.0 + structure**2
    distance = np.sum((first - other) ** 2) * 1.5 / unit
    assert np.median([it.distance for it in found]) == pytest.approx(distance, rel=0.1)


def test_noise_that_channels_share_inflates_the_difference():
    rng = np.random.default_rng(3)
    first, other = 0.1 * rng.normal(size=(2, TILES))
    pure = compare(picture(rng, first, {"a": first, "b": other}), "a", "b")
    shared = compare(picture(rng, first, {"a": first, "b": other}, structure=3.0), "a", "b")
    # three channels of independent noise count as 1.5 residuals, those of shared noise should count as one
    assert pure.inflation == pytest.approx(1.0, abs=0.1)
    assert shared.inflation == pytest.approx(1.5, rel=0.25)


def test_a_material_that_is_clearly_further_away_is_told_apart():
    rng = np.random.default_rng(5)
    first, other = np.zeros(TILES), np.full(TILES, 0.3)
    it = compare(picture(rng, first, {"a": first, "b": other}), "a", "b")
    assert it.more == pytest.approx(0.09 * 1.5 * TILES, rel=0.3)
    assert it.more > 5.0 * it.deviation
    assert it.better < 1e-4


def test_a_material_compared_with_itself():
    rng = np.random.default_rng(1)
    it = compare(picture(rng, np.zeros(TILES), {"a": np.zeros(TILES)}), "a", "a")
    assert (it.more, it.deviation, it.distance, it.better) == (0.0, 0.0, 0.0, 0.5)
    assert it.inflation == 1.0


def test_materials_nearer_than_the_model_s_own_error_are_not_told_apart():
    rng = np.random.default_rng(2)
    zero = np.zeros(TILES)
    problem = picture(rng, zero, {"a": zero, "b": rng.normal(size=TILES)})
    assert compare(problem, "a", "b").better < 1e-4
    # a systematic error of a hundred times the noise may be what sets them apart
    assert 0.1 < compare(problem, "a", "b", model_error=100.0).better < 0.5


TABLE = ParameterTable(
    Parameter(name, size, 0.0, 1.0, 0.5)
    for name, size in (("base_color", 3), ("roughness", 1), ("coat_weight", 1), ("coat_roughness", 1))
)
FOUND = TABLE.pack({"base_color": (0.5, 0.2, 0.1), "roughness": 0.3, "coat_weight": 0.0, "coat_roughness": 0.1})


def rival(share, **values):
    return Rival(TABLE.pack({**TABLE.unpack(FOUND), **values}), share)


def test_values_that_differ_are_told_the_most_different_first():
    other = rival(0.31, coat_weight=0.48, roughness=0.45, coat_roughness=0.8, base_color=(0.52, 0.2, 0.1))
    assert rival_notes((other,), FOUND, TABLE) == (
        "With a probability of 31 % it is another material: coat_weight 0.48 (not 0), roughness 0.45 (not 0.3).",
    )  # without a coat its roughness says nothing


def test_values_that_no_picture_shows_are_not_told():
    """Of a tint and a level that trade it was said that with 51 % they are others."""
    other = rival(0.31, coat_weight=0.48, roughness=0.45)
    (note,) = rival_notes((other,), FOUND, TABLE, ["coat_weight"])
    assert note == "With a probability of 31 % it is another material: roughness 0.45 (not 0.3)."
    assert rival_notes((other,), FOUND, TABLE, ["coat_weight", "roughness"]) == ()


def test_the_last_of_many_that_look_alike_has_no_probability_of_its_own():
    last = Rival(TABLE.pack({**TABLE.unpack(FOUND), "roughness": 0.9}), 1.0 / 3.0, last=True)
    assert rival_notes((last,), FOUND, TABLE) == (
        "Every material from the result to this one looks the same: roughness 0.9 (not 0.3).",
    )


def test_a_colour_is_told_whole():
    (note,) = rival_notes((rival(0.2, base_color=(0.5, 0.3, 0.1)),), FOUND, TABLE)
    assert note.endswith("base_color (0.5, 0.3, 0.1) (not (0.5, 0.2, 0.1)).")


def test_unlikely_and_similar_ones_are_not_told_and_the_likeliest_comes_first():
    rivals = (
        rival(0.04, roughness=0.9),
        rival(0.9, roughness=0.32),
        rival(0.1, roughness=0.8),
        rival(0.3, roughness=0.6),
    )
    assert [note.split()[4] for note in rival_notes(rivals, FOUND, TABLE)] == ["30", "10"]
