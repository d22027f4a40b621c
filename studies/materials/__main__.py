# SPDX-License-Identifier: Apache-2.0
"""Rooms of six unknown materials, fitted together to one picture by Cycles and judged in Cycles: one row for each.

    python -m studies.materials OUT.jsonl --numbers 0-9 --size 96 --preset balanced [--nodes] [--from-truth]
    python -m studies.materials OUT.jsonl --numbers 0-3 --size 330 --things 50

A row has for each material the mean FLIP of Cycles' picture of the fitted room and that of the floor, a mean of four
other pictures of the truth: all against the reference, on the pixels that see the material. The goal is a difference of
at most 0.01. With `--from-truth` the file that is fitted has the true values, so a row says what can be reached at all.
With `--nodes` what is fitted is inside nodes, and a row has the error, deviation and level of each value, too.
With `--things` the rooms are floors with that many small things instead, fitted in a queue, and the size is their
picture's width.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from .measure import measure

WITHIN = 0.01  # FLIP above the floor


def summary(rows: list[dict[str, Any]]) -> str:
    """The rows in a few lines."""
    lines = [
        "| room | worst material | FLIP above floor | within 0.01 | called the same | seconds | processor |",
        "|---|---|---|---|---|---|---|",
    ]
    good = 0
    for row in rows:
        above = {name: found["fitted"] - found["floor"] for name, found in row["materials"].items()}
        worst = max(above, key=lambda name: above[name])
        within = sum(value <= WITHIN for value in above.values())
        good += within == len(above)
        same = sum(found["verdict"] == "same" for found in row["materials"].values())
        lines.append(
            f"| {row['number']} | {worst} | {above[worst]:.4f} | {within} of {len(above)} | {same} | "
            f"{row['seconds']:.0f} | {row['cpu']:.0f} |"
        )
    return "\n".join([*lines, "", f"All materials within {WITHIN} of the floor in {good} of {len(rows)} rooms."])


def main() -> None:
    """Measure the rooms that have no row yet, then print the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", type=Path)
    parser.add_argument("--numbers", default="0-9", help="first-last")
    parser.add_argument("--size", type=int, default=96, help="pixels along a side")
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--nodes", action="store_true", help="values inside nodes")
    parser.add_argument("--things", type=int, default=0, metavar="COUNT", help="small things on a floor, in a queue")
    parser.add_argument("--from-truth", action="store_true", help="fit the file that has the true values")
    chosen = parser.parse_args()
    first, last = map(int, chosen.numbers.split("-"))
    text = chosen.rows.read_text("utf-8") if chosen.rows.exists() else ""
    rows = [json.loads(line) for line in text.splitlines()]
    for number in range(first, last + 1):
        if number in {row["number"] for row in rows}:
            continue
        with tempfile.TemporaryDirectory() as folder:
            how = {"nodes": chosen.nodes, "things": chosen.things, "from_truth": chosen.from_truth}
            rows.append(measure(number, Path(folder), chosen.size, chosen.preset, **how))
        with chosen.rows.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()
