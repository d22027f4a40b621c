# SPDX-License-Identifier: Apache-2.0
"""Fits from .blend files, as rows beside those of `mfo bench`.

    python -m studies.bench DIR [--scenario NAME ...] [--scenes 10] [--size 96]

Scenes, truths and starts are drawn by number; Cycles renders the reference and judges the fitted file. Rows are
appended to DIR/blender.jsonl, those that are there are not made again, and `mfo bench report DIR` has their table.
Needs a Python with `bpy`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from mfo_backend.bench.rows.blender_row import BlenderRow, add_blender_row, read_blender_rows
from mfo_backend.bench.runs.machine import source_commit

from .scenarios import SCENARIOS


def main() -> None:
    """Measure what has no row yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenario", nargs="+", choices=tuple(SCENARIOS), default=list(SCENARIOS))
    parser.add_argument("--scenes", type=int, default=10, help="of each scenario")
    parser.add_argument("--size", type=int, default=96, help="pixels along each side, where the scenario has none")
    chosen = parser.parse_args()
    commit = source_commit()
    done = {(row.scenario, row.scene) for row in read_blender_rows(chosen.folder)}
    for scene in range(chosen.scenes):
        for name in chosen.scenario:
            if (name, scene) in done:
                continue
            try:
                row = SCENARIOS[name](scene, chosen.size)
            except Exception as error:  # a failure is a row
                row = BlenderRow(name, scene, "", error=str(error) or type(error).__name__)
            add_blender_row(chosen.folder, replace(row, commit=commit))
            print(f"{name} {scene}: {row.verdict} {row.excess:.3f} above the noise {row.error}", file=sys.stderr)


if __name__ == "__main__":
    main()
