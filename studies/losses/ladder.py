# SPDX-License-Identifier: Apache-2.0
"""Which losses, pairs and ladders of losses recover materials best, and what they cost.

    python -m studies.losses.ladder [--scenes 30] [--size 48] [--rows ladder.jsonl] [--doc docs/method/losses.md]

Every scene is one line of the rows' file, so a run that was stopped goes on where it was; `--doc ""` only measures.
Losses whose packages are missing are left out, and so is the judge ColorVideoVDP. The table and
docs/pictures/ladder.svg replace what is there.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"  # of PyTorch, read when it loads; pictures this small gain nothing from more

from mfo_backend.bench.report.figure import svg
from studies.losses.ladder_report import plot, table, write_between_markers

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Measure the scenes that are missing, then write the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=30)
    parser.add_argument("--size", type=int, default=48)
    parser.add_argument("--rows", type=Path, default=Path("ladder.jsonl"))
    parser.add_argument("--doc", type=str, default=str(ROOT / "docs" / "method" / "losses.md"))
    arguments = parser.parse_args()
    rows = (
        [json.loads(line) for line in arguments.rows.read_text("utf-8").splitlines()] if arguments.rows.exists() else []
    )
    done = {row["scene"] for row in rows}
    missing = [number for number in range(arguments.scenes) if number not in done]
    if missing:
        from studies.losses.ladder_scene import measure_scene, prepare

        prepare()
        with tempfile.TemporaryDirectory(prefix="mfo-ladder-") as folder:
            for number in missing:
                row = measure_scene(number, arguments.size, Path(folder))
                rows.append(row)
                with arguments.rows.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
                print(f"scene {number}: {row['light']}, {len(row['methods'])} methods", file=sys.stderr, flush=True)
    if arguments.doc:
        document = Path(arguments.doc)
        write_between_markers(document, table(rows))
        (document.parents[1] / "pictures" / "ladder.svg").write_text(svg(plot(rows)), "utf-8")


if __name__ == "__main__":
    main()
