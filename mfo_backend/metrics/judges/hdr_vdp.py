# SPDX-License-Identifier: Apache-2.0
"""HDR-VDP-3's Q_JOD by the user's copy of the original code, run by GNU Octave or MATLAB.

References
----------
Mantiuk, Hammou and Hanji, "HDR-VDP-3: A multi-metric for predicting image differences, quality and contrast
distortions in high dynamic range and regular content", arXiv 2304.13625. It does not see differences of hue.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...render.machine.temporary_folder import temporary_folder
from ...types.errors import BadInputError, SetupError
from ..flip.flip_filters import DEFAULT_PIXELS_PER_DEGREE
from ..pixels.pixel_check import check_pair
from .hdr_vdp_program import FOLDER_VARIABLE, find_code, find_program

Array = NDArray[np.floating]

_DRIVER = Path(__file__).with_name("hdr_vdp_driver.m")
# seconds: a slow start, and some ten times what Octave 7.3 takes for a pixel on one core
_START_SECONDS, _SECONDS_PER_PIXEL = 120.0, 1e-4


def hdr_vdp_q_jods(
    pairs: Iterable[tuple[Array, Array]], pixels_per_degree: float = DEFAULT_PIXELS_PER_DEGREE
) -> list[float]:
    """Q_JOD of each pair (reference, test) in one run of the program; 10 is no difference.

    Parameters
    ----------
    pairs
        Linear Rec.709 in cd/m^2, (height, width, 3), all of one size.
    pixels_per_degree
        Pixels in a degree of visual angle.

    Raises
    ------
    SetupError
        If HDR-VDP-3 or a program to run it is missing, or the run fails.
    BadInputError
        For pictures of different size or with NaN or infinite pixels.
    """
    folder, program = find_code(), find_program()
    with temporary_folder("hdrvdp") as job:
        shape, count = _write_pairs(job / "pairs.raw", pairs)
        if count == 0:
            return []
        height, width = shape[:2]
        (job / "pairs.txt").write_text(f"{width} {height} {count} {pixels_per_degree:.17g}\n", "ascii")
        told = _run(program, folder, job, _START_SECONDS + _SECONDS_PER_PIXEL * width * height * count)
        return _read_scores(job / "scores.txt", count, told)


def _write_pairs(path: Path, pairs: Iterable[tuple[Array, Array]]) -> tuple[tuple[int, ...], int]:
    shape: tuple[int, ...] = ()
    count = 0
    with path.open("wb") as file:
        for reference, test in pairs:
            check_pair(reference, test)
            if count and reference.shape != shape:
                raise BadInputError(f"The pairs have sizes {shape} and {reference.shape}: give pairs of one size.")
            shape, count = reference.shape, count + 1
            for picture in (reference, test):
                file.write(np.ascontiguousarray(np.maximum(picture, 0), dtype="<f4").tobytes())
    return shape, count


def _run(program: str, folder: Path, job: Path, seconds: float) -> str:
    """What the program said. Whether it did its work is told by the scores: Octave may fail while it ends."""
    if Path(program).stem.lower() == "matlab":
        command, working = [program, "-batch", _DRIVER.stem], _DRIVER.parent
    else:  # Octave that is ended from outside writes all its variables into the working folder
        working = job
        command = [program, "--no-gui", "--quiet", str(_DRIVER)]
    environment = {**os.environ, FOLDER_VARIABLE: str(folder), f"{FOLDER_VARIABLE}_JOB": str(job)}
    try:
        done = subprocess.run(
            command,
            cwd=working,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=seconds,
        )
    except subprocess.TimeoutExpired:
        raise SetupError(f"HDR-VDP-3 did not answer within {seconds:.0f} seconds: compare smaller pictures.") from None
    except OSError as error:
        raise SetupError(f"{program} cannot be started ({error.strerror or error}): install it again.") from None
    return done.stderr + done.stdout


def _read_scores(path: Path, count: int, told: str) -> list[float]:
    try:
        scores = [float(line) for line in path.read_text("ascii").split()]
    except (OSError, ValueError):
        scores = []
    if len(scores) != count:
        reasons = [line for line in told.splitlines() if line.startswith("error:")] or told.strip().splitlines()
        reason = reasons[0].strip() if reasons else "it said nothing"
        raise SetupError(
            f"HDR-VDP-3 gave {len(scores)} scores for {count} pairs ({reason}): "
            "check the program's packages image and statistics."
        )
    return scores
