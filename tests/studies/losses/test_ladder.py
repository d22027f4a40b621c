# SPDX-License-Identifier: Apache-2.0
"""The ladder study: its table and plot on made-up rows, and one small scene."""

from __future__ import annotations

import importlib

import numpy as np
import pytest


def load(name, monkeypatch):
    return importlib.import_module(f"studies.losses.{name}")


def row(scene, jod=True, **flips):
    methods = {
        name: {
            "flip": flip,
            "hdr_flip": flip,
            "de_itp": 1.0,
            "lost_jod": 0.5 if jod else None,
            "parameter": 0.1,
            "passes": 100.0,
            "iterations": {"mse": 10, "flip": 20} if ">" in name else {},
        }
        for name, flip in {"start": 0.5, "mse > flip": 0.02, **flips}.items()
    }
    losses = {"mse": 0.5, "flip": 2.0 + scene}
    return {
        "scene": scene,
        "light": ("point", "probe")[scene % 2],
        "size": 48,
        "methods": methods,
        "loss_passes": losses,
    }


def test_the_table_has_the_least_error_first_and_the_time_of_the_losses(monkeypatch):
    report = load("ladder_report", monkeypatch)
    text = report.table([row(n, itp=0.01 * (n + 1)) for n in range(3)]).splitlines()
    assert text[0].startswith("3 scenes, 48x48 (2 with a point light, 1 with a light probe")
    names = [line.split("|")[1].strip() for line in text if line.startswith("| ")]
    assert names == ["stages", "itp", "mse > flip", "start"]
    itp, paper = (next(line for line in text if f"| {name} |" in line) for name in ("itp", "mse > flip"))
    # 0.01, 0.02, 0.03: two of three are at most 0.02, one is below the pair's 0.02
    assert itp.split("|")[2:7] == [" 0.0200 ", " 0.0200 ", " 0.0250 ", " 67% ", " 33% "]
    # 100 passes, 10 evaluations at 0.5 and 20 at the median of 2, 3 and 4
    assert paper.split("|")[-2].strip() == "165"
    assert "10 - JOD" not in report.table([row(0, jod=False)])


def test_a_method_that_a_scene_lacks_is_left_out(monkeypatch):
    report = load("ladder_report", monkeypatch)
    assert report.methods_of([row(0, cvvdp=0.1), row(1)]) == ["start", "mse > flip"]


def test_the_plot_has_a_dot_for_every_method(monkeypatch):
    report = load("ladder_report", monkeypatch)
    (axes,) = report.plot([row(n, itp=0.01, balanced=0.005) for n in range(2)]).axes
    assert sum(len(line.get_xdata()) for line in axes.lines) == 3
    assert {"balanced", "mse > flip"} <= {text.get_text() for text in axes.texts}


def test_one_scene(tmp_path, monkeypatch):
    """Even scenes have a point light, which recorded paths hold exactly: both stages must get near the truth."""
    pytest.importorskip("mitsuba")
    study = load("ladder_scene", monkeypatch)
    study.prepare()
    monkeypatch.setattr(study, "ladders", lambda judged: [("pu21",), ("pu21", "flip")])
    monkeypatch.setattr(study, "PRESETS", {"fast": {"preset": "fast"}})
    monkeypatch.setattr(study.importlib.util, "find_spec", lambda name: None)
    found = study.measure_scene(0, 24, tmp_path)
    methods = found["methods"]
    assert list(methods) == ["start", "pu21", "pu21 > flip", "fast"]
    assert methods["pu21 > flip"]["passes"] > methods["pu21"]["passes"]
    assert set(methods["pu21 > flip"]["iterations"]) == {"pu21", "flip"}
    for name in ("pu21", "pu21 > flip", "fast"):
        assert methods[name]["flip"] < 0.1 * methods["start"]["flip"]
    assert all(np.isfinite(list(found["loss_passes"].values())))


def test_the_gradient_of_recorded_pictures(tmp_path, monkeypatch):
    pytest.importorskip("mitsuba")
    study = load("ladder_scene", monkeypatch)
    study.prepare()
    from mfo_backend.bench.scenes.assets import Assets
    from mfo_backend.bench.scenes.scene import write_scene
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    written = write_scene(study.SCENARIOS[0], 0, 16, Assets(None), tmp_path)
    renderer = study._load(written.file)
    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    background = renderer.image(renderer.start, seed=0, spp=4096)
    recorded = study.RecordedRenderer(scene, background, grid=16, seed=1, at=renderer.start, near=False)
    image, pullback = recorded.image_and_pullback(renderer.start, seed=0, spp=0)
    # both are means over the pixel of the same direct light: 256 and 4096 random rays, and highlights within a pixel
    np.testing.assert_allclose(image, background, atol=0.05 * background.max())
    weight = np.random.default_rng(0).normal(size=image.shape).astype(np.float32)
    gradient = pullback(weight)
    for k, step in enumerate(1e-3 * np.eye(len(gradient))):
        ends = [recorded.image(renderer.start + sign * step, seed=0, spp=0).astype(np.float64) for sign in (1, -1)]
        # float32 pictures of magnitude 1 and a step of 1e-3
        assert gradient[k] == pytest.approx(((ends[0] - ends[1]) * weight).sum() / 2e-3, rel=0.01, abs=0.02)
