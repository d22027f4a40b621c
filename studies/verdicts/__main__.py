# SPDX-License-Identifier: Apache-2.0
"""How true the verdicts are: Cycles' pictures, half of them with something planted that the export cannot know.

    python -m studies.verdicts KIND [--first 0] [--count 60] [--rows verdicts.jsonl] [--folder DIR]

KIND is `planted`, `denoised` (the same from pictures as Blender's defaults make them), `classes` (from Blender's own
material to each class) or `plain` (materials without coat and sheen).
Every case is one line of the rows' file, so a run that was stopped goes on where it was. Needs a Python with `bpy`.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

from .cases import KINDS
from .measure import Row, measure
from .summary import summary


def main() -> None:
    """Measure what is missing, then print the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=tuple(KINDS))
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--rows", type=Path, default=Path("verdicts.jsonl"))
    parser.add_argument("--folder", type=Path, help="keep scenes and jobs here")
    chosen = parser.parse_args()
    lines = chosen.rows.read_text("utf-8").splitlines() if chosen.rows.exists() else []
    rows = [row for line in lines if (row := Row(**json.loads(line))).kind == chosen.kind]
    done = {row.case["number"] for row in rows}
    with tempfile.TemporaryDirectory() as temporary:
        folder = (chosen.folder or Path(temporary)).absolute()
        for number in range(chosen.first, chosen.first + chosen.count):
            if number in done:
                continue
            rows.append(row := measure(chosen.kind, number, folder))
            with chosen.rows.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(row)) + os.linesep)
            print(f"{number}: {row.verdict} {row.cause}, {row.excess:.3f} above the noise {row.error}", file=sys.stderr)
    print(summary(rows))


if __name__ == "__main__":
    main()
