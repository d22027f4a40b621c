# SPDX-License-Identifier: Apache-2.0
"""The guards of a recorded fit's stages, each against a fit without it."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.plans import RecordedPlan
from mfo_backend.fit.squares.problem import Refined
from mfo_backend.render.pictures.renderer import load_renderer
from tests.fit.recorded.one_refine import refine
from tests.render.scenes import AREA, SKY, write_scene

NAMES = ["base_color", "roughness", "metallic", "specular"]
TRUTH = {"base_color": (0.8, 0.5, 0.3), "roughness": 0.12, "metallic": 0.9, "specular": 0.5}
PLAN = RecordedPlan()
FAR = {"base_color": (0.3, 0.5, 0.8), "roughness": 0.45, "metallic": 0.2, "specular": 0.5}


@pytest.fixture
def refined(tmp_path, monkeypatch):
    """Relative error of `refine` from a far start with these settings of its guards, and the number of recordings."""
    renderer = load_renderer(
        write_scene(tmp_path, AREA + SKY, size=40), "target", model="mitsuba_principled", parameters=NAMES
    )
    from mfo_backend.fit.recorded import refine as refine_module

    table, mask = renderer.table, renderer.target_mask()
    reference, true = (renderer.image(table.pack(TRUTH), seed=seed, spp=256) for seed in (5, 9))

    def run(plan=PLAN, seed=1, **guards):
        for name, value in guards.items():
            monkeypatch.setattr(refine_module, name, value)
        end = refine(renderer, reference, table.pack(FAR), plan, seed)
        found = renderer.image(end.refined.x, seed=9, spp=256)
        return float(np.sqrt(np.mean((found - true)[mask] ** 2) / np.mean(true[mask] ** 2))), end.recording.number

    return run


NEVER = float("inf")


def test_a_recording_that_is_too_old_is_made_anew(refined):
    plan = RecordedPlan(too_noisy=NEVER, most_own=1.0)

    def error_and_recordings(**guards):
        found = [refined(plan, seed, **guards) for seed in range(11)]
        return np.median(found, axis=0)

    stale, recordings = error_and_recordings(MOVED=NEVER, NOISIER=NEVER)
    assert recordings == 1
    assert stale > 0.05  # a highlight of roughness 0.12, seen by directions for 0.45
    # either guard alone sees it, with most seeds
    for guards in ({"MOVED": 0.15, "NOISIER": NEVER}, {"MOVED": NEVER, "NOISIER": 1.25}):
        error, recordings = error_and_recordings(**guards)
        assert recordings > 1, guards
        assert error < 0.3 * stale, guards


@pytest.mark.parametrize(
    ("held", "returned", "old"),
    [
        (0.0, 0.0, [0.16]),  # a ball in the open
        (0.0, 0.006, [0.001, 0.004, 0.014, 0.16]),  # what changed may cancel what came back
        (0.33, 0.0, [0.02, 0.16]),  # walks below the surface, light over others a third of all
    ],
    ids=["none", "followed", "held"],
)
def test_light_that_returns_makes_a_recording_old_sooner(held, returned, old):
    from mfo_backend.fit.recorded.refine import _is_old

    scene = SimpleNamespace(needs=SimpleNamespace(held=held), returned_change=lambda paths, x: returned)
    recording = SimpleNamespace(setting=SimpleNamespace(scene=scene), paths=None)
    changes = (0.001, 0.004, 0.014, 0.02, 0.16) if held else (0.001, 0.004, 0.014, 0.16)
    assert [c for c in changes if _is_old(recording, c, np.zeros(1))] == old


def test_a_recording_that_is_too_noisy_is_made_anew_with_more_rays(refined):
    coarse = RecordedPlan(grid_last=2, too_noisy=NEVER, most_own=1.0)
    noisy, recordings = refined(coarse, MOVED=NEVER, NOISIER=NEVER)
    assert recordings == 1
    # noisy to the eye, and noisier than the reference: either guard alone sees it
    for guard in ({"too_noisy": 0.07}, {"most_own": 0.3}):
        error, recordings = refined(replace(coarse, **guard), MOVED=NEVER, NOISIER=NEVER)
        assert recordings > 1, guard
        assert error < 0.5 * noisy, guard


PAINT = ("base_color", "roughness", "specular_ior_level", "coat_weight", "coat_roughness")
GLOSSY = dict(zip(PAINT, ((0.3, 0.2, 0.1), 0.25, 0.5, 0.0, 0.1), strict=True))
COATED = dict(zip(PAINT, ((0.3, 0.2, 0.1), 0.5, 0.05, 0.8, 0.25), strict=True))


@pytest.mark.parametrize("looked_at", [False, True])
def test_a_coat_does_not_stand_in_for_the_highlight_of_the_base(tmp_path, monkeypatch, looked_at):
    from mfo_backend.fit.recorded import refine as refine_module

    if not looked_at:
        monkeypatch.setattr(refine_module.OtherEnds, "simplest", lambda self, found: found)
    renderer = load_renderer(
        write_scene(tmp_path, AREA + SKY, size=40),
        "target",
        model="blender_principled",
        parameters=PAINT,
        materials={"target_bsdf": {"name": "Paint", "distribution": "MULTI_GGX", "sockets": {}}},
    )
    table = renderer.table
    renderer.start = table.pack({**GLOSSY, "base_color": (0.5, 0.5, 0.5), "roughness": 0.6})
    reference = renderer.image(table.pack(GLOSSY), seed=5, spp=64)
    for seed in range(3):
        refined = refine(renderer, reference, table.pack(COATED), PLAN, seed).refined
        found = table.unpack(refined.x)
        if not looked_at:  # the picture is explained as well
            assert found["coat_weight"] > 0.8
            continue
        assert found["coat_weight"] == 0.0
        assert refined.off == ("coat_weight",)
        # six fits of this reference ended within 0.013 and 0.053
        assert found["roughness"] == pytest.approx(GLOSSY["roughness"], abs=0.03)
        assert found["specular_ior_level"] == pytest.approx(GLOSSY["specular_ior_level"], abs=0.08)
        assert 0.0 < sum(rival.share for rival in refined.rivals) < 0.05


@pytest.mark.parametrize(("cost_there", "kept"), [(0.4, "rival"), (0.6, "found")])
def test_a_rival_has_to_be_better_on_a_recording_of_its_own(monkeypatch, cost_there, kept):
    """On a recording made for another material its own noise may pass for a lower cost."""
    from mfo_backend.fit.recorded import refine as refine_module

    found, rival = np.array([0.0]), np.array([1.0])
    recorded = []

    def record(x, grid, number):
        recorded.append((x, grid, number))
        return SimpleNamespace(number=number, preview=None, setting=setting)

    def recorded_near(setting, stage, start, number):
        grid = 9 if start is rival else 7
        return record(start, grid, number + 1), start, grid

    def problems(recording, x, *, solve_all=False):
        few = SimpleNamespace(equations=lambda at: SimpleNamespace(cost=cost_there if at is rival else 0.5))
        return refine_module.OnRecording(Refined(x, few, few), recording)

    setting = SimpleNamespace(
        course=SimpleNamespace(stage=lambda name: nullcontext(SimpleNamespace(vector=None))),
        scene=SimpleNamespace(graph=None, model=SimpleNamespace(limited_width=False)),
        record=record,
        table=None,
        plan=SimpleNamespace(alike=False),
    )
    monkeypatch.setattr(refine_module, "_recorded_near", recorded_near)
    monkeypatch.setattr(refine_module, "_problems", problems)
    monkeypatch.setattr(refine_module, "better_basin", lambda setting, problem, x, others: rival)
    monkeypatch.setattr(refine_module, "_last_steps", lambda setting, stage, refined: refined)
    end = refine_module.refine_sampled(setting, [found, rival])
    assert end.refined.x is (rival if kept == "rival" else found)
    assert recorded[-1] == ((rival, 9, 2) if kept == "rival" else (found, 7, 3))
    assert end.recording.number == recorded[-1][2]
