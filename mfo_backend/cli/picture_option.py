# SPDX-License-Identifier: Apache-2.0
"""`--reference PATH@frame=1,camera=Side`: a picture and what of the .blend file it shows."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from ..job.folder.picture_part import PicturePart, part_to_json
from ..types.errors import BadInputError

KEYS = ("frame", "camera", "scene", "layer", "exposure")
HELP = (
    "the picture: EXR, HDR, PNG, JPEG or TIFF; once for each of several. PATH@KEY=VALUE,... says what of the file it "
    f"shows: {', '.join(KEYS)} (stops)"
)
_PAIR = re.compile(r"([A-Za-z_]+)=(.*)", re.DOTALL)


@dataclass(frozen=True)
class PictureOption:
    """One picture as the fields of the add-on's `PictureSetup`, which has the defaults."""

    reference: str
    number: int
    frame: int | None = None
    camera: str = ""
    scene: str = ""
    view_layer: str = ""
    exposure: float = 0.0
    part: Mapping[str, Any] = field(default_factory=dict)  # what of it counts, as request.json says it

    def fields(self) -> dict[str, Any]:
        """The fields as JSON."""
        return asdict(self)


def picture_option(text: str, number: int) -> PictureOption:
    """The picture that an option names; an @ that no KEY=VALUE follows is part of the path, as in a file that exists.

    Raises
    ------
    BadInputError
        For an unknown key or a value of the wrong kind.
    """
    path, at, words = text.rpartition("@")
    pairs = [_PAIR.fullmatch(part) for part in re.split(rf",(?=(?:{'|'.join(KEYS)})=)", words)]
    if not at or not all(pairs) or Path(text).exists():
        return PictureOption(text, number)
    values: dict[str, Any] = {}
    for key, value in (pair.groups() for pair in pairs if pair is not None):
        if key not in KEYS:
            raise BadInputError(f"--reference {text!r} has the unknown key {key!r}: allowed are {', '.join(KEYS)}.")
        if key in values:
            raise BadInputError(f"--reference {text!r} gives {key!r} twice: give it once.")
        values[key] = _value(key, value, text)
    values["view_layer"] = values.pop("layer", "")
    return PictureOption(path, number, **values)


def picture_options(texts: Sequence[str], left_out: Sequence[int]) -> list[PictureOption]:
    """The pictures of a command line without those `left_out`, by their number from 1 on.

    Raises
    ------
    BadInputError
        For a number that no picture has, or where all are left out.
    """
    pictures = [picture_option(text, number) for number, text in enumerate(texts, 1)]
    wrong = [number for number in left_out if not 1 <= number <= len(pictures)]
    if wrong:
        raise BadInputError(f"--leave-out {wrong[0]}: the pictures are 1 to {len(pictures)}.")
    kept = [picture for picture in pictures if picture.number not in left_out]
    if not kept:
        raise BadInputError("--leave-out leaves no picture: leave one in at least.")
    return kept


def with_part(pictures: Sequence[PictureOption], part: PicturePart) -> list[PictureOption]:
    """The pictures with a part of them that counts.

    Raises
    ------
    BadInputError
        If it is one of several pictures, each of which would need its own.
    """
    if part.is_whole:
        return list(pictures)
    if len(pictures) > 1:
        raise BadInputError("--crop, --mask and --alpha are for one picture: leave them out, or give one --reference.")
    return [replace(picture, part=part_to_json(part)) for picture in pictures]


def is_plain(pictures: Sequence[PictureOption]) -> bool:
    """Whether this is one picture of the file as it is."""
    return len(pictures) == 1 and pictures[0] == PictureOption(pictures[0].reference, pictures[0].number)


def _value(key: str, value: str, text: str) -> Any:
    kind = {"frame": int, "exposure": float}.get(key, str)
    try:
        return kind(value)
    except ValueError:
        needed = "a whole number" if kind is int else "a number of stops"
        raise BadInputError(f"--reference {text!r}: {key} is {value!r}: it must be {needed}.") from None
