# SPDX-License-Identifier: Apache-2.0
"""A slice of the study, and what it says of a planted difference."""

from __future__ import annotations

import numpy as np
import pytest

from studies.differential.compare import compare

pytest.importorskip("bpy")


SEED = 1  # a fine ball


def noisy(mean: np.ndarray, deviation: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    draw = np.random.default_rng(seed)
    return tuple(mean + draw.normal(0.0, deviation, mean.shape) for _ in range(2))  # type: ignore[return-value]


def test_noise_is_no_difference() -> None:
    mean = np.full((48, 48, 3), 0.5)
    for seed in range(50):
        assert not compare(noisy(mean, 0.2, seed), noisy(mean, 0.2, 1000 + seed)).is_failure


def test_a_block_or_a_level_is_one() -> None:
    mean = np.full((48, 48, 3), 0.5)
    block = mean.copy()
    block[8:16, 8:16] *= 1.2
    assert compare(noisy(block, 0.05, 1), noisy(mean, 0.05, 2)).block_deviations > 4.0
    found = compare(noisy(1.03 * mean, 0.05, 1), noisy(mean, 0.05, 2))
    assert found.is_failure
    assert found.level == pytest.approx(0.03, abs=0.005)


def test_five_scenes_hold_no_silent_difference() -> None:
    from studies.differential.study import study

    assert study(5, 0, size=32, samples=32) == []


def test_a_planted_difference_is_minimised_to_its_cause(monkeypatch: pytest.MonkeyPatch, tmp_path) -> None:
    """A lamp that the export forgets: the setting that brightens it is what remains of three."""
    from blender_addon.export.lights import read_light
    from studies.differential.study import minimised, try_scene

    monkeypatch.setattr(read_light, "light_strength", lambda light: 350.0)
    settings = ("lens", "lamp energy", "muted node")
    outcome = try_scene(settings, SEED, tmp_path, size=32, samples=32)
    assert outcome.is_silent
    assert minimised(outcome, SEED, tmp_path, size=32, samples=32).settings == ("lamp energy",)


def test_a_planted_difference_of_a_bake_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bakes of half the colour: by second Blenders that run already, and by own ones before it is reported."""
    from blender_addon.export.materials.baked_material import Baked
    from blender_addon.probe import client
    from studies.differential import study

    own, color, asked = client.own_blender, Baked._color, set[bool]()

    def halved(self: Baked, pixels: np.ndarray) -> np.ndarray:
        asked.add(client.own_blender is own)
        return np.float32(0.5) * color(self, pixels)

    monkeypatch.setattr(Baked, "_color", halved)
    monkeypatch.setattr(study, "drawn", lambda *_, **__: ["coordinates of an empty"])
    found = study.study(1, SEED, size=32, samples=32)
    assert [outcome.settings for outcome in found] == [("coordinates of an empty",)]
    assert asked == {False, True}


def test_what_shows_objects_is_as_in_cycles(tmp_path) -> None:
    """Each of these alone was 0.3 to 467 % beside Cycles, a block at 8 deviations or more, and nothing was said."""
    from studies.differential.study import try_scene

    shown = ("instancer without shadow", "lamp indirect only", "lamp in a holdout collection", "attribute of data")
    outcome = try_scene((*shown, "ocean", "few hairs in the viewport", "children"), SEED, tmp_path, size=32, samples=64)
    assert outcome.difference is not None
    assert not outcome.difference.is_failure


def test_shadows_of_an_alpha_below_zero_are_as_in_cycles(tmp_path) -> None:
    """1 - alpha of the light passed: 4 % too bright, a block at 104 deviations."""
    from studies.differential.study import try_scene

    outcome = try_scene(["alpha below zero"], SEED, tmp_path, size=32, samples=128)
    assert outcome.difference is not None
    assert not outcome.difference.is_failure


@pytest.mark.parametrize(
    ("seed", "names"),
    [
        (150036, ("mirrored instance", "leaves")),  # filtered colours beside holes: 2.6 % too dark, 38 deviations
        (150093, ("emission sampling", "numbers on the box")),  # glow below a coat: 4.6 % too bright, 59 deviations
    ],
    ids=["holes", "glow"],
)
def test_baked_boxes_are_as_in_cycles(seed: int, names: tuple[str, ...], tmp_path) -> None:
    from studies.differential.study import try_scene

    outcome = try_scene(names, seed, tmp_path, size=32, samples=64)
    assert outcome.difference is not None
    assert not outcome.difference.is_failure


@pytest.mark.parametrize(
    "name",
    [
        "instancer a holdout",
        "instancer a catcher",
        "lamp's instancer hidden from diffuse",
        "mesh light linking",
        "mesh shadow linking",
        "is viewport",
        "few particles in the viewport",
        "sculpted",
        "below zero",
        "dark emission of the target",
    ],
)
def test_what_the_fit_has_not_is_named(name: str, tmp_path) -> None:
    """Each was beside Cycles by up to 223 %, and nothing was said; those that take light away are refused."""
    import bpy

    from blender_addon.export.job import check_export
    from studies.differential.random_scene import WORDS, build

    rig = build([name], SEED, tmp_path, size=32, samples=1)
    errors, notes = check_export(bpy.context, rig.target)
    assert any(word in sentence for word in WORDS[name] for sentence in (*errors, *notes))
