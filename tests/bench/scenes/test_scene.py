# SPDX-License-Identifier: Apache-2.0
"""Scenes come from their seeds alone and need no data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.bench.rows.method import METHODS, OUR_METHODS, PAPER_METHODS, method_settings
from mfo_backend.bench.scenes.assets import Assets, generated_probe
from mfo_backend.bench.scenes.bumpy_sphere import bumpy_sphere, write_ply
from mfo_backend.bench.scenes.scenario import SCENARIOS
from mfo_backend.bench.scenes.scene import TABLES, write_scene
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding

NO_DATA = Assets(None)


WRITTEN = {name: scenario for name, scenario in SCENARIOS.items() if not scenario.cycles}


@pytest.mark.parametrize("scenario", WRITTEN.values(), ids=WRITTEN)
def test_a_scene_is_the_same_every_time_and_another_by_number(tmp_path, scenario):
    first, again = (write_scene(scenario, 4, 32, NO_DATA, tmp_path) for _ in range(2))
    other = write_scene(scenario, 5, 32, NO_DATA, tmp_path)
    assert first == again
    assert first.start != other.start
    assert first.truth != first.start
    assert bool(first.true_files) == scenario.measured
    files = [first.file, *first.relit, *first.true_files]
    assert len(first.relit) == scenario.relights
    assert len({file.read_text() for file in files}) == len(files)
    for values in (first.truth, first.start):
        for name, value in values.items():
            parameter = TABLES[scenario.model][name]
            assert np.all((np.asarray(value) >= parameter.lower) & (np.asarray(value) <= parameter.upper))


def test_the_papers_transparency_has_its_ranges(tmp_path):
    truths = [write_scene(SCENARIOS["transparency"], n, 8, NO_DATA, tmp_path).truth for n in range(30)]
    assert all(t["transmission_weight"] >= 0.75 and t["roughness"] <= 0.6 and "metallic" not in t for t in truths)


def test_the_object_is_closed_and_faces_outward():
    vertices, triangles = bumpy_sphere(3)
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert len(np.unique(edges, axis=0)) == len(edges)  # each edge once in each direction
    assert {tuple(e) for e in edges} == {tuple(e[::-1]) for e in edges}
    corners = vertices[triangles].astype(float)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    assert 0.3 * 4.19 < volume < 4.19  # of a unit sphere
    assert np.linalg.norm(vertices, axis=1).max() == pytest.approx(1.0, abs=1e-6)


def test_ply_holds_unit_normals(tmp_path):
    vertices, triangles = bumpy_sphere(3)
    write_ply(tmp_path / "object.ply", vertices, triangles)
    data = (tmp_path / "object.ply").read_bytes()
    body = data[data.index(b"end_header\n") + 11 :]
    assert len(body) == len(vertices) * 24 + len(triangles) * 13
    read = np.frombuffer(body, "<f4", len(vertices) * 6).reshape(-1, 6)
    np.testing.assert_array_equal(read[:, :3], vertices)
    np.testing.assert_allclose(np.linalg.norm(read[:, 3:], axis=1), 1.0, atol=1e-6)
    assert np.all((read[:, 3:] * vertices).sum(axis=1) > 0)


def test_the_generated_probe_has_a_mean_luminance_of_one():
    probe = generated_probe(2)
    weight = np.sin((np.arange(64) + 0.5) * np.pi / 64)
    mean = np.average((probe @ [0.2126, 0.7152, 0.0722]).mean(axis=1), weights=weight)
    assert mean == pytest.approx(1.0, rel=1e-5)
    assert probe.min() > 0


def test_a_wrong_data_folder_is_refused(monkeypatch, tmp_path):
    monkeypatch.setenv("MFO_DATA", str(tmp_path / "nothing"))
    with pytest.raises(BadInputError, match="MFO_DATA"):
        Assets.find()


def test_meshes_of_the_folder_are_used_and_open_ones_not_for_glass(tmp_path):
    (tmp_path / "meshes").mkdir()
    for name in ("teapot", "spot"):
        (tmp_path / "meshes" / f"{name}.ply").touch()
    assets = Assets(tmp_path)
    scenes = [
        write_scene(SCENARIOS[name], n, 8, assets, tmp_path) for name in ("base", "transparency") for n in range(8)
    ]
    assert {s.object for s in scenes if s.scenario.name == "base"} == {"teapot", "spot"}
    assert {s.object for s in scenes if s.scenario.name == "transparency"} == {"spot"}


@pytest.mark.parametrize("method", METHODS)
def test_methods_are_what_they_are_called(method):
    settings = method_settings(method, SCENARIOS["noise"], 7)
    assert (settings.seed, settings.spp, settings.parameters) == (7, 4, "all")
    if method in OUR_METHODS:
        assert settings.preset == method
    elif method.startswith("lpips"):
        assert settings.stage_names(Encoding.LINEAR) == ("lpips_alex-hdr" if "pu" in method else "lpips_alex-ldr",)
    elif method in PAPER_METHODS:
        stages = {"mse": ["mse"], "flip": ["flip"], "mfo": ["mse", "flip"]}[method[:-4]]
        assert list(settings.stage_names(Encoding.LINEAR)) == [f"{stage}-{method[-3:]}" for stage in stages]
    else:
        whole = METHODS[METHODS[method].compares_with]
        assert whole.compares_with == ""
        assert replace(METHODS[method], compares_with="") != whole
