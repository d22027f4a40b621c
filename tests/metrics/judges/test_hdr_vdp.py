# SPDX-License-Identifier: Apache-2.0
"""The adapter of HDR-VDP-3: what it hands over and how it fails, with a stand-in for Octave; the original where it is.

The stand-in is a script of Python that reads what Octave would read and scores 10 minus the mean absolute difference.
`MFO_TEST_OCTAVE=1` runs the driver in the Octave of the machine, with a stand-in for hdrvdp3.m alone.
"""

from __future__ import annotations

import os
import shutil
import sys

import numpy as np
import pytest

from mfo_backend.metrics.judges.hdr_vdp import hdr_vdp_q_jods
from mfo_backend.metrics.judges.hdr_vdp_program import is_configured
from mfo_backend.types.errors import BadInputError, SetupError

STAND_IN = f"""#!{sys.executable}
import os, sys
from pathlib import Path
import numpy as np
job = Path(os.environ["MFO_HDRVDP3_JOB"])
assert sys.argv[-1].endswith("hdr_vdp_driver.m") and Path(sys.argv[-1]).is_file()
assert Path(os.environ["MFO_HDRVDP3"], "hdrvdp3.m").is_file()
assert Path.cwd().samefile(job)  # what Octave leaves behind goes with it
width, height, count, ppd = (job / "pairs.txt").read_text().split()
pixels = np.fromfile(job / "pairs.raw", "<f4").reshape(int(count), 2, int(height), int(width), 3)
with (job / "scores.txt").open("w") as file:
    for reference, test in pixels:
        file.write(f"{{10 - np.abs(reference - test).mean()}}\\n")
with open(os.environ["RUNS"], "a") as runs:
    runs.write(ppd + "\\n")
"""
FUNCTION = """function result = hdrvdp3(task, test, reference, encoding, ppd, options)
  assert(strcmp(task, 'quality') && strcmp(encoding, 'rgb-bt.709') && isa(test, 'double'));
  weight = reshape([1 2 4], [1 1 3]) .* (1:size(test, 1))' .* (1:size(test, 2));
  result.Q_JOD = sum(weight(:) .* test(:)) - 0.5 * sum(weight(:) .* reference(:)) + ppd;
end
"""
posix = pytest.mark.skipif(os.name == "nt", reason="the stand-in is a script with a first line that names Python")


@pytest.fixture
def set_up(tmp_path, monkeypatch):
    """A folder with an hdrvdp3.m and a path with one program; the text of the program is the argument."""

    def prepare(script, name="octave-cli"):
        code, programs = tmp_path / "hdr vdp's code", tmp_path / "programs"
        for folder in (code, programs):
            folder.mkdir(exist_ok=True)
        (code / "hdrvdp3.m").write_text(FUNCTION, "utf-8")
        (programs / name).write_text(script, "utf-8")
        (programs / name).chmod(0o755)
        monkeypatch.setenv("MFO_HDRVDP3", str(code))
        monkeypatch.setenv("PATH", str(programs))
        monkeypatch.setenv("RUNS", str(tmp_path / "runs.txt"))
        return tmp_path / "runs.txt"

    return prepare


def pictures(count, shape=(5, 7, 3)):
    return np.random.default_rng(0).uniform(0, 3, (count, 2, *shape)).astype(np.float32)


@posix
def test_many_pairs_are_one_run(set_up):
    runs = set_up(STAND_IN)
    pairs = pictures(4)
    scores = hdr_vdp_q_jods(((a, b) for a, b in pairs), 45.0)
    assert scores == pytest.approx(10 - np.abs(pairs[:, 0] - pairs[:, 1]).mean((1, 2, 3)), abs=1e-6)  # printed float32
    assert runs.read_text().split() == ["45"]
    assert hdr_vdp_q_jods([]) == []


def _octave():
    found = shutil.which("octave-cli") or shutil.which("octave")
    return found if found and os.environ.get("MFO_TEST_OCTAVE") else None


@pytest.mark.skipif(_octave() is None, reason="set MFO_TEST_OCTAVE=1 where octave is on the path")
def test_the_driver_hands_pictures_over_the_right_way_round(tmp_path, monkeypatch):
    (tmp_path / "hdrvdp3.m").write_text(FUNCTION, "utf-8")
    monkeypatch.setenv("MFO_HDRVDP3", str(tmp_path))
    pairs = pictures(3)
    weight = np.arange(1, 6)[:, None, None] * np.arange(1, 8)[:, None] * np.array([1, 2, 4])
    expected = [(weight * (test - 0.5 * reference.astype(np.float64))).sum() + 67.02 for reference, test in pairs]
    # nine digits are printed
    assert hdr_vdp_q_jods([(a, b) for a, b in pairs], 67.02) == pytest.approx(expected, rel=1e-8)


@posix
@pytest.mark.parametrize(
    ("script", "sentence"),
    [
        ("#!/bin/sh\necho w >&2\necho error: no package >&2\nexit 1\n", "0 scores for 2 pairs .error: no package"),
        ("#!/bin/sh\nexit 0\n", "0 scores for 2 pairs .it said nothing"),
        ('#!/bin/sh\necho 9.5 > "$MFO_HDRVDP3_JOB/scores.txt"\n', "1 scores for 2 pairs"),
        ('#!/bin/sh\nprintf "9.5\\nlow\\n" > "$MFO_HDRVDP3_JOB/scores.txt"\n', "0 scores for 2 pairs"),
        ("#!/no/such/interpreter\n", "cannot be started"),
    ],
)  # fmt: skip
def test_a_failed_run_says_why(set_up, script, sentence):
    set_up(script)
    with pytest.raises(SetupError, match=sentence):
        hdr_vdp_q_jods(list(pictures(2)))


@posix
def test_octaves_failure_while_it_ends_does_no_harm(set_up):
    set_up('#!/bin/sh\necho 9.5 > "$MFO_HDRVDP3_JOB/scores.txt"\necho "error: ignoring const exception" >&2\nexit 1\n')
    assert hdr_vdp_q_jods(list(pictures(1))) == [9.5]


@posix
def test_matlab_is_started_by_the_drivers_name(set_up):
    set_up('#!/bin/sh\n[ "$1" = -batch ] && [ -f "$2.m" ] && echo 8 > "$MFO_HDRVDP3_JOB/scores.txt"\n', "matlab")
    assert hdr_vdp_q_jods(list(pictures(1))) == [8]


def test_what_is_missing_is_named(tmp_path, monkeypatch):
    monkeypatch.delenv("MFO_HDRVDP3", raising=False)
    assert not is_configured()
    with pytest.raises(SetupError, match="let MFO_HDRVDP3 name the folder that holds hdrvdp3"):
        hdr_vdp_q_jods([])
    monkeypatch.setenv("MFO_HDRVDP3", str(tmp_path))
    with pytest.raises(SetupError, match="which holds no hdrvdp3"):
        hdr_vdp_q_jods([])
    (tmp_path / "hdrvdp3.m").write_text("", "utf-8")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SetupError, match="install the packages octave, octave-image and octave-statistics"):
        hdr_vdp_q_jods([])


@posix
def test_pairs_of_other_sizes_and_bad_pixels_are_refused(set_up):
    set_up(STAND_IN)
    a, b = pictures(1)[0]
    with pytest.raises(BadInputError, match="The test image is 7x4"):
        hdr_vdp_q_jods([(a, b[:4])])
    with pytest.raises(BadInputError, match="give pairs of one size"):
        hdr_vdp_q_jods([(a, b), (a[:4], b[:4])])
    with pytest.raises(BadInputError, match="The test image has 35 pixels with NaN"):
        hdr_vdp_q_jods([(a, b * np.nan)])


@pytest.mark.skipif(not is_configured(), reason="MFO_HDRVDP3 names no copy of HDR-VDP-3")
def test_the_original(lit_ball):
    """It sees a highlight get wider and does not see a hue; equal pictures have 10 (formula of its quality task)."""
    reference = lit_ball()
    equal, wide, wider, red = hdr_vdp_q_jods(
        (reference, test) for test in (reference, lit_ball(width=0.04), lit_ball(width=0.08), lit_ball(hue=1.1))
    )
    assert equal == pytest.approx(10, abs=1e-6)
    assert equal > wide > wider
    assert red > 9.9
