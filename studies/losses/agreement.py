# SPDX-License-Identifier: Apache-2.0
"""Which losses rank changes of a material as the judges do: Spearman's correlation over rendered pairs.

    python -m studies.losses.agreement [--materials 40] [--size 128] [--scores FILE] [--doc docs/reference/metrics.md]

Needs the extra `judges`. Losses whose packages or weights are missing are left out; HDR-VDP-3 joins in where
MFO_HDRVDP3 names a copy. The table replaces the one between the markers in docs/reference/metrics.md.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import itertools
import json
import sys
import textwrap
from pathlib import Path

import numpy as np
import scipy.stats
from numpy.typing import NDArray

from mfo_backend.metrics.judges.color_video_vdp import ColorVideoVdp
from mfo_backend.metrics.judges.display_light import DisplayLight
from mfo_backend.metrics.judges.hdr_vdp import hdr_vdp_q_jods
from mfo_backend.metrics.judges.hdr_vdp_program import is_configured
from mfo_backend.metrics.judges.viewing import HDR_VIEWING
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.metrics.losses.loss_names import LOSS_NAMES, OPTIONAL_LOSS_NAMES
from mfo_backend.metrics.responses.response import nits_per_unit
from mfo_backend.types.errors import SetupError
from mfo_backend.types.image import Encoding, Image
from studies.losses.material_pairs import CHANGES, REFERENCE_SPP, Pair, material_pairs

ROOT = Path(__file__).resolve().parents[2]

BEGIN, END = "<!-- studies/losses/agreement.py writes from here -->", "<!-- to here -->"
Columns = dict[str, NDArray[np.float64]]


def measure(pairs: list[Pair]) -> tuple[Columns, NDArray[np.float64]]:
    """Each loss of every pair, and ColorVideoVDP's 10 - JOD; HDR-VDP-3's 10 - Q_JOD counts as a loss."""
    names = _available(pairs[0])
    values: dict[str, list[float]] = {name: [] for name in names}
    judged: list[float] = []
    shown = []
    for _, group in itertools.groupby(pairs, key=lambda pair: id(pair.reference)):
        tests = [pair.test for pair in group]
        reference = pairs[len(judged)].reference
        light = DisplayLight(nits_per_unit(reference), HDR_VIEWING.peak_nits)
        judge = ColorVideoVdp(light.apply(reference), HDR_VIEWING)
        for name in names:
            loss = make_loss(name, Image(reference, Encoding.LINEAR))
            values[name] += [loss.value(test) for test in tests]
        judged += [judge.value(light.apply(test)) for test in tests]
        shown += [(light.apply(reference), light.apply(test)) for test in tests]
        print(f"\r{len(judged)} of {len(pairs)} pairs judged", end="", file=sys.stderr)
    print(file=sys.stderr)
    columns = {name: np.array(column) for name, column in values.items()}
    if is_configured():
        columns["HDR-VDP-3"] = 10 - np.array(hdr_vdp_q_jods(shown))
    return columns, np.array(judged)


def _available(pair: Pair) -> list[str]:
    """All losses but `cvvdp-hdr`, which is the judge, that can be made here."""
    names = []
    for name in LOSS_NAMES + OPTIONAL_LOSS_NAMES:
        try:
            make_loss(name, Image(pair.reference, Encoding.LINEAR))
        except SetupError as error:
            print(error, file=sys.stderr)
        else:
            names.append(name)
    return [name for name in names if name != "cvvdp-hdr"]


def correlations(columns: Columns, judged: NDArray[np.float64], changes: list[str]) -> dict[str, dict[str, float]]:
    """Spearman's correlation of each loss with 10 - JOD, for every kind of change and for all pairs together."""
    kinds = np.array(changes)
    return {
        name: {
            **{kind: _spearman(values[kinds == kind], judged[kinds == kind]) for kind in CHANGES},
            "all": _spearman(values, judged),
        }
        for name, values in columns.items()
    }


def _spearman(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float(np.asarray(scipy.stats.spearmanr(a, b).statistic))


def table(found: dict[str, dict[str, float]], judged: NDArray[np.float64], changes: list[str], size: int) -> str:
    """The Markdown between the markers, best loss over all pairs first."""
    count = len(judged) // len(CHANGES)
    kinds = [*CHANGES, "all"]
    jods = {kind: 10 - judged[[kind in (change, "all") for change in changes]] for kind in kinds}
    said = (
        f"{len(judged)} pairs: {count} random materials of Mitsuba's `principled` on a ball, five changes each, "
        f"{size}x{size}, {REFERENCE_SPP} samples per pixel (noise: 2 to 128), ColorVideoVDP "
        f"{importlib.metadata.version('cvvdp')} on {HDR_VIEWING}. "
        f"With {count} pairs a correlation of 0.8 is known to about +-{_spread(0.8, count):.2f} (two standard errors)."
    )
    lines = [
        *textwrap.wrap(said, 118),
        "",
        f"| loss | {' | '.join(kinds)} |",
        f"|---|{'---|' * len(kinds)}",
    ]
    for name in sorted(found, key=lambda name: -found[name]["all"]):
        lines.append(f"| {name} | {' | '.join(f'{found[name][kind]:.2f}' for kind in kinds)} |")
    quartiles = [np.quantile(jods[kind], (0, 0.5, 1)) for kind in kinds]
    lines.append(
        f"| JOD: least, median, largest | {' | '.join('{:.1f} {:.2f} {:.2f}'.format(*q) for q in quartiles)} |"
    )
    return "\n".join(lines)


def _spread(correlation: float, count: int) -> float:
    """Two standard errors of Spearman's correlation, by Fisher's transform (Bonett and Wright 2000)."""
    error = np.sqrt((1 + correlation**2 / 2) / (count - 3))
    return float(np.tanh(np.arctanh(correlation) + error) - np.tanh(np.arctanh(correlation) - error))


def write_between_markers(path: Path, text: str) -> None:
    """Replace what stands between the markers in a Markdown file."""
    before, rest = path.read_text("utf-8").split(BEGIN)
    after = rest.split(END)[1]
    path.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", "utf-8")


def main() -> None:
    """Render, measure, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--materials", type=int, default=40)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scores", type=Path, help="also write the scores of every pair there, as JSON")
    parser.add_argument("--doc", type=Path, default=ROOT / "docs" / "reference" / "metrics.md")
    arguments = parser.parse_args()
    pairs = list(material_pairs(arguments.materials, arguments.size, arguments.seed))
    changes = [pair.change for pair in pairs]
    columns, judged = measure(pairs)
    if arguments.scores is not None:
        content = {"change": changes, "jod": (10 - judged).tolist(), **{k: v.tolist() for k, v in columns.items()}}
        arguments.scores.write_text(json.dumps(content), "utf-8")
    text = table(correlations(columns, judged, changes), judged, changes, arguments.size)
    print(text)
    write_between_markers(arguments.doc, text)


if __name__ == "__main__":
    main()
