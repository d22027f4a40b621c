# SPDX-License-Identifier: Apache-2.0
"""`mfo blend`: fit a material of a .blend file, with a Blender program or the bpy module doing Blender's part."""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ...fit.settings import FitSettings
from ...job.output.protocol_stream import take_stdout
from ...job.run.fit_scene import fit_scene
from ...types.errors import BadInputError, MfoError, SetupError
from ...types.status import Status
from ...types.verdict import Verdict
from ..blender_host import BlenderHost, find_blender_host
from ..fit_options import add_fit_options, fit_from_options
from ..part_options import add_part_options, part_from_options
from ..picture_option import HELP, PictureOption, is_plain, picture_options, with_part
from ..result_text import result_text
from ..run_folder import run_folder
from ..target_option import HELP as TARGET_HELP
from ..target_option import TargetOption, is_active, target_option
from .run import leave

REFERENCE_VIEWS = ("scene", "standard")
NOT_APPLIED = "Nothing was applied or saved, as the result does not match the reference; --force applies it anyway."
RESULT_IS_KEPT = "The fit itself is done: `mfo apply {result} BLEND` puts its values on a file."
_ERRORS = {Status.BAD_INPUT: BadInputError, Status.SETUP: SetupError}


@dataclass(frozen=True)
class BlendFit:
    """A finished job of a .blend file: its folder and the content of result.json."""

    job: Path
    result: Mapping[str, Any]


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo blend`."""
    parser = subparsers.add_parser(
        "blend",
        help="fit materials of a .blend file to a reference picture",
        description="Fit the active material of an object of a .blend file to a reference picture, or several "
        "materials of a scene together, with the light that they give each other.",
        epilog="Example: mfo blend room.blend --object Floor --object Wall@material=Paint --object Chair@slot=2 "
        "--reference room.exr --apply --save-as fitted.blend",
    )
    parser.add_argument("file", type=Path, help="the .blend file; it is not changed unless --apply is given alone")
    parser.add_argument("--object", required=True, action="append", metavar="NAME[@KEY=VALUE]", help=TARGET_HELP)
    parser.add_argument(
        "--queue",
        action="store_true",
        help="fit each of many materials once and quickly, in the light that the others' base colours give",
    )
    parser.add_argument("--reference", required=True, action="append", metavar="PATH[@KEY=VALUE,...]", help=HELP)
    parser.add_argument(
        "--leave-out", action="append", type=int, default=[], metavar="NUMBER",
        help="fit without this one of the pictures, the first of which is 1",
    )  # fmt: skip
    parser.add_argument(
        "--reference-view",
        choices=REFERENCE_VIEWS,
        default=REFERENCE_VIEWS[0],
        help="how a PNG, JPEG or TIFF was made: rendered in this scene, under its view (scene, the default), or a "
        "photograph or a render under Standard (standard)",
    )
    parser.add_argument(
        "--upright", action="store_true", help="turn the picture as its EXIF data say (Blender shows it as stored)"
    )
    parser.add_argument(
        "--shader",
        default="",
        metavar="NAME",
        help="of a material that mixes shaders the node to fit, after the groups it lies in (Group/Glossy BSDF; "
        "all: every one that reflects, and Mix factors; default: the one that covers most of the picture)",
    )
    # its name until the scene's view became the default
    parser.add_argument(
        "--bake-view", dest="reference_view", action="store_const", const="scene", help=argparse.SUPPRESS
    )
    add_part_options(parser)
    add_fit_options(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="job folder (default: a new temporary one)")
    parser.add_argument("--apply", action="store_true", help="put the recovered values on the material and save")
    parser.add_argument("--force", action="store_true", help="with --apply: also where the result does not match")
    parser.add_argument("--save-as", type=Path, metavar="BLEND", help="with --apply: save here, not over FILE")
    parser.add_argument(
        "--animated",
        choices=("leave", "replace"),
        default="leave",
        help="with --apply: sockets with keyframes or a driver stay as they are (default), or get a key at the current "
        "frame and lose the driver",
    )
    parser.add_argument(
        "--make-local",
        action="store_true",
        help="with --apply: make object, mesh and material of a library parts of the file that is saved",
    )
    parser.add_argument("--blender", metavar="PROGRAM", help="a Blender program (default: MFO_BLENDER, bpy, PATH)")
    parser.add_argument("--json", action="store_true", help="print the result as one JSON object")
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Export, fit and apply; the exit code is that of the fit."""
    if (arguments.make_local or arguments.animated != "leave") and not arguments.apply:
        raise BadInputError("--make-local and --animated need --apply: without it no .blend file is written.")
    if arguments.save_as and not arguments.apply:
        raise BadInputError("--save-as needs --apply: without it no .blend file is written.")
    options = fit_from_options(arguments) | ({"queue": True} if arguments.queue else {})
    given = picture_options(arguments.reference, arguments.leave_out)
    pictures = with_part(given, part_from_options(arguments))
    targets = [target_option(text) for text in arguments.object]
    if len(targets) > 1 and arguments.shader:
        raise BadInputError("--shader is for one material: of several, each one's largest or chosen shader is fitted.")
    if len(targets) > 1 and arguments.make_local:
        raise BadInputError("--make-local is for one material: make the others local in Blender first.")
    FitSettings.from_request(options)  # a wrong option is known before Blender is started
    saved_at = arguments.save_as or arguments.file
    if arguments.apply:
        _check_may_be_written(saved_at)
    host = find_blender_host(arguments.blender)
    stream = take_stdout() if arguments.json else None
    job = arguments.out or Path(tempfile.mkdtemp(prefix="mfo-")) / "job"
    fit = fit_blend(
        host,
        arguments.file,
        targets[0].object if is_active(targets) else targets,
        Path(pictures[0].reference) if is_plain(pictures) else pictures,
        job,
        options,
        reference_view=arguments.reference_view,
        upright=arguments.upright,
        shader=arguments.shader,
        will_apply=arguments.apply,
        make_local=arguments.make_local,
    )
    saved, notes = None, tuple(fit.result["notes"])
    if arguments.apply and may_apply(fit.result, forced=arguments.force):
        try:
            notes += apply_result(
                host,
                arguments.file,
                fit.job,
                saved_at,
                force=arguments.force,
                animated=arguments.animated,
                make_local=arguments.make_local,
            )
        except MfoError as error:
            raise type(error)(f"{error} {RESULT_IS_KEPT.format(result=fit.job / 'result.json')}") from error
        saved = saved_at
    elif arguments.apply:
        notes += (NOT_APPLIED,)
    if stream is not None:
        answer = {**fit.result, "notes": notes, "folder": str(fit.job), "saved": str(saved) if saved else None}
        print(json.dumps(answer, ensure_ascii=False), file=stream)
        stream.close()
    else:
        lines = [*(f"note: {note}" for note in notes), result_text(fit.result), f"Report: {fit.job / 'index.html'}"]
        print("\n".join([*lines, *([f"Saved: {saved}"] if saved else []), fit.result["sentence"]]))
    return leave(Status(fit.result["status"]))


def _check_may_be_written(blend: Path) -> None:
    """Refuse a place where no file can be saved, which is better known before a fit than after it."""
    try:
        with tempfile.TemporaryFile(dir=blend.absolute().parent):  # Blender writes beside the file and renames
            pass
        if blend.exists():
            with blend.open("r+b"):
                pass
    except OSError as error:
        raise BadInputError(
            f"{blend} cannot be written ({error.strerror}): give another place with --save-as. Nothing was fitted."
        ) from error


def may_apply(result: Mapping[str, Any], *, forced: bool) -> bool:
    """Whether a result may go onto its material: one that does not match its reference only if that is asked for.

    Of several materials those that match may.
    """
    found = result.get("materials") or [result]
    return forced or any(one.get("verdict") != Verdict.DIFFERENT.value for one in found)


def fit_blend(
    host: BlenderHost,
    blend: Path,
    target: str | Sequence[TargetOption],
    reference: Path | Sequence[PictureOption],
    job: Path,
    fit: Mapping[str, Any],
    *,
    reference_view: str = "scene",
    upright: bool = False,
    shader: str = "",
    will_apply: bool = False,
    make_local: bool = False,
) -> BlendFit:
    """Export a job from a .blend file and run it with a progress bar on stderr.

    `target` is an object, whose active material is fitted, or the materials that are fitted together.
    `reference` is a picture of the file as it is, or pictures with what each shows. `reference_view` says how a display
    picture was made: one of `REFERENCE_VIEWS`; `upright` turns it as its EXIF data say. With `will_apply` a material
    that cannot be changed is refused before the fit, unless it is to be made local.

    Raises
    ------
    BadInputError, SetupError, MfoError
        With the sentence of the export or of the fit. A cancelled fit is a result, with what was found so far.
    """
    is_new = not job.exists()
    host.call(
        "export",
        blend,
        # one word, since a name may begin with a dash
        *(
            [f"--object={target}"]
            if isinstance(target, str)
            else [f"--target={json.dumps(each.fields())}" for each in target]
        ),
        *(
            [f"--reference={reference}"]
            if isinstance(reference, Path)
            else [f"--picture={json.dumps(picture.fields())}" for picture in reference]
        ),
        f"--job={job}",
        f"--fit={json.dumps(fit)}",
        f"--reference-view={reference_view}",
        *(["--upright"] if upright else []),
        *([f"--shader={shader}"] if shader else []),
        *(["--will-apply"] if will_apply else []),
        *(["--make-local"] if make_local else []),
    )
    done = run_folder(job, partial(fit_scene, blender=host.node_server), is_new=is_new)
    if done.result is None:
        raise _ERRORS.get(done.status, MfoError)(done.sentence)
    return BlendFit(job, done.result)


def apply_result(
    host: BlenderHost,
    blend: Path,
    job: Path,
    save_as: Path,
    *,
    material: str = "",
    force: bool = False,
    animated: str = "leave",
    make_local: bool = False,
) -> tuple[str, ...]:
    """Save `blend` with the recovered values on its material; returns what was skipped, in sentences.

    The material is the fitted one's name, or `material`.
    With `force` also those of a result that does not match. Sockets with keyframes or a driver are left as they are, or
    with `animated` "replace" get a key at the current frame and lose the driver. With `make_local` object, mesh and
    material of a library become parts of the file.
    """
    words = [f"--job={job}", f"--save-as={save_as}", f"--animated={animated}"]
    words += [f"--material={material}"] if material else []
    words += [word for word, wanted in (("--force", force), ("--make-local", make_local)) if wanted]
    applied = host.call("apply", blend, *words)
    return tuple(applied.get("notes", ()))
