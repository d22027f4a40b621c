# SPDX-License-Identifier: Apache-2.0
"""Put faults into the sources, one at a time, and see whether the tests of the same folder notice.

    python -m studies.mutants [--commit HEAD] [--seed 1] [--most 200] [--again] [--only PREFIX ...]
        [--rows mutants.jsonl] [--doc mutants.md]

The faults are those written by hand (`by_hand.py`) and a draw of those that operators find in the syntax tree
(`operators.py`); the draw stays the same for a fault as long as its text does. Every outcome is a line of the rows'
file, so a run that was stopped goes on where it was; `--again` runs those once more that survived. The tests run on a
copy of a commit and stop at the first failure. Tests that fail without any fault are not counted. The page is
written anew from the rows after each run; docs/notebook/mutants.md sums up all runs.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
import tempfile
from collections.abc import Iterable
from itertools import zip_longest
from pathlib import Path

from .by_hand import by_hand
from .one_run import copy_of, failing, outcome_of
from .operators import Mutant, mutants_of
from .page import page

ROOT = Path(__file__).resolve().parents[2]

# folder or file -> how many faults are drawn in it
DRAWN = {
    "mfo_backend/material/arrays": 4,
    "mfo_backend/material/plugins": 6,
    "mfo_backend/material/principled": 10,
    "mfo_backend/metrics": 24,
    "mfo_backend/solve": 14,
    "mfo_backend/scene": 18,
    "mfo_backend/fit/alike": 6,
    "mfo_backend/fit/certainty": 6,
    "mfo_backend/fit/judge": 10,
    "mfo_backend/fit/recorded": 6,
    "mfo_backend/fit/search": 6,
    "mfo_backend/fit/squares": 8,
    "mfo_backend/fit/traced": 4,
    "mfo_backend/job/folder": 6,
    "mfo_backend/job/output": 4,
    "mfo_backend/job/run": 10,
    "mfo_backend/render/lamps": 6,
    "mfo_backend/render/paths": 6,
    "mfo_backend/render/transport": 6,
    "blender_addon/export/images": 6,
    "blender_addon/export/lights": 8,
    "blender_addon/export/materials": 8,
    "blender_addon/export/nodes": 8,
    "blender_addon/export/reference": 6,
    "blender_addon/export/scene": 8,
    "blender_addon/probe": 6,
    "blender_addon/process/saved_file.py": 5,
    "blender_addon/result": 10,
}


def drawn(root: Path, seed: int) -> list[Mutant]:
    """The faults to try: those by hand, then one of each folder in turn, by each operator in turn."""
    lists = []
    for place, count in DRAWN.items():
        files = [root / place] if place.endswith(".py") else sorted((root / place).rglob("*.py"))
        found = {}
        for file in files:
            for mutant in mutants_of(file.relative_to(root).as_posix(), file.read_bytes()):
                found.setdefault(mutant.name, mutant)
        kinds: dict[str, list[Mutant]] = {}
        for mutant in sorted(found.values(), key=lambda mutant: _lot(mutant, seed)):
            kinds.setdefault(mutant.operator, []).append(mutant)
        lists.append(_in_turn(kinds.values())[:count])
    return [*by_hand(root), *_in_turn(lists)]


def _in_turn(lists: Iterable[list[Mutant]]) -> list[Mutant]:
    return [mutant for turn in zip_longest(*lists) for mutant in turn if mutant is not None]


def _lot(mutant: Mutant, seed: int) -> bytes:
    return hashlib.sha256(f"{seed} {mutant.name}".encode()).digest()


def rows_of(path: Path) -> list[dict]:
    """The rows that are there, in the order in which they were written."""
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()] if path.exists() else []


def main() -> None:
    """Run the faults that have no row yet, check the tests that noticed them, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commit", default="HEAD")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=200, help="how many faults at most in this run")
    parser.add_argument("--again", action="store_true", help="run those once more that survived")
    parser.add_argument("--only", nargs="*", default=[""], help="those of the paths that begin so")
    parser.add_argument("--rows", type=Path, default=Path("mutants.jsonl"))
    parser.add_argument("--doc", type=Path, default=Path("mutants.md"))
    chosen = parser.parse_args()
    commit = subprocess.run(
        ["git", "rev-parse", "--short", chosen.commit], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True
    ).stdout.strip()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Path(folder)
        copy_of(ROOT, commit, copy)
        mutants = [mutant for mutant in drawn(copy, chosen.seed) if mutant.path.startswith(tuple(chosen.only))]
        last = {row["mutant"]: row["state"] for row in rows_of(chosen.rows)}
        done = {name for name, state in last.items() if not (chosen.again and state == "survived")}
        for mutant in [mutant for mutant in mutants if mutant.name not in done][: chosen.most]:
            outcome = outcome_of(mutant, copy)
            if outcome.state == "killed" and "::" in outcome.by and failing([outcome.by], copy):
                outcome = type(outcome)("not counted", f"{outcome.by} fails without a fault", outcome.seconds)
            row = {"mutant": mutant.name, "path": mutant.path, "line": mutant.line, "operator": mutant.operator}
            row |= {"old": mutant.old, "new": mutant.new}
            row |= {"state": outcome.state, "by": outcome.by, "seconds": outcome.seconds, "commit": commit}
            with chosen.rows.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            print(f"{outcome.state:9} {outcome.seconds:6.1f} s  {mutant.name}  {outcome.by}", flush=True)
    chosen.doc.write_text(page(rows_of(chosen.rows), list(DRAWN)), "utf-8")


if __name__ == "__main__":
    main()
