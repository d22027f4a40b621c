# SPDX-License-Identifier: Apache-2.0
"""result.json: the outcome of a job, written once; partial.json until then. Keys: `docs/reference/job_folder.md`."""

from __future__ import annotations

import contextlib
import json
import platform
from collections.abc import Sequence
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ... import __version__
from ...types.result import FitResult, PictureResult
from ...types.status import Status
from ...types.verdict import Judgement
from ..folder.atomic_file import write_atomically
from ..folder.job_folder import JobFolder
from .progress import finite

SCHEMA_VERSION = 1


def write_result(folder: JobFolder, content: dict[str, Any]) -> None:
    """Write result.json by rename, so that it is complete when it exists, and remove partial.json.

    Raises
    ------
    OSError
        If the folder cannot be written or the disk is full.
    """
    write_atomically(folder.result, _encoded(content))
    with contextlib.suppress(OSError):  # nobody reads it beside a result
        folder.partial.unlink(missing_ok=True)


def write_partial(folder: JobFolder, best: FitResult, *, notes: Sequence[str] = ()) -> None:
    """Write partial.json by rename: what is left of a fit whose process is killed. A full disk does not end the fit."""
    with contextlib.suppress(OSError):
        write_atomically(folder.partial, _encoded(result_to_json(best, notes=notes) | {"partial": True}))


def _encoded(content: dict[str, Any]) -> bytes:
    return json.dumps(finite(content), indent=1, ensure_ascii=False, allow_nan=False).encode("utf-8")


def result_to_json(result: FitResult, *, notes: Sequence[str] = (), variant: str = "") -> dict[str, Any]:
    """The JSON form of a result; colours are linear Rec.709."""
    return {
        "schema_version": SCHEMA_VERSION,
        "status": result.status.value,
        "sentence": result.message,
        **_verdict(result.judgement),
        "model": result.model,
        "shader": result.shader,
        "labels": result.labels,
        "partial": result.status is Status.CANCELLED,
        "initial": result.initial,
        "recovered": result.recovered,
        "bounds": result.bounds,
        "errors": result.errors,
        "certainty": {
            n: {"sd": c.sd, "level": c.level.value, "along": c.along, "words": c.words}
            for n, c in result.certainty.items()
        },
        "weak_combinations": [
            {"parameters": w.parameters, "step": w.step, "sentence": w.sentence} for w in result.weak_combinations
        ],
        **({"next_picture": asdict(result.next_picture)} if result.next_picture is not None else {}),
        **({"contradiction": asdict(result.contradiction)} if result.contradiction is not None else {}),
        **({"pictures": [_picture(picture) for picture in result.pictures]} if result.pictures else {}),
        "stages": [
            {
                "name": stage.name,
                "status": stage.status.value,
                "sentence": stage.status.sentence,
                "iterations": stage.iterations,
                "loss_start": stage.loss_start,
                "loss_best": stage.loss_best,
                "seconds": stage.seconds,
                "values": stage.values,
                "curve": [[p.iteration, p.loss, p.best, p.seconds, p.passes] for p in stage.curve],
            }
            for stage in result.stages
        ],
        "model_gap": asdict(result.model_gap) if result.model_gap is not None else None,
        "seconds": result.seconds,
        "passes": result.passes,
        "notes": [*notes, *result.notes],
        "versions": versions(variant),
    }


def _picture(picture: PictureResult) -> dict[str, Any]:
    """One of several pictures: its errors and its verdict."""
    return {"errors": picture.errors, **_verdict(picture.judgement)}


def _verdict(judgement: Judgement | None) -> dict[str, Any]:
    """Verdict, its sentence, its likely cause and what it rests on; nulls where there is none."""
    if judgement is None:
        return {"verdict": None, "verdict_sentence": "", "verdict_cause": None, "difference": None}
    around = judgement.around
    return {
        "verdict": judgement.verdict.value,
        "verdict_sentence": judgement.sentence,
        "verdict_cause": judgement.cause.value if judgement.cause is not None else None,
        "difference": {
            "target": asdict(judgement.target),
            "around": asdict(around) if around is not None else None,
        },
    }


def versions(variant: str = "") -> dict[str, str]:
    """What computed the result: packages, Python, platform and, if known, the Mitsuba variant."""
    found = {"mfo_backend": __version__, **_installed()}
    found |= {"python": platform.python_version(), "platform": f"{platform.system()} {platform.machine()}"}
    return found | ({"variant": variant} if variant else {})


@cache  # it reads files, and partial.json is written every second
def _installed() -> dict[str, str]:
    found = {}
    for package in ("mitsuba", "drjit", "numpy"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
