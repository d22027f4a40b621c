# SPDX-License-Identifier: Apache-2.0
"""Jobs of several materials: what their folders say, what is refused before a fit, and what is written after one."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mfo_backend.cli.result_text import result_text
from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.request import MOST_TARGETS, read_request, request_to_json
from mfo_backend.job.output.progress import EventWriter
from mfo_backend.job.run import fit_materials
from mfo_backend.job.run.job_outcome import JobOutcome
from mfo_backend.job.run.run_job import run_job
from mfo_backend.job.run.stop import StopSignal
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.status import Status
from mfo_backend.types.verdict import Difference, Judgement, Verdict
from tests.job.fake_worker import fake_result


def change(folder: Path, **keys: Any) -> None:
    path = folder / "request.json"
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | keys), "utf-8")


@pytest.fixture
def two(job: Path, tmp_path: Path) -> Path:
    """The job of a vase and a floor."""
    data = json.loads((job / "request.json").read_text("utf-8"))
    shutil.copytree(job, tmp_path / "copy")
    for number, (shape, bsdf, name) in enumerate((("target", "glaze", "Glaze"), ("floor", "wood", "Wood")), 1):
        inner = job / "targets" / str(number)
        shutil.copytree(tmp_path / "copy", inner)
        target = {"shape_id": shape, "bsdf_id": bsdf, "object": name, "material": name}
        change(inner, target=target, materials={bsdf: data["materials"]["glaze"]})
    change(job, targets=["targets/1", "targets/2"])
    return job


def test_each_material_is_a_whole_job_of_its_own(two: Path) -> None:
    request = read_request(JobFolder.open(two))
    assert [(path, each.target.material) for path, each in request.targets] == [
        ("targets/1", "Glaze"),
        ("targets/2", "Wood"),
    ]
    assert read_request(JobFolder.open(two / "targets" / "2")) == request.targets[1][1]
    assert request_to_json(request)["targets"] == ["targets/1", "targets/2"]
    assert "targets" not in request_to_json(request.targets[0][1])


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"targets": ["targets/3"]}, "targets/3/request.json', which is not in the job folder"),
        ({"targets": ["../elsewhere"]}, "leaves the job folder"),
        ({"targets": ["targets/1", "targets/1"]}, "targets name the material 'Glaze' twice: name it once"),
        ({"targets": ["targets/1"] * (MOST_TARGETS + 1)}, f"names {MOST_TARGETS + 1} materials: at most"),
        ({"more_pictures": ["targets/2"]}, "targets of targets/2 are other materials than the first picture's"),
    ],
)
def test_wrong_lists_are_refused(two: Path, keys: dict[str, object], sentence: str) -> None:
    change(two, **keys)
    with pytest.raises(BadInputError, match=sentence):
        read_request(JobFolder.open(two))


def test_all_materials_share_one_picture(two: Path) -> None:
    change(two / "targets" / "2", image={"width": 9, "height": 6})
    with pytest.raises(BadInputError, match="targets has a picture of another size"):
        read_request(JobFolder.open(two))


def judged(verdict: Verdict, seen: float) -> Any:
    result = fake_result(Status.DIFFERENT if verdict is Verdict.DIFFERENT else Status.CONVERGED, 0.3)
    errors = {"flip": (0.2, seen), "mse": (0.1, 0.01)}
    return replace(result, errors=errors, judgement=Judgement(verdict, None, Difference(seen, 0.0, 0.0, 0.0, 0.0)))


def test_each_has_its_result_and_the_job_says_the_worst(two: Path) -> None:
    results = [("Glaze", judged(Verdict.SAME, 0.02)), ("Wood", judged(Verdict.DIFFERENT, 0.2))]

    def fitter(_folder: Any, _request: Any, reference: Any, _view: Any, **_: Any) -> JobOutcome:
        counted = np.ones(reference.pixels.shape[:2], bool)
        own = [JobOutcome(r, reference.pixels, reference.pixels, counted, "fake") for _, r in results]
        whole = fit_materials._whole(results, [30, 10])
        return JobOutcome(whole, reference.pixels, reference.pixels, counted, "fake", materials=tuple(own))

    stop = StopSignal(cancel_file=two / "cancel")
    assert run_job(two, EventWriter(), stop, fitter=fitter) is Status.DIFFERENT
    whole = json.loads((two / "result.json").read_text("utf-8"))
    assert whole["sentence"] == "2 materials: 1 looks the same as the reference, 1 does not match the reference (Wood)."
    assert (whole["verdict"], whole["recovered"], whole["errors"]["flip"][1]) == ("different", {}, pytest.approx(0.065))
    for number, (name, result) in enumerate(results, 1):
        found = whole["materials"][number - 1]
        own = json.loads((two / f"targets/{number}/result.json").read_text("utf-8"))
        assert (found["material"], found["folder"]) == (name, f"targets/{number}")
        assert own["recovered"] == found["recovered"]
        assert own["verdict"] == result.judgement.verdict.value
        assert (two / f"targets/{number}/index.html").is_file()
    assert [f"{name} on {name}: " in result_text(whole) for name in ("Glaze", "Wood")] == [True, True]
    report = (two / "index.html").read_text("utf-8")
    assert 'href="targets/2/index.html"' in report
