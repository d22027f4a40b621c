# SPDX-License-Identifier: Apache-2.0
"""`mfo fit`: a job made from a plain Mitsuba scene, refused or run."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.cli.fit_options import add_fit_options, fit_from_options
from mfo_backend.cli.result_text import result_text
from mfo_backend.fit.settings import FitSettings
from mfo_backend.scene.image_file import write_exr

ROOT = Path(__file__).resolve().parents[3]
FAKE = """
import argparse, sys
sys.path.insert(0, {folder!r})
from fake_worker import fake_fit
from mfo_backend.cli import main
from mfo_backend.cli.commands import fit
def add_parser(subparsers, real=fit.add_parser):
    real(subparsers)
    subparsers.choices["fit"].set_defaults(func=lambda arguments: fit.work(arguments, fake_fit))
fit.add_parser = add_parser
sys.exit(main.main(sys.argv[1:]))
"""
SCENE = """<scene version="3.0.0">
  <default name="size" value="16"/>
  <integrator type="path"/>
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,-4,1" target="0,0,0" up="0,0,1"/></transform>
    <film type="hdrfilm"><integer name="width" value="$size"/><integer name="height" value="12"/></film>
  </sensor>
  <emitter type="constant"/>
  <bsdf type="principled" id="glaze">
    <rgb name="base_color" value="0.6, 0.6, 0.6"/><float name="roughness" value="0.6"/>
  </bsdf>
  <shape type="sphere" id="ball"><ref id="glaze"/></shape>
</scene>"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "a scene.xml"
    path.write_text(SCENE)
    pixels = np.zeros((12, 16, 3), np.float32)
    pixels[:] = (0.7, 0.2, 0.1)
    write_exr(tmp_path / "ref.exr", pixels)
    return path


def mfo_fit(scene: Path, *words: str, fake: bool = True) -> subprocess.CompletedProcess:
    start = ["-c", FAKE.format(folder=str(ROOT / "tests" / "job"))] if fake else ["-m", "mfo_backend"]
    return subprocess.run(
        [sys.executable, *start, "fit", str(scene), *words],
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=scene.parent,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"},
        timeout=200,
    )


def test_it_makes_a_job_and_reports(scene: Path) -> None:
    done = mfo_fit(scene, "--target", "ball", "--reference", "ref.exr", "--parameters", "roughness, base_color")
    assert done.returncode == 0, done.stderr
    job = scene.parent / "mfo-a scene-1"
    assert "roughness" in done.stdout
    assert "mean flip   0.2" in done.stdout
    assert f"Report: {job.name}/index.html" in done.stdout
    request = json.loads((job / "request.json").read_text("utf-8"))
    assert request["fit"]["parameters"] == ["roughness", "base_color"]
    assert request["image"] == {"width": 16, "height": 12, "film_transparent": False}
    assert request["target"]["bsdf_id"] == "glaze"
    assert request["reference"] == {"path": "reference.exr", "encoding": "linear"}
    assert (job / "reference.exr").read_bytes() == (scene.parent / "ref.exr").read_bytes()
    assert mfo_fit(scene, "--target", "ball", "--reference", "ref.exr").returncode == 0
    assert (scene.parent / "mfo-a scene-2" / "result.json").exists()


@pytest.mark.parametrize(
    ("words", "losses", "preset"),
    [
        (["--lf", "pu21", "--hf", "itp"], ["pu21", "itp"], "paper"),
        (["--lf", "log"], ["log", "flip"], "paper"),
        (["--hf", "flip-ldr"], ["mse", "flip-ldr"], "paper"),
        (["--losses", "log, itp,flip"], ["log", "itp", "flip"], "paper"),
        (["--losses", "mse", "--preset", "fast"], ["mse"], "fast"),
    ],
)
def test_losses_by_name(words: list[str], losses: list[str], preset: str) -> None:
    parser = argparse.ArgumentParser()
    add_fit_options(parser)
    asked = fit_from_options(parser.parse_args(words))
    assert asked["losses"] == losses
    assert FitSettings.from_request(asked).preset == preset


def test_json_is_one_object(scene: Path) -> None:
    done = mfo_fit(scene, "--target", "ball", "--reference", "ref.exr", "--out", "here", "--json", "--seed", "3")
    result = json.loads(done.stdout)  # although a library prints on stdout meanwhile
    assert result["status"] == "stale"
    assert result["folder"] == "here"
    assert json.loads((scene.parent / "here" / "request.json").read_text())["fit"]["seed"] == 3


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--target", "cube"], "No shape 'cube' in the scene: its shapes are 'ball'."),
        (["--reference", "missing.exr"], "Image 'missing.exr' does not exist: check the path."),
        (["--reference", "small.exr"], "Reference is 4x4 but the scene renders 16x12: "),
        (["--reference", "black.exr"], "Reference is all black: "),
        (["--preset", "magic"], "Fit setting 'preset' is 'magic': "),
        (["--losses", "mse,ssim"], "Unknown loss 'ssim': choose one of mse, "),
        (["--losses", ","], "Fit setting 'losses' is []: "),
        (["--losses", "mse", "--hf", "flip"], "Both --losses and --lf or --hf were given: "),
        (["--hf", "flip", "--preset", "fast"], "Preset 'fast' minimises sums of squares, which 'flip' is not: "),
        (["--lf", "log", "--reference", "display.png"], "There is no loss 'log-ldr'"),
        (["--spp", "0"], "Fit setting 'spp' is 0: "),
        (
            ["--range", "hdr", "--reference", "display.png"],
            "Fit setting 'range' is 'hdr' but the reference is a display",
        ),
        (["--gamma", "0"], "View gamma is 0.0: "),
        (["--out", "full"], "The folder full is not empty: "),
        (["--out", "/proc/mfo-job"], "The job folder /proc/mfo-job cannot be written ("),
        (["--out", "ref.exr"], "The job folder ref.exr cannot be written ("),
    ],
)
def test_bad_input_makes_no_job(scene: Path, words: list[str], sentence: str) -> None:
    folder = scene.parent
    write_exr(folder / "small.exr", np.ones((4, 4, 3), np.float32))
    write_exr(folder / "black.exr", np.zeros((12, 16, 3), np.float32))
    from PIL import Image

    Image.new("RGB", (16, 12), (9, 9, 9)).save(folder / "display.png")
    (folder / "full").mkdir()
    (folder / "full" / "file").touch()
    before = sorted(folder.rglob("*"))
    done = mfo_fit(scene, *["--target", "ball", "--reference", "ref.exr", *words], "--json")
    assert done.returncode == 2
    assert done.stderr.startswith(f"mfo: {sentence}")
    assert done.stderr.count("\n") == 1
    assert json.loads(done.stdout)["status"] == "bad_input"
    assert sorted(folder.rglob("*")) == before


def test_a_scene_whose_file_is_missing_leaves_nothing(scene: Path) -> None:
    shape = '<shape type="ply"><string name="filename" value="gone.ply"/></shape></scene>'
    scene.write_text(SCENE.replace("</scene>", shape))
    done = mfo_fit(scene, "--target", "ball", "--reference", "ref.exr", "--out", "job")
    assert done.returncode == 2
    assert "names the file 'gone.ply', which is not there" in done.stderr
    assert not (scene.parent / "job").exists()


def test_a_real_fit_of_a_small_scene(scene: Path) -> None:
    words = ["--preset", "paper", "--parameters", "base_color", "--max-iterations", "3", "--spp", "1"]
    words += ["--out", "job", "--json"]
    done = mfo_fit(scene, "--target", "ball", "--reference", "ref.exr", *words, fake=False)
    result = json.loads(done.stdout)
    # three iterations with a sample a pixel are not enough, and that is said
    assert (done.returncode, result["verdict"], result["status"]) == (5, "different", "different"), done.stderr
    assert [stage["name"] for stage in result["stages"]] == ["mse-hdr", "flip-hdr"]
    red, green, _ = result["recovered"]["base_color"]
    assert red > green > 0  # three steps towards the reddish reference
    assert result["versions"]["variant"].endswith("_ad_rgb")
    assert result["errors"]["flip"][1] <= result["errors"]["flip"][0]


def test_an_unknown_parameter_is_named(scene: Path) -> None:
    words = ["--parameters", "shininess", "--out", "job"]
    done = mfo_fit(scene, "--target", "ball", "--reference", "ref.exr", *words, fake=False)
    assert done.returncode == 2
    assert "'shininess'" in done.stderr
    assert "roughness" in done.stderr
    assert not (scene.parent / "job" / "result.json").exists()


def test_values_and_differences_are_a_table() -> None:
    result = {
        "initial": {"base_color": [0.8, 0.8, 0.8], "roughness": 0.5},
        "recovered": {"base_color": [0.25, 0.5, 0.123456], "roughness": 0.3},
        "errors": {"flip": [0.2, None]},
    }
    assert result_text(result).splitlines() == [
        "            start        result",
        "base_color  0.8 0.8 0.8  0.25 0.5 0.1235",
        "roughness   0.5          0.3",
        "mean flip   0.2          -",
    ]


def test_a_model_gap_is_a_line_of_the_table() -> None:
    result = {"initial": {}, "recovered": {}, "errors": {}, "model_gap": {"relative": 0.0214, "at_most": 0.03}}
    assert result_text(result).splitlines()[-1].split() == ["model", "gap", "2.1", "%", "at", "most", "3", "%"]
