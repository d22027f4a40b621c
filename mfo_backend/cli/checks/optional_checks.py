# SPDX-License-Identifier: Apache-2.0
"""What is optional on a machine: the judges of `mfo compare` and the losses that need packages or weights."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ...metrics.judges.hdr_vdp_program import FOLDER_VARIABLE, find_code, find_program
from ...metrics.judges.packages import CVVDP, LPIPS
from ...metrics.lpips.weight_files import TRUNK_FILES, find_weights, weight_folders
from ...types.errors import SetupError
from .check import Check

_PACKAGES = (*(requirement.split("==")[0] for requirement in (CVVDP, LPIPS)), "torch")


def check_optional() -> Iterator[Check]:
    """All checks; what is missing is no problem, what does not fit is a warning."""
    yield _judges()
    yield _weights()
    yield _octave()
    yield _hdr_vdp()


def _judges() -> Check:
    install = f'"{sys.executable}" -m pip install "mfo-backend[judges]"'
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            told = f"{name} is not installed; optional, for ColorVideoVDP and LPIPS: run {install}"
            return Check("judges", "ok", told)
    listed = ", ".join(f"{name} {number}" for name, number in found.items())
    for requirement in (CVVDP, LPIPS):
        name, needed = requirement.split("==")
        if found[name] != needed:
            return Check("judges", "warning", listed, f"Another release scores differently: run {install}.")
    return Check("judges", "ok", listed)


def _weights() -> Check:
    found = {net: find_weights(net) for net in TRUNK_FILES}
    present = [f"{net} in {path}" for net, path in found.items() if path is not None]
    if present:
        return Check("LPIPS weights", "ok", ", ".join(present))
    told = f"none; optional, put torchvision's {TRUNK_FILES['alex'][0]} into {weight_folders()[0]}"
    return Check("LPIPS weights", "ok", told)


def _octave() -> Check:
    try:
        return Check("Octave or MATLAB", "ok", find_program())
    except SetupError:
        return Check("Octave or MATLAB", "ok", "not on the path; optional, for HDR-VDP-3")


def _hdr_vdp() -> Check:
    chosen = os.environ.get(FOLDER_VARIABLE)
    if not chosen:
        return Check("HDR-VDP-3", "ok", f"{FOLDER_VARIABLE} is not set; optional, it names the user's own copy")
    try:
        return Check("HDR-VDP-3", "ok", str(Path(find_code())))
    except SetupError as error:
        return Check("HDR-VDP-3", "warning", f"no hdrvdp3.m in {chosen}", str(error))
