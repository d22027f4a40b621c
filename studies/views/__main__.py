# SPDX-License-Identifier: Apache-2.0
"""Several pictures of a material and the proposal of the next: one row for each scene, and a summary.

    python -m studies.views OUT.jsonl --numbers 0-19 --size 64

A scene's material is fitted to one picture; to that and the proposed one; to that and one drawn at random; to all
three; and to all three when the second was rendered under another lamp than its scene has.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path

from .measure import measure
from .summary import summary


def main() -> None:
    """Measure the scenes that have no row yet, then print the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", type=Path)
    parser.add_argument("--numbers", default="0-19", help="first-last")
    parser.add_argument("--size", type=int, default=64, help="pixels along a side")
    chosen = parser.parse_args()
    first, last = map(int, chosen.numbers.split("-"))
    text = chosen.rows.read_text("utf-8") if chosen.rows.exists() else ""
    rows = [json.loads(line) for line in text.splitlines()]
    for number in range(first, last + 1):
        if number in {row["number"] for row in rows}:
            continue
        with tempfile.TemporaryDirectory() as folder:
            rows.append(measure(number, Path(folder), chosen.size))
        with chosen.rows.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()
