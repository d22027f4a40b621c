# SPDX-License-Identifier: Apache-2.0
"""`mfo apply RESULT FILE`: the values of a finished job on a material of a .blend file, also of another one."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...types.errors import BadInputError
from ..blender_host import find_blender_host
from .blend import apply_result


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo apply`."""
    parser = subparsers.add_parser(
        "apply",
        help="put the values of a result on a material of a .blend file",
        description="Put the recovered values of a finished job on a material of a .blend file and save it.",
    )
    parser.add_argument("result", type=Path, help="result.json of the job, or its folder")
    parser.add_argument("file", type=Path, help="the .blend file")
    parser.add_argument("--material", metavar="NAME", default="", help="material to change (default: the fitted one's)")
    parser.add_argument("--save-as", type=Path, metavar="BLEND", help="save here, not over FILE")
    parser.add_argument("--force", action="store_true", help="also where the result does not match its reference")
    parser.add_argument(
        "--animated",
        choices=("leave", "replace"),
        default="leave",
        help="sockets with keyframes or a driver stay as they are (default), or get a key and lose the driver",
    )
    parser.add_argument("--make-local", action="store_true", help="make object, mesh and material parts of the file")
    parser.add_argument("--blender", metavar="PROGRAM", help="a Blender program (default: MFO_BLENDER, bpy, PATH)")
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Let Blender apply and save."""
    job = arguments.result.parent if arguments.result.is_file() else arguments.result
    if not (job / "result.json").is_file():
        raise BadInputError(f"{arguments.result} is no result: give the result.json of a finished job, or its folder.")
    saved = arguments.save_as or arguments.file
    notes = apply_result(
        find_blender_host(arguments.blender), arguments.file, job, saved, material=arguments.material,
        force=arguments.force, animated=arguments.animated, make_local=arguments.make_local,
    )  # fmt: skip
    print("\n".join([*(f"note: {note}" for note in notes), f"Saved: {saved}"]))
    return 0
