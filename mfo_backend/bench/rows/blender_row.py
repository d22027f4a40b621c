# SPDX-License-Identifier: Apache-2.0
"""Rows of fits that go the artist's way, from a .blend file to values that Cycles renders (`studies.bench`)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from ...types.errors import BadInputError

BLENDER_ROWS = "blender.jsonl"
WRONG = 0.05  # FLIP above the noise from which on a result must not be called the same


@dataclass(frozen=True)
class BlenderRow:
    """What one fit of a scene built in Blender came to.

    Attributes
    ----------
    scenario, scene
        A name of `studies.bench` and the number from which truth and start are drawn.
    case
        What the scene is, in a few words.
    verdict
        ``"same"``, ``"close"`` or ``"different"``; empty where the run failed.
    flip, floor, start
        Mean FLIP over the target between the reference and a picture by Cycles: of the fitted file, of the true file
        with other noise, of the file before the fit. None where the run failed or does not know.
    seconds
        Of the clock, for the fit with its export where the scenario counts it.
    determined, wrong
        How many values the fit calls determined, and how many of them are off by more than three of their deviations
        and by more than a fiftieth of their range.
    commit
        Of the sources that ran.
    error
        The sentence of a run that failed, else empty.
    """

    scenario: str
    scene: int
    case: str
    verdict: str = ""
    flip: float | None = None
    floor: float | None = None
    start: float | None = None
    seconds: float | None = None
    determined: int = 0
    wrong: int = 0
    commit: str = ""
    error: str = ""

    @property
    def excess(self) -> float:
        """FLIP above that of the noise; infinite where the run failed."""
        return float("inf") if self.flip is None or self.floor is None else self.flip - self.floor


_FIELDS = {field.name for field in fields(BlenderRow)}


def read_blender_rows(folder: Path) -> list[BlenderRow]:
    """The rows in a bench folder; an unfinished last line is none.

    Raises
    ------
    BadInputError
        If a whole line is no row.
    """
    path = folder / BLENDER_ROWS
    if not path.is_file():
        return []
    text = path.read_text("utf-8")
    try:
        lines: Sequence[dict[str, Any]] = [json.loads(line) for line in text[: text.rfind("\n") + 1].splitlines()]
        return [BlenderRow(**{key: value for key, value in line.items() if key in _FIELDS}) for line in lines]
    except (ValueError, TypeError) as error:
        raise BadInputError(f"{path} holds a line that is no row: remove it ({error!r}).") from None


def add_blender_row(folder: Path, row: BlenderRow) -> None:
    """Append a row."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / BLENDER_ROWS).open("a", encoding="utf-8") as file:
        file.write(json.dumps(asdict(row)) + "\n")
