# SPDX-License-Identifier: Apache-2.0
"""`mfo compare REF TEST`: how far one picture is from another, in numbers and as maps."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...metrics.compare import Comparison, compare_images
from ...metrics.display.tone_mapping import DisplayView
from ...metrics.judgement import judge_images
from ...report.difference_map import draw_map
from ...scene.image_file import read_image, write_png
from ...types.errors import BadInputError

_MEANINGS = {
    "mse": "mean squared error",
    "log_mse": "mean squared error of logarithmic radiance",
    "relative_mse": "mean squared error relative to the reference",
    "pu21_mse": "mean squared error of PU21 values (256 is about 100 cd/m^2)",
    "flip": "FLIP, 0 equal to 1",
    "hdr_flip": "HDR-FLIP, 0 equal to 1",
    "de_itp": "colour difference, 1 is just noticeable",
    "jod": "ColorVideoVDP, 10 is equal; sees contrast and hue, not how bright all of it is",
    "hdrvdp3_q_jod": "HDR-VDP-3, 10 is equal; ignores hue (runs where MFO_HDRVDP3 names it)",
}
_DRAWN = {"flip": 1.0, "hdr_flip": 1.0, "de_itp": None}  # name of the map, end of its bar (None: its 99th percentile)


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `compare` to the parser of `mfo`."""
    parser = subparsers.add_parser(
        "compare",
        help="measure the difference between two pictures",
        description="Measure how far TEST is from REF with every metric. EXR and HDR files are scene-linear; PNG, JPEG "
        "and TIFF hold sRGB display values.",
    )
    parser.add_argument("reference", metavar="REF", type=Path)
    parser.add_argument("test", metavar="TEST", type=Path)
    parser.add_argument(
        "--mask", type=Path, metavar="FILE", help="average over the pixels that are white in this picture"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="write maps of the differences there")
    parser.add_argument("--exposure", type=float, metavar="EV", help="show linear pictures at this exposure for FLIP")
    parser.add_argument("--gamma", type=float, metavar="G", help="and with this gamma of Blender's view Standard")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Print the metrics and write the maps; returns 0, or raises `BadInputError`."""
    reference, test = read_image(arguments.reference), read_image(arguments.test)
    mask = None if arguments.mask is None else _read_mask(arguments.mask)
    display = None
    if arguments.exposure is not None or arguments.gamma is not None:
        display = DisplayView(arguments.exposure or 0.0, 1.0 if arguments.gamma is None else arguments.gamma)
    comparison = compare_images(reference, test, mask=mask, display=display)
    judgement = judge_images(reference, test, display=display)
    metrics = {**comparison.metrics, "jod": judgement.jod, "hdrvdp3_q_jod": judgement.hdrvdp3_q_jod}
    notes = [*reference.notes, *test.notes, *comparison.notes, *judgement.notes]
    pictures = {} if arguments.out is None else _write_maps(arguments.out, comparison)
    if arguments.json:
        content = {"metrics": metrics, "judges": judgement.conditions, "pictures": pictures, "notes": notes}
        print(json.dumps(content))
        return 0
    for name, value in metrics.items():
        print(f"{name:13} {'-' if value is None else f'{value:.6g}':>12}  {_MEANINGS[name]}")
    for line in (*notes, *(f"Wrote {path}" for path in pictures.values())):
        print(line)
    return 0


def _read_mask(path: Path) -> NDArray[np.bool_]:
    return read_image(path).pixels.max(axis=-1) > 0.5


def _write_maps(folder: Path, comparison: Comparison) -> dict[str, str]:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(f"Folder {str(folder)!r} cannot be made: {error.strerror or error}.") from error
    written = {}
    for name, maximum in _DRAWN.items():
        if name in comparison.maps:
            values = comparison.maps[name]
            end = float(np.quantile(values, 0.99)) if maximum is None else maximum
            title = f"{name}  mean {values.mean(dtype=np.float64):.4g}"
            path = folder / f"{name}.png"
            write_png(path, draw_map(values, maximum=end, title=title))
            written[name] = str(path)
    return written
