# SPDX-License-Identifier: Apache-2.0
"""`mfo judge JOB PICTURE`: how far a picture is from the reference of a job, seen through the job's own view.

Metrics are means over the pixels of the job's errors once there is a result, else over the whole picture.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ...fit.judge.region import fill_outside
from ...job.folder.job_folder import JobFolder
from ...job.folder.request import read_request
from ...job.folder.view_request import view_of
from ...job.output.pictures import picture_files, write_picture
from ...job.run.run_job import read_reference
from ...metrics.compare import compare_images
from ...metrics.flip.block_means import block_means, block_side, full_blocks, means_beside
from ...metrics.pixels.pixel_check import check_mask, check_pair
from ...report.difference_map import magma_counted
from ...report.picture import displayed, mask_from_png
from ...scene.image_file import read_image


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `judge` to the parser of `mfo`."""
    parser = subparsers.add_parser(
        "judge",
        help="measure a picture against the reference of a job",
        description="Measure PICTURE, as a render of the recovered material in Cycles, against the reference of a job "
        "under the job's view, where the errors of its result are taken. Writes NAME.png and NAME_difference.png "
        "(FLIP) into the job's folder pictures.",
    )
    parser.add_argument("job", metavar="JOB", type=Path)
    parser.add_argument("picture", metavar="PICTURE", type=Path)
    parser.add_argument("--name", default="cycles", help="of the pictures that are written (default: cycles)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the metrics and write both pictures; returns 0, or raises `BadInputError`."""
    folder = JobFolder.open(arguments.job)
    request = read_request(folder, trusted=True)  # the scene is not loaded
    reference, _notes = read_reference(folder, request)
    view = view_of(folder, request.view, request.view_table, reference)
    picture = read_image(arguments.picture)
    # at the size and over the pixels of `fit.judge.picture_errors`; the whole picture if there is no result
    check_pair(reference.pixels, picture.pixels)
    side, mask = 1, None
    if folder.counted.is_file():
        counted = mask_from_png(folder.counted.read_bytes())
        check_mask(counted, reference.pixels.shape[:2])
        side = block_side(counted)
        mask = full_blocks(counted, side)
    counts = reference.counts
    if counts is not None:  # what looks at neighbours finds no difference there
        reference = fill_outside(reference, picture.pixels, counts, view.display)
        counts = full_blocks(counts, side)
    seen = means_beside(reference.encoding, picture, side, view)
    comparison = compare_images(block_means(reference, side), seen, mask=mask, display=view)
    name = Path(arguments.name).name
    write_picture(folder, name, picture_files(displayed(picture, view)))
    write_picture(folder, f"{name}_difference", picture_files(magma_counted(comparison.maps["flip"], counts)))
    if arguments.json:
        print(json.dumps({"status": "ok", "metrics": comparison.metrics, "notes": [*picture.notes, *comparison.notes]}))
        return 0
    for metric, value in comparison.metrics.items():
        print(f"{metric:13} {'-' if value is None else f'{value:.6g}':>12}")
    return 0
