# SPDX-License-Identifier: Apache-2.0
"""Fit the same scenes with each rule switched off and say what changes.

    python -m studies.ablate [--rules NAME ...]
        [--scenes base=20 noise=20 parameters=10 transparency_4spp=6 measured=8 cycles=6 hard=24] [--size 64]
        [--most 100000] [--rows ablations.jsonl] [--doc docs/notebook/ablations.md]

The rules are those of `rules.py`, the scenes those of `mfo bench` and its hard cases: truths and starts are drawn at
random and do not depend on each other. The preset is `balanced`. Every fit is a line of the rows' file, so a run that
was stopped goes on where it was. A scene is fitted once for nothing, so that all its kernels are there, then with
every rule on, then with each one off. The page's table is written anew from the rows after each run.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from contextlib import nullcontext
from pathlib import Path

from mfo_backend.bench.runs.machine import source_commit

from .one_fit import OneFit
from .page import page
from .rules import RULES, switched_off

ROOT = Path(__file__).resolve().parents[2]
SCENES = {"base": 20, "noise": 20, "parameters": 10, "transparency_4spp": 6, "measured": 8, "cycles": 6, "hard": 24}
ALL_ON = ""
SAID = "\n## "  # what people have written below the table is kept


def main() -> None:
    """Measure what has no row yet, scene by scene, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rules", nargs="*", choices=[rule.name for rule in RULES], help="all without it")
    parser.add_argument("--scenes", nargs="*", default=[f"{name}={count}" for name, count in SCENES.items()])
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--most", type=int, default=100_000, help="how many rows at most in this run")
    parser.add_argument("--rows", type=Path, default=Path("ablations.jsonl"))
    parser.add_argument("--doc", type=Path, default=ROOT / "docs" / "notebook" / "ablations.md")
    chosen = parser.parse_args()
    commit = source_commit()
    rules = [rule for rule in RULES if chosen.rules is None or rule.name in chosen.rules]
    counts = {name: int(count) for name, _, count in (part.partition("=") for part in chosen.scenes)}
    places = [(name, scene) for scene in range(max(counts.values())) for name in counts if scene < counts[name]]
    done = {(row["rule"], row["scenario"], row["scene"]) for row in rows_of(chosen.rows)}
    written = 0
    with tempfile.TemporaryDirectory() as folder:
        fit = OneFit(Path(folder), chosen.size)
        for scenario, scene in places:
            here = [None, *(rule for rule in rules if scenario in rule.scenarios)]
            missing = [rule for rule in here if (rule.name if rule else ALL_ON, scenario, scene) not in done]
            if not missing or written >= chosen.most:
                continue
            fit(scenario, scene)  # compiles
            for rule in missing:
                with switched_off(rule) if rule else nullcontext():
                    found = fit(scenario, scene)
                row = {"rule": rule.name if rule else ALL_ON, "scenario": scenario, "scene": scene, **found}
                with chosen.rows.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row | {"size": chosen.size, "commit": commit}) + "\n")
                written += 1
    _, heading, said = chosen.doc.read_text("utf-8").partition(SAID) if chosen.doc.exists() else ("", "", "")
    chosen.doc.write_text(page(rows_of(chosen.rows)) + heading + said, "utf-8")


def rows_of(path: Path) -> list[dict]:
    """The rows that are there."""
    return [json.loads(line) for line in path.read_text("utf-8").splitlines()] if path.exists() else []


if __name__ == "__main__":
    main()
