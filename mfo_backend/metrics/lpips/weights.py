# SPDX-License-Identifier: Apache-2.0
"""Weights of LPIPS: the heads out of the package `lpips`, the networks from the user's folder or torch's cache."""

from __future__ import annotations

import hashlib
import importlib.util
import re
import sys
from pathlib import Path
from typing import Any

import torch  # pyright: ignore[reportMissingImports]

from ...types.errors import BadInputError, SetupError
from ..judges.packages import LPIPS
from .trunks import CHANNELS, Trunk
from .weight_files import FOLDER_VARIABLE, TRUNK_FILES, find_weights, weight_folders


def load_trunk(net: str) -> Trunk:
    """Network `net` (``alex``, ``vgg`` or ``squeeze``) with its published weights, frozen.

    Raises
    ------
    SetupError
        If its file is in no folder that is searched.
    BadInputError
        If the file is not that of the network.
    """
    path = _find_trunk(net)
    _check_digest(path)
    states = {name: value for name, value in _load(path).items() if name.startswith("features.")}
    trunk = Trunk(net)
    try:
        trunk.load_state_dict(states)
    except RuntimeError as error:
        raise BadInputError(
            f"{path} does not hold the weights of LPIPS's network {net!r} "
            f"({' '.join(str(error).split())[:200]}): replace it by {TRUNK_FILES[net][0]} of torchvision."
        ) from None
    return trunk.eval().requires_grad_(False)


def load_heads(net: str) -> list[Any]:
    """The weight of each channel of each feature map, tensors (1, channels, 1, 1), version 0.1.

    Raises
    ------
    SetupError
        If the package lpips is not installed.
    """
    found = importlib.util.find_spec("lpips")  # importing it would import torchvision
    if found is None or not found.submodule_search_locations:
        raise SetupError(f'LPIPS is not installed: run "{sys.executable}" -m pip install "{LPIPS}".')
    states = _load(Path(found.submodule_search_locations[0]) / "weights" / "v0.1" / f"{net}.pth")
    heads = [states[f"lin{index}.model.1.weight"] for index in range(len(CHANNELS[net]))]
    if [head.shape[1] for head in heads] != list(CHANNELS[net]):
        raise SetupError(f'The heads of LPIPS are damaged: run "{sys.executable}" -m pip install --force "{LPIPS}".')
    return heads


def _find_trunk(net: str) -> Path:
    path = find_weights(net)
    if path is None:
        raise SetupError(
            f"LPIPS ({net}) needs the weights of its network, which are not part of this program: put torchvision's "
            f"{TRUNK_FILES[net][0]} into {weight_folders()[0]}, or into a folder that {FOLDER_VARIABLE} names."
        )
    return path


def _check_digest(path: Path) -> None:
    expected = re.search(r"-([0-9a-f]{8})\.pth$", path.name)
    if expected is None:
        return
    with path.open("rb") as file:
        digest = hashlib.sha256()
        while block := file.read(1 << 20):
            digest.update(block)
    if not digest.hexdigest().startswith(expected[1]):
        raise BadInputError(f"{path} is damaged (its SHA-256 does not begin with {expected[1]}): fetch it again.")


def _load(path: Path) -> dict[str, Any]:
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # of many classes, for every way in which a file is not one of torch
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise BadInputError(f"{path} cannot be read as weights ({reason}): replace it.") from None
