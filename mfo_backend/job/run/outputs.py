# SPDX-License-Identifier: Apache-2.0
"""What a finished job leaves in its folder: pictures, the report and, last, result.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from ...fit.judge.region import fill_outside
from ...metrics.flip.block_means import block_means, block_side, full_blocks, means_beside
from ...metrics.flip.flip_error import flip_error
from ...metrics.pixels.side_by_side import side_by_side
from ...report.curve_picture import curve_png
from ...report.difference_map import magma_counted
from ...report.html_report import ReportContent, report_html
from ...report.picture import displayed, displayed_linear, mask_png, png_bytes
from ...scene.image_file import write_exr
from ...types.image import Encoding, Image
from ..folder.atomic_file import write_atomically
from ..folder.job_folder import JobFolder
from ..folder.request import Request
from ..output.progress import DIFFERENCE_PATH, PREVIEW_PATH
from ..output.result import result_to_json, versions, write_result
from .job_outcome import JobOutcome, SeenPicture
from .more_pictures import JobPicture


def write_outputs(pictures: Sequence[JobPicture], outcome: JobOutcome, *, notes: Sequence[str]) -> None:
    """Write pictures, report and result.json; the last appears by rename when the others are complete.

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
    places = [(JobFolder.open(folder.root / path), each) for path, each in request.targets]
    for (place, each), own in zip(places, outcome.materials, strict=True):
        write_outputs([JobPicture(place, each, first.reference, first.view)], own, notes=notes)
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
            {**asdict(p.request.picture), "folder": p.folder.root.relative_to(folder.root).as_posix(), **found}
            for p, found in zip(pictures, content["pictures"], strict=True)
        ]
    if outcome.materials:
        content["verdict_sentence"] = outcome.result.message
        content["materials"] = [
            {"object": each.target.object, "material": each.target.material, "slot": each.target.slot, "folder": path,
             **result_to_json(own.result, variant=outcome.variant)}
            for (path, each), own in zip(request.targets, outcome.materials, strict=True)
        ]  # fmt: skip
    write_result(folder, content)
    for path in (PREVIEW_PATH, DIFFERENCE_PATH):  # result.png and difference.png are what they were on the way to
        (folder.root / path).unlink(missing_ok=True)


def _write_pictures(picture: JobPicture, seen: SeenPicture) -> dict[str, bytes]:
    """Write what one picture shows into its folder; returns the PNG files by name."""
    folder, reference, view = picture.folder, picture.reference, picture.view
    side = block_side(seen.counted)  # as `fit.picture_errors`
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
    files = side_by_side(lambda picture: png_bytes(picture()), list(shown.values()))
    pictures = dict(zip(shown, files, strict=True))
    folder.pictures.mkdir(exist_ok=True)
    for name, data in pictures.items():
        write_atomically(folder.pictures / f"{name}.png", data)
    write_atomically(folder.counted, mask_png(seen.counted))
    write_exr(folder.pictures / "result.exr", seen.result)
    return pictures


def bytes_needed(request: Request) -> int:
    """An upper estimate of what a job writes: four 8-bit pictures, their copies in the report, a mask and one EXR."""
    pixels = sum(each.width * each.height for each in (request, *(more for _, more in request.more_pictures)))
    return 2**20 + pixels * (4 * 3 * 3 + 1 + 12)


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
