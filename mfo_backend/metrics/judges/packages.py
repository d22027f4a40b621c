# SPDX-License-Identifier: Apache-2.0
"""The optional packages of the extra `judges`, imported when they are needed and not before."""

from __future__ import annotations

import importlib
import logging
import sys
import types
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ...types.errors import SetupError

CVVDP = "cvvdp==0.5.7"  # another release may score differently
LPIPS = "lpips==0.1.4"


def require_torch(what: str, requirement: str) -> Any:
    """The module torch, for `what`, which comes with it when `requirement` is installed.

    Raises
    ------
    SetupError
        If it is not installed or does not load.
    """
    return _require("torch", what, requirement)


def require_pycvvdp() -> Any:
    """The module of ColorVideoVDP.

    Raises
    ------
    SetupError
        If it, or a package it needs, is not installed or does not load.
    """
    require_torch("ColorVideoVDP", CVVDP)
    if "pycvvdp" in sys.modules:
        return sys.modules["pycvvdp"]
    if _loads("torchvision.ops") and _loads("torchvision.transforms"):
        return _require("pycvvdp", "ColorVideoVDP", CVVDP)
    with _torchvision_stand_in():
        return _require("pycvvdp", "ColorVideoVDP", CVVDP)


def _require(module: str, what: str, requirement: str) -> Any:
    level = logging.root.level
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module(module)
    except (ImportError, OSError, RuntimeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SetupError(
            f'{what} cannot be imported ({reason}): run "{sys.executable}" -m pip install "{requirement}".'
        ) from None
    finally:
        logging.root.setLevel(level)


def _loads(module: str) -> bool:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            importlib.import_module(module)
    except (ImportError, OSError, RuntimeError, AttributeError):
        return False
    return True


@contextmanager
def _torchvision_stand_in() -> Iterator[None]:
    """The two names ColorVideoVDP imports from torchvision, for as long as it is being imported.

    torchvision loads only beside the very build of torch it was compiled for ("operator torchvision::nms does not
    exist"), which a CPU build often is not. ColorVideoVDP needs one blur of it; MLP belongs to its learned variants.
    """
    from .gaussian_blur import GaussianBlur

    broken = {name: sys.modules.pop(name) for name in list(sys.modules) if name.split(".")[0] == "torchvision"}
    package, transforms, ops = (types.ModuleType(f"torchvision{end}") for end in ("", ".transforms", ".ops"))
    transforms.GaussianBlur = GaussianBlur  # type: ignore[attr-defined]
    ops.MLP = _Missing  # type: ignore[attr-defined]
    package.transforms, package.ops = transforms, ops  # type: ignore[attr-defined]
    stand_ins = {module.__name__: module for module in (package, transforms, ops)}
    sys.modules.update(stand_ins)
    try:
        yield
    finally:
        for name in stand_ins:
            sys.modules.pop(name, None)
        sys.modules.update(broken)


class _Missing:
    """In place of a class of torchvision that ColorVideoVDP itself does not use."""

    def __init__(self, *_: object, **__: object) -> None:
        raise SetupError("This variant of ColorVideoVDP needs torchvision: install the build that matches torch.")
