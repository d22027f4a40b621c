# SPDX-License-Identifier: Apache-2.0
"""Rows of the study, one line of JSON each, and the table made of them."""

from __future__ import annotations

import json
import re
import statistics
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

Row = dict[str, Any]
# FLIP above the floor up to which a recovery counts as found, and from which on "same" is a wrong verdict
FOUND, WRONG = 0.02, 0.05
UNSEEN = "The camera does not see"  # how the export says that there is no picture of a target
EXACT = "magenta, as in Cycles"  # of a missing picture: the fit has it as the render does


def read_rows(path: Path) -> list[Row]:
    """All rows of a file; none where there is no file."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text("utf-8").splitlines() if line.strip()]


def add_row(path: Path, row: Row) -> None:
    """Add one row at the end of the file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row, ensure_ascii=False) + "\n")


def how_read(material: Row) -> str:
    """`fully`, `with gaps` (something of it is named as left out or approximated), `refused` or `not seen`."""
    if any(error.startswith(UNSEEN) for error in material["errors"]):
        return "not seen"
    if material["errors"]:
        return "refused"
    return "with gaps" if gaps_of(material) else "fully"


def gaps_of(material: Row) -> list[str]:
    """Notes on what is left out or approximated of the material itself; the others are on the scene around it."""
    name = f"aterial '{material['material']}'"
    return [note for note in material["notes"] if name in note and EXACT not in note]


def reading_table(rows: Iterable[Row]) -> str:
    """Shares of materials by how they were read, bare emission apart, and the sentences that stand most often."""
    files = list(rows)
    every = [m for row in files for m in row.get("materials", ()) if m["sort"] != "emission"]
    materials = [m for m in every if how_read(m) != "not seen"]
    counts = Counter(how_read(m) for m in materials)
    failed = sum("materials" not in row for row in files)
    lines = [
        f"{len(files)} files ({failed} could not be opened), {len(materials)} materials (bare emission apart, and "
        f"{len(every) - len(materials)} that no camera saw).",
        "",
        "| read | materials | share |",
        "| --- | --: | --: |",
    ]
    for name in ("fully", "with gaps", "refused"):
        lines.append(f"| {name} | {counts[name]} | {100 * counts[name] / max(1, len(materials)):.0f} % |")
    sentences = {
        "Refused because": [m["errors"] for m in materials],
        "Gaps of the material": [gaps_of(m) for m in materials if not m["errors"]],
        "Gaps of the scene around it": [[n for n in m["notes"] if n not in gaps_of(m)] for m in materials],
    }
    for title, said in sentences.items():
        kinds = Counter(kind for each in said for kind in {_kind(sentence) for sentence in each})
        lines += ["", f"| {title} | materials |", "| --- | --: |"]
        lines += [f"| {sentence} | {count} |" for sentence, count in kinds.most_common(25)]
    return "\n".join(lines)


def recovery_table(rows: Iterable[Row]) -> str:
    """How near recoveries end to the floor, and whether their verdicts are true."""
    done = [row for row in rows if "after" in row]
    refused = Counter(row["why"] for row in rows if "why" in row)
    found = [row for row in done if row["after"] <= row["floor"] + FOUND]
    wrong = [row for row in done if row.get("verdict") == "same" and row["after"] > row["floor"] + WRONG]
    if not done:
        return f"No fit was done; {sum(refused.values())} were refused."
    seconds = statistics.median(row["seconds"] for row in done)
    return "\n".join(
        [
            f"{len(done)} fits, {sum(refused.values())} refused; {len(found)} within {FOUND} FLIP of the floor; "
            f"{len(wrong)} called the same at more than {WRONG} above it; median {seconds:.1f} s.",
            "",
            "| file | material | FLIP before | after | floor | verdict | seconds |",
            "| --- | --- | --: | --: | --: | --- | --: |",
            *(
                f"| {row['file']} | {row['material']} | {row['before']:.3f} | {row['after']:.3f} | "
                f"{row['floor']:.3f} | {row.get('verdict', '')} | {row['seconds']:.1f} |"
                for row in sorted(done, key=lambda row: row["floor"] - row["after"])
            ),
            "",
            "| Refused because | fits |",
            "| --- | --: |",
            *(f"| {_kind(why)} | {count} |" for why, count in refused.most_common(15)),
        ]
    )


def _kind(sentence: str) -> str:
    """A sentence without the names and numbers in it, so that sentences of one kind count together."""
    parts = sentence.split("'")
    return re.sub(r"\d+(\.\d+)?", "N", "'...'".join(parts[::2]) if len(parts) % 2 else sentence)
