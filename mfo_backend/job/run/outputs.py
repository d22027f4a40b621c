# SPDX-License-Identifier: Apache-2.0
"""What a finished job leaves in its folder: pictures, the report and, last, result.json."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ...fit.judge.region import fill_outside
from ...metrics.flip.block_means import block_means, block_side, full_blocks, means_beside
from ...metrics.flip.flip_error import flip_error
from ...metrics.pixels.side_by_side import side_by_side
from ...report.curve_picture import curve_png
from ...report.difference_map import magma_counted
from ...report.html_report import ReportContent, report_html
from ...report.picture import THUMBNAIL_SIDE, displayed, displayed_linear, mask_png
from ...scene.image_file import write_exr
from ...types.image import Encoding, Image
from ..folder.atomic_file import write_atomically
from ..folder.job_folder import JobFolder
from ..folder.request import Request
from ..output.pictures import picture_files, write_picture
from ..output.progress import DIFFERENCE_PATH, PREVIEW_PATH
from ..output.result import result_to_json, versions, write_result
from .job_outcome import JobOutcome, SeenPicture
from .more_pictures import JobPicture


def write_outputs(pictures: Sequence[JobPicture], outcome: JobOutcome, *, notes: Sequence[str]) -> dict[str, Any]:
    """Write pictures, report and result.json, whose content is returned; it appears when the others are complete.

    `pictures` are those of the job, the first with the folder of the report and the result; each one's own are written
    into its folder.

    Of several materials each has all of this in its own folder first.

    Raises
    ------
    OSError, BadInputError
        If the folder cannot be written or the disk is full.
    """
    first = pictures[0]
    folder, request = first.folder, first.request
    inner = [
        write_outputs(*_of_material(pictures, JobFolder.open(folder.root / path), each, own), notes=notes)
        for (path, each), own in zip(request.targets, outcome.materials, strict=True)
    ]
    shown = [_write_pictures(picture, seen) for picture, seen in zip(pictures, outcome.seen, strict=False)]
    curve = curve_png(outcome.result.stages)
    if curve is not None:
        write_atomically(folder.pictures / "curve.png", curve)
    report = ReportContent(
        title=_title(request),
        subtitle=_subtitle(request, outcome.result.model),
        result=outcome.result,
        pictures=shown[0],
        more_pictures={f"Picture {p.label}": files for p, files in zip(pictures, shown, strict=True)}
        if len(shown) > 1
        else {},
        notes=(*notes, *outcome.result.notes),
        versions=versions(outcome.variant),
        materials={
            _title(each): (path, own.result)
            for (path, each), own in zip(request.targets, outcome.materials, strict=True)
        },
    )
    write_atomically(folder.report, report_html(report).encode("utf-8"))
    content = result_to_json(outcome.result, notes=notes, variant=outcome.variant)
    if outcome.result.pictures:
        content["pictures"] = [
            {**asdict(p.request.picture), "folder": _path(p.folder, folder), **found}
            for p, found in zip(pictures, content["pictures"], strict=True)
        ]
    if outcome.materials:
        content["verdict_sentence"] = outcome.result.message
        content["materials"] = [
            {"object": each.target.object, "material": each.target.material, "slot": each.target.slot, "folder": path,
             **result_to_json(own.result, variant=outcome.variant), **_pictures_from(path, found)}
            for (path, each), own, found in zip(request.targets, outcome.materials, inner, strict=True)
        ]  # fmt: skip
    write_result(folder, content)
    for path in (PREVIEW_PATH, DIFFERENCE_PATH):  # the result's are what they were on the way to
        (folder.root / path).unlink(missing_ok=True)
    return content


def _pictures_from(path: str, content: dict[str, Any]) -> dict[str, Any]:
    """The list of pictures of a material's result, with folders as they are seen from the job's own."""
    listed = content.get("pictures", ())
    found = [{**one, "folder": os.path.normpath(f"{path}/{one['folder']}").replace(os.sep, "/")} for one in listed]
    return {"pictures": found} if found else {}


def _path(inner: JobFolder, outer: JobFolder) -> str:
    return Path(os.path.relpath(inner.root, outer.root)).as_posix()


def _of_material(
    pictures: Sequence[JobPicture], place: JobFolder, request: Request, outcome: JobOutcome
) -> tuple[list[JobPicture], JobOutcome]:
    """The pictures that show one of several materials, the first of them in its own folder, and its outcome there."""
    sheet = outcome.sheet
    if sheet is None:
        return [JobPicture(place, request, pictures[0].reference, pictures[0].view)], outcome
    judged = [picture.label for picture in outcome.result.pictures]
    showing = [number for number, label in enumerate(sheet.labels) if label in judged] or [0]
    first, *others = (pictures[number] for number in showing)
    own = replace(request, picture=first.request.picture, width=first.request.width, height=first.request.height)
    seen = tuple(outcome.seen[number] for number in showing)
    return [JobPicture(place, own, first.reference, first.view), *others], replace(outcome, only=seen)


def _write_pictures(picture: JobPicture, seen: SeenPicture) -> dict[str, bytes]:
    """Write what one picture shows into its folder; returns the PNG files by name."""
    folder, reference, view = picture.folder, picture.reference, picture.view
    side = block_side(seen.counted)  # as `fit.judge.picture_errors`
    result = means_beside(reference.encoding, Image(seen.result, Encoding.LINEAR), side, view)
    seen_reference = reference
    if reference.counts is not None:
        seen_reference = fill_outside(reference, seen.result, reference.counts, view.display)
    difference = flip_error(block_means(seen_reference, side), result, display=view)
    counts = None if reference.counts is None else full_blocks(reference.counts, side)
    shown = {
        "reference": lambda: displayed(reference, view),
        "start": lambda: displayed_linear(seen.start, view),
        "result": lambda: displayed_linear(seen.result, view),
        "difference": lambda: magma_counted(difference.map, counts),
    }
    files = dict(zip(shown, side_by_side(lambda picture: picture_files(picture()), list(shown.values())), strict=True))
    for name, written in files.items():
        write_picture(folder, name, written)
    write_atomically(folder.counted, mask_png(seen.counted))
    write_exr(folder.pictures / "result.exr", seen.result)
    return {name: written.png for name, written in files.items()}


def bytes_needed(request: Request) -> int:
    """An upper estimate of what a job writes: four 8-bit pictures, small and in the report too, a mask and one EXR."""
    pixels = [each.width * each.height for each in (request, *(more for _, more in request.more_pictures))]
    small = sum(min(count, THUMBNAIL_SIDE**2) for count in pixels)
    return 2**20 + sum(pixels) * (4 * 3 * 3 + 1 + 12) + small * 4 * 3


def _title(request: Request) -> str:
    if request.targets:
        return f"{len(request.targets)} materials"
    target = request.target
    material = target.material or target.bsdf_id or target.shape_id
    return f"{material} · {target.object}" if target.object else material


def _subtitle(request: Request, model: str) -> str:
    kind = "scene-linear" if request.encoding.value == "linear" else "sRGB display values"
    samples = f", {request.fit.spp} samples per pixel" if request.fit.preset == "paper" else ""
    return (
        f"{request.reference}, {request.width} × {request.height} pixels, {kind}; model {model}, "
        f"preset {request.fit.preset}{samples}, seed {request.fit.seed}"
    )
