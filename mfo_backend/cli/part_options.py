# SPDX-License-Identifier: Apache-2.0
"""The command-line options for a fit to a part of its reference."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..job.folder.picture_part import WHOLE, PicturePart
from ..types.errors import BadInputError


def add_part_options(parser: argparse.ArgumentParser) -> None:
    """Add `--crop`, `--mask` and `--alpha`."""
    group = parser.add_argument_group("which part of the reference counts")
    group.add_argument(
        "--crop",
        metavar="LEFT,TOP,RIGHT,BOTTOM",
        help="a rectangle in per cent from the upper left corner, as 0,0,50,100 for the left half",
    )
    group.add_argument("--mask", type=Path, metavar="FILE", help="a picture: white counts, black or transparent not")
    group.add_argument("--alpha", action="store_true", help="what is transparent in the reference does not count")


def part_from_options(arguments: argparse.Namespace) -> PicturePart:
    """The part that was given.

    Raises
    ------
    BadInputError
        If the crop is not four numbers of a rectangle, or the mask does not exist.
    """
    crop = WHOLE
    if arguments.crop is not None:
        try:
            left, top, right, bottom = (float(word) / 100.0 for word in arguments.crop.split(","))
        except ValueError:
            raise BadInputError(
                f"--crop is {arguments.crop!r}: give left, top, right and bottom in per cent, as 0,0,50,100."
            ) from None
        crop = (left, top, right, bottom)
    if arguments.mask is not None and not arguments.mask.is_file():
        raise BadInputError(f"--mask {str(arguments.mask)!r} does not exist: check the path.")
    return PicturePart(crop, str(arguments.mask.absolute()) if arguments.mask is not None else "", arguments.alpha)
