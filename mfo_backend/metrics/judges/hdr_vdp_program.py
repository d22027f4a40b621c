# SPDX-License-Identifier: Apache-2.0
"""Where the user's copy of HDR-VDP-3 and the program that runs it are. Without numpy, so that `mfo doctor` can ask."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from ...types.errors import SetupError

FOLDER_VARIABLE = "MFO_HDRVDP3"
_PROGRAMS = ("octave-cli", "octave", "matlab")  # the first one on the path runs


def is_configured() -> bool:
    """Whether the user has named a copy of HDR-VDP-3."""
    return bool(os.environ.get(FOLDER_VARIABLE))


def find_code() -> Path:
    """The user's folder with hdrvdp3.m, or `SetupError`."""
    chosen = os.environ.get(FOLDER_VARIABLE)
    if not chosen:
        raise SetupError(
            f"HDR-VDP-3 is not set up: fetch its code from hdrvdp.sourceforge.net and let {FOLDER_VARIABLE} name the "
            "folder that holds hdrvdp3.m."
        )
    folder = Path(chosen).absolute()
    if not (folder / "hdrvdp3.m").is_file():
        raise SetupError(f"{FOLDER_VARIABLE} names {chosen!r}, which holds no hdrvdp3.m: name the folder that does.")
    return folder


def find_program() -> str:
    """The program that runs HDR-VDP-3, or `SetupError`."""
    for name in _PROGRAMS:
        found = shutil.which(name)
        if found is not None:
            return found
    raise SetupError(
        "HDR-VDP-3 runs in GNU Octave or MATLAB and neither is on the path: "
        "install the packages octave, octave-image and octave-statistics."
    )
