# SPDX-License-Identifier: GPL-3.0-or-later
"""request.json and result.json as the add-on needs them, checked. No bpy here."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

SCHEMA_VERSION = 1
LARGEST_FILE = 1 << 26  # bytes; the curves of a long fit take 1 MB
LARGEST_NUMBER = 3.4e38  # of the float32 that a socket holds
Value = float | tuple[float, ...]
_SIGMAS = 2.0  # standard deviations to each side, 95 of 100 of a normal distribution
_UNSURE = ("not_visible", "not_told_apart", "doubtful")  # levels whose spread is not the whole of what is unknown


class JobResultError(Exception):
    """A job folder without a usable result; the message is one sentence for the user."""


@dataclass(frozen=True)
class PastPicture:
    """One of the pictures of a fit of several: what it is called, its verdict, its FLIP, and its folder."""

    label: str
    verdict: str
    flip: tuple[float, float]
    folder: Path


@dataclass(frozen=True)
class NextPicture:
    """What a result proposes; the fields are those of `next_picture` in result.json."""

    sentence: str
    turn: float
    center: tuple[float, ...]
    camera: str = ""
    light: str = ""
    light_turn: float = 0.0


@dataclass(frozen=True)
class JobResult:
    """The outcome of a fit; values by parameter name of `model`, colours linear Rec.709, errors (start, result).

    `certainty` holds the levels of `docs/reference/job_folder.md` by parameter name, where the preset finds them out,
    and `certainty_words` what a user reads of them. `verdict` is same, close, different, or empty where there is none.
    """

    folder: Path
    object_name: str
    material_name: str
    sockets_start: Mapping[str, Value]
    status: str
    sentence: str
    partial: bool
    model: str
    initial: Mapping[str, Value]
    recovered: Mapping[str, Value]
    errors: Mapping[str, tuple[float, float]]
    certainty: Mapping[str, str]
    notes: tuple[str, ...]
    seconds: float
    weak_combinations: tuple[str, ...] = ()  # sentences on values that can be traded against each other
    verdict: str = ""
    certainty_words: Mapping[str, str] = field(default_factory=dict)
    image: tuple[int, int] = (0, 0)  # width and height of the job's pictures
    frame: Mapping[str, int] = field(default_factory=dict)  # of which they show a part: width, height, left and top
    spread: Mapping[str, float] = field(default_factory=dict)  # standard deviation, of a colour's least sure channel
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # what the fit could have chosen
    pictures: tuple[PastPicture, ...] = ()  # of a fit of several
    next_picture: NextPicture | None = None  # that would tell more
    leaf: str = ""  # the name of the fitted shader node, after the groups it lies in; empty where that is not known
    labels: Mapping[str, str] = field(default_factory=dict)  # what it calls values, where it has another name for them

    def likely(self, name: str, value: float) -> tuple[float, float] | None:
        """The range that holds a value in 95 of 100 cases, None where it is not known."""
        if name not in self.spread or name not in self.bounds:
            return None
        low, high = self.bounds[name]
        return max(low, value - _SIGMAS * self.spread[name]), min(high, value + _SIGMAS * self.spread[name])

    def sureness(self, name: str) -> float:
        """How much of what the fit could have chosen the picture rules out, 0 to 1; negative where it is not known."""
        if self.certainty.get(name) in _UNSURE:
            return 0.0
        if name not in self.spread or name not in self.bounds:
            return -1.0
        low, high = self.bounds[name]
        return min(max(1.0 - 2.0 * _SIGMAS * self.spread[name] / max(high - low, 1e-9), 0.0), 1.0)


def must_ask(verdict: str) -> bool:
    """Whether a result of this verdict goes onto its material only if that is asked for explicitly."""
    return verdict == "different"


def result_folders(folder: Path) -> list[Path]:
    """The folders with one material's result each: the job's own, or those of the materials fitted together.

    Raises
    ------
    JobResultError
        If a file is missing or damaged.
    """
    if not (folder / "result.json").is_file():
        return [folder]  # reading it says why there is none
    listed = _read_json(folder / "result.json").get("materials")
    if not listed:
        return [folder]
    try:
        found = [(folder / str(one["folder"])).resolve() for one in listed]
    except (KeyError, TypeError) as error:
        raise JobResultError(f"{folder / 'result.json'} is damaged ({error}): run the fit again.") from error
    if not all(path.is_relative_to(folder.resolve()) for path in found):
        raise JobResultError(f"{folder / 'result.json'} names a folder outside of the job: run the fit again.")
    return found


def whole_job(folder: Path) -> Path:
    """The job that a result belongs to: its own folder, or that of the materials it was fitted together with."""
    outer = folder.parent.parent
    if folder.parent.name != "targets" or not (outer / "result.json").is_file():
        return folder
    return outer if folder.resolve() in result_folders(outer) else folder


def read_job_result(folder: Path) -> JobResult:
    """The result in a job folder together with what its request says about the target.

    Raises
    ------
    JobResultError
        If a file is missing, unreadable, of another schema version, or holds something else than numbers.
    """
    if not (folder / "result.json").is_file():
        raise JobResultError(
            f"There is no result in {folder}: run the fit first, or give the folder of a finished job."
        )
    request, result = _read_json(folder / "request.json"), _read_json(folder / "result.json")
    try:
        target = request["target"]
        material = request.get("materials", {}).get(target.get("bsdf_id"), {})
        origin = request.get("generator", {}).get("origin", (0.0, 0.0, 0.0))
        sockets = {k: _value(s["value"]) for k, s in material.get("sockets", {}).items() if s.get("value") is not None}
        return JobResult(
            folder=folder,
            object_name=str(target.get("object", "")),
            material_name=str(target.get("material", "")),
            sockets_start=sockets,
            status=str(result["status"]),
            sentence=str(result.get("sentence", "")),
            partial=bool(result.get("partial", False)),
            model=str(result["model"]),
            initial={str(k): _value(v) for k, v in result.get("initial", {}).items()},
            recovered={str(k): _value(v) for k, v in result["recovered"].items()},
            errors={str(k): (float(a), float(b)) for k, (a, b) in result.get("errors", {}).items()},
            certainty={str(k): str(c["level"]) for k, c in result.get("certainty", {}).items()},
            certainty_words={str(k): str(c.get("words", "")) for k, c in result.get("certainty", {}).items()},
            verdict=str(result.get("verdict") or ""),
            notes=tuple(map(str, result.get("notes", ()))),
            seconds=float(result.get("seconds", 0.0)),
            weak_combinations=tuple(str(c["sentence"]) for c in result.get("weak_combinations", ())),
            spread={str(k): _spread(c["sd"]) for k, c in result.get("certainty", {}).items() if c.get("sd")},
            bounds={str(k): (float(a), float(b)) for k, (a, b) in (result.get("bounds") or {}).items()},
            leaf="/".join(map(str, target.get("node", ()))),
            labels={str(k): str(v) for k, v in target.get("labels", {}).items()},
            pictures=tuple(_picture(folder, p) for p in result.get("pictures", ())),
            next_picture=_next_picture(result.get("next_picture"), origin),
            image=(int(request.get("image", {}).get("width", 0)), int(request.get("image", {}).get("height", 0))),
            frame={str(k): int(v) for k, v in (request.get("image", {}).get("frame") or {}).items()},
        )
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise JobResultError(
            f"The files of the job in {folder} are damaged ({type(error).__name__}: {error}): run the fit again."
        ) from error


def _read_json(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise ValueError(f"it is larger than {LARGEST_FILE >> 20} MB")
        data = json.loads(content.decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise JobResultError(f"{path} cannot be read ({error}): run the fit again.") from error
    if not isinstance(data, dict) or data.get("schema_version") != SCHEMA_VERSION:
        version = data.get("schema_version") if isinstance(data, dict) else None
        raise JobResultError(
            f"{path} has schema_version {version!r} and this add-on reads {SCHEMA_VERSION}: run the fit again."
        )
    return data


def _picture(folder: Path, data: dict[str, Any]) -> PastPicture:
    before, after = data["errors"]["flip"]
    name = f"{int(data['number'])} {data.get('name', '')}".strip()
    inner = (folder / str(data.get("folder", "."))).resolve()
    if not inner.is_relative_to(whole_job(folder).resolve()):
        raise ValueError(f"picture {name} is outside of the job")
    return PastPicture(name, str(data.get("verdict") or ""), (float(before), float(after)), inner)


def _next_picture(data: Mapping[str, Any] | None, origin: Sequence[Any]) -> NextPicture | None:
    """What is proposed; its center counts from the `origin` of the exported scene."""
    if not data:
        return None
    center = tuple(float(v) + float(o) for v, o in zip(data["center"], origin, strict=True))
    turns = float(data["turn"]), float(data.get("light_turn", 0.0))
    if len(center) != 3 or not all(map(math.isfinite, (*turns, *center))):
        raise ValueError("the proposed camera is no place")
    names = str(data.get("camera", "")), str(data.get("light", ""))
    return NextPicture(str(data["sentence"]), turns[0], center, *names, turns[1])


def _spread(deviations: list[Any]) -> float:
    """The largest of a value's standard deviations; JSON has null for what is infinite."""
    return max(math.inf if sd is None else float(sd) for sd in deviations)


def _value(data: Any) -> Value:
    given = data if isinstance(data, list) else [data]
    numbers = tuple(float(v) for v in given)
    if not 1 <= len(numbers) <= 4 or any(isinstance(v, str) for v in given):
        raise ValueError(f"{str(data)[:60]} is no value of a socket")
    if not all(math.isfinite(v) and abs(v) <= LARGEST_NUMBER for v in numbers):
        raise ValueError(f"{str(data)[:60]} is not finite")
    return numbers if isinstance(data, list) else numbers[0]
