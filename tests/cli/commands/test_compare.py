# SPDX-License-Identifier: Apache-2.0
"""`mfo compare`: all metrics of two files, as text, JSON and pictures."""

from __future__ import annotations

import argparse
import importlib.util
import json
import sys

import numpy as np
import pytest
from PIL import Image as PillowImage

from mfo_backend.cli.commands import compare
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.scene.image_file import write_exr, write_png
from mfo_backend.types.errors import BadInputError
from tests.scene.test_png_file import write_png16


@pytest.fixture(autouse=True)
def _no_judges(request, monkeypatch):
    """The same metrics on every machine; the judges have tests of their own."""
    if request.node.get_closest_marker("judges") is None:
        monkeypatch.setitem(sys.modules, "torch", None)
        monkeypatch.delenv("MFO_HDRVDP3", raising=False)


@pytest.fixture
def files(tmp_path):
    """A lit square on black, linear and displayed, and a darker, redder one; a mask of the square."""
    rng = np.random.default_rng(0)
    reference = np.zeros((24, 30, 3), np.float32)
    reference[6:18, 6:18] = rng.uniform(0.1, 0.9, (12, 12, 3))
    test = reference * np.array([1.0, 0.7, 0.6], np.float32)
    mask = np.zeros(reference.shape)
    mask[6:18, 6:18] = 1
    for name, pixels in (("ref", reference), ("test", test)):
        write_exr(tmp_path / f"{name}.exr", pixels)
        write_png(tmp_path / f"{name}.png", DisplayView().display(pixels))
    write_exr(tmp_path / "other.exr", reference[:20])
    write_exr(tmp_path / "black.exr", 0 * reference)
    write_exr(tmp_path / "nan.exr", np.where(reference > 0.5, np.nan, reference))
    write_exr(tmp_path / "negative.exr", np.where(reference > 0, reference, -0.5))
    write_exr(tmp_path / "infinite.exr", np.where(reference > 0.8, np.inf, reference))
    write_exr(tmp_path / "dot.exr", reference[12:13, 12:13])
    write_exr(tmp_path / "other_dot.exr", test[12:13, 12:13])
    write_png(tmp_path / "mask.png", mask)
    return tmp_path


def run(folder, *words):
    parser = argparse.ArgumentParser()
    compare.add_parser(parser.add_subparsers())
    arguments = parser.parse_args(["compare", *(str(folder / w) if "." in w else w for w in words)])
    return arguments.func(arguments)


def metrics(capsys, folder, *words):
    assert run(folder, *words, "--json") == 0
    return json.loads(capsys.readouterr().out)


def test_linear_pictures_have_every_metric(files, capsys):
    found = metrics(capsys, files, "ref.exr", "test.exr")["metrics"]
    judges = {name: found.pop(name) for name in ("jod", "hdrvdp3_q_jod")}
    assert list(found) == ["mse", "log_mse", "relative_mse", "pu21_mse", "flip", "hdr_flip", "de_itp"]
    assert all(value > 0 for value in found.values())
    assert set(judges.values()) == {None}
    assert found["hdr_flip"] < 1 > found["flip"]


def test_display_pictures_have_no_errors_of_radiance(files, capsys):
    content = metrics(capsys, files, "ref.png", "test.png")
    missing = [name for name, value in content["metrics"].items() if value is None]
    assert missing == ["log_mse", "relative_mse", "hdr_flip", "jod", "hdrvdp3_q_jod"]
    assert "need two linear pictures" in content["notes"][0]


@pytest.mark.parametrize("pair", [("ref.exr", "ref.exr"), ("ref.png", "ref.png")])
def test_equal_files_have_no_error(files, capsys, pair):
    assert set(metrics(capsys, files, *pair)["metrics"].values()) - {None} == {0}


def test_a_linear_file_shown_through_the_view_equals_its_png(files, capsys):
    found = metrics(capsys, files, "ref.exr", "ref.png")["metrics"]
    assert found["mse"] < 2e-6  # 8 bits: (1/255)^2 / 12
    assert found["flip"] < 0.01
    brighter = metrics(capsys, files, "ref.exr", "ref.png", "--exposure", "1")["metrics"]
    assert brighter["flip"] > 0.05


def test_the_mask_averages_over_the_object(files, capsys):
    whole = metrics(capsys, files, "ref.exr", "test.exr")["metrics"]
    masked = metrics(capsys, files, "ref.exr", "test.exr", "--mask", "mask.png")["metrics"]
    assert masked["mse"] == pytest.approx(whole["mse"] * 24 * 30 / 144)  # there is no error outside
    assert masked["flip"] > 2 * whole["flip"]


def test_maps_are_written(files, capsys):
    content = metrics(capsys, files, "ref.exr", "test.exr", "--out", "maps.dir")
    assert list(content["pictures"]) == ["flip", "hdr_flip", "de_itp"]
    for path in content["pictures"].values():
        with PillowImage.open(path) as picture:
            assert picture.width > 256


def test_text_names_every_metric(files, capsys):
    assert run(files, "ref.png", "test.png") == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[:9]] == list(compare._MEANINGS)
    assert lines[5].split()[1] == "-"


def test_a_black_reference_is_defined(files, capsys):
    found = metrics(capsys, files, "black.exr", "test.exr")["metrics"]
    assert all(np.isfinite(found[name]) for name in found if "jod" not in name)
    assert found["hdr_flip"] > 0


def test_negative_pixels_count_as_zero_but_for_mse_and_are_noted(files, capsys):
    plain = metrics(capsys, files, "ref.exr", "test.exr")
    negative = metrics(capsys, files, "negative.exr", "test.exr")
    changed = [name for name, value in plain["metrics"].items() if negative["metrics"][name] != value]
    assert changed == ["mse"]
    assert any(
        "has 576 pixels with negative values; all metrics but mse took them as 0" in n for n in negative["notes"]
    )


def test_pictures_of_one_pixel_have_every_metric(files, capsys):
    found = metrics(capsys, files, "dot.exr", "other_dot.exr", "--out", "maps.dir")["metrics"]
    assert all(value > 0 for name, value in found.items() if "jod" not in name)


def display_file(folder, suffix, levels):
    """One picture in every kind of display file; levels (height, width, 3) in 0 to 255."""
    path = folder / f"picture.{suffix}"
    if suffix == "png16":
        path = folder / "deep.png"
        write_png16(path, (levels.astype(np.uint16) * 257))
    else:
        PillowImage.fromarray(levels).save(path, **({"quality": 95} if suffix == "jpg" else {}))
    return path.name


@pytest.mark.parametrize("suffix", ["png16", "png", "tif", "jpg"])
def test_every_kind_of_display_file_is_compared(files, capsys, suffix):
    levels = np.random.default_rng(1).integers(60, 200, (6, 8, 3)).repeat(8, 0).repeat(8, 1).astype(np.uint8)
    write_png(files / "same.png", levels / 255)
    found = metrics(capsys, files, "same.png", display_file(files, suffix, levels))["metrics"]
    # 257 times a level of 8 bits is that level; JPEG at this quality is a few levels off
    assert found["mse"] == 0 if suffix != "jpg" else 0 < found["mse"] < 4e-3


def test_radiance_hdr_files_are_compared(files, capsys):
    """One pixel of four equal bytes each way: 128 * 2^(129 - 136) = 1 and half of it (Ward, Real Pixels)."""
    for name, exponent in (("one", 129), ("half", 128)):
        head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n"
        (files / f"{name}.hdr").write_bytes(head + bytes([128, 128, 128, exponent]))
    found = metrics(capsys, files, "one.hdr", "half.hdr")["metrics"]
    assert found["mse"] == pytest.approx(0.25, rel=0.02)
    assert found["hdr_flip"] > 0.1


def test_absent_judges_are_one_note(files, capsys):
    notes = metrics(capsys, files, "ref.exr", "test.exr")["notes"]
    assert [note for note in notes if "pip install" in note] == notes[-1:]


@pytest.mark.judges
@pytest.mark.parametrize(("end", "peak"), [("exr", 1500), ("png", 100)])
def test_the_judges_score_and_what_they_were_told_is_recorded(files, capsys, end, peak):
    if not all(map(importlib.util.find_spec, ("torch", "pycvvdp"))):
        pytest.skip("the extra `judges` is not installed")
    content = metrics(capsys, files, f"ref.{end}", f"test.{end}")
    assert 3 < content["metrics"]["jod"] < 9.9
    told = content["judges"]
    assert (told["width"], told["height"], told["peak_nits"]) == (30, 24, peak)
    assert told["pixels_per_degree"] == pytest.approx(67.0206, abs=1e-4)
    assert f"30x24 pictures on a display of {peak} cd/m^2" in " ".join(content["notes"])
    assert metrics(capsys, files, f"ref.{end}", f"ref.{end}")["metrics"]["jod"] == 10


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("ref.exr", "other.exr"), "The test image is 30x20 but the reference is 30x24"),
        (("nan.exr", "ref.exr"), r"The reference has \d+ pixels with NaN"),
        (("ref.exr", "infinite.exr"), r"The test image has 0 pixels with NaN and \d+ with infinite"),
        (("ref.exr", "missing.exr"), "does not exist"),
        (("ref.exr", "test.exr", "--mask", "black.exr"), "The mask is empty"),
        (("ref.exr", "test.exr", "--mask", "other.exr"), "The mask has shape"),
        (("ref.exr", "test.exr", "--gamma", "-1"), "View gamma is -1.0"),
        (("ref.exr", "test.exr", "--out", "mask.png"), "cannot be made"),
    ],
)
def test_bad_input(files, words, sentence):
    with pytest.raises(BadInputError, match=sentence):
        run(files, *words)
