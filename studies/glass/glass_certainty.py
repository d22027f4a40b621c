# SPDX-License-Identifier: Apache-2.0
"""Scenes of glass fitted to several references each: errors of the values, and whether their certainties are true.

    python -m studies.glass.glass_certainty [--scenario transparency] [--scenes 0 4 7] [--references 4] [--all-values]
        [--size 128] [--preset balanced] [--with coat_weight=0.5 coat_roughness=0.3] [--out rows.jsonl]

Scenes are those of `mfo bench`, references have random numbers that no bench and no fit uses. `--all-values` frees all
of the material's values, as the panel does, and not the scenario's; `--with` gives the truth values that the scenario
does not draw (the start has them off). An error is in parts of a value's range. A value is
inside where the truth lies within 1.96 of its deviations; those that the picture does not show are not counted. One is
wrong that is called determined and is off by more than three deviations and by more than 0.02.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from studies.recovery.scene_fit import fit_to, open_bench_scene, reference_of, true_vector, write_bench_scene

ROOT = Path(__file__).resolve().parents[2]

REFERENCE_STREAM = 0x6C000000
WRONG_BY = 0.02


def measure(scene: Any, number: int, arguments: argparse.Namespace) -> dict[str, Any]:
    """Fit a scene to its reference of this number."""
    from mfo_backend.render.pictures.pass_counter import PassCounter
    from mfo_backend.types.certainty import Level

    renderer, settings = open_bench_scene(scene, arguments.preset, all_values=arguments.all_values)
    table, truth = renderer.table, true_vector(scene, renderer)
    if arguments.truth:
        table.select(name for name, _ in arguments.truth)  # refuses what the fit holds: it would change nothing
    reference = reference_of(scene, renderer, REFERENCE_STREAM + 1000 * number + scene.number)
    renderer.counter, began = PassCounter(), time.process_time()
    result = fit_to(renderer, reference, settings)
    seconds = time.process_time() - began
    error = np.abs(table.pack(result.recovered) - truth)
    sd = np.concatenate([result.certainty[name].sd for name in table.names])
    levels = [result.certainty[p.name].level for p in table for _ in range(p.size)]
    names = [p.name for p in table for _ in range(p.size)]
    seen = np.array([level not in (Level.NOT_VISIBLE, Level.NOT_TOLD_APART) for level in levels])
    determined = np.array([level is Level.DETERMINED for level in levels])
    return {
        "scene": scene.number,
        "reference": number,
        "object": scene.object,
        "light": scene.light,
        "cpu_seconds": seconds,
        "passes": result.passes,
        "error": float(np.mean(error / (table.upper - table.lower))),
        "inside": int((error <= 1.96 * sd)[seen].sum()),
        "seen": int(seen.sum()),
        "determined": int(determined.sum()),
        "wrong": np.array(names)[determined & (error > np.maximum(3.0 * sd, WRONG_BY))].tolist(),
        "recovered": dict(result.recovered),
    }


def summary(rows: list[dict[str, Any]]) -> str:
    """All rows in a line."""
    total = {key: sum(row[key] for row in rows) for key in ("inside", "seen", "determined")}
    wrong = sum(len(row["wrong"]) for row in rows)
    errors = [100 * row["error"] for row in rows]
    cpu, passes = (float(np.median([row[key] for row in rows])) for key in ("cpu_seconds", "passes"))
    return (
        f"{len(rows)} fits: error of the values {np.mean(errors):.2f} % of their ranges, 90 % below "
        f"{np.quantile(errors, 0.9):.2f}; inside {100 * total['inside'] / max(total['seen'], 1):.0f} % of "
        f"{total['seen']}; wrong {wrong} of {total['determined']}; median {cpu:.1f} CPU s, {passes:.0f} passes"
    )


def _value(text: str) -> tuple[str, float]:
    name, _, number = text.partition("=")
    return name, float(number)


def main() -> None:
    """Fit scene after scene and print what each gives."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="transparency")
    parser.add_argument("--scenes", type=int, nargs="+", default=list(range(8)))
    parser.add_argument("--references", type=int, default=1)
    parser.add_argument("--all-values", action="store_true")
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--with", dest="truth", type=_value, nargs="+", default=[], metavar="NAME=VALUE")
    parser.add_argument("--out", type=Path, help="also append a JSON line for each fit")
    chosen = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory(prefix="mfo-certainty-") as folder:
        for number in chosen.scenes:
            scene = write_bench_scene(chosen.scenario, number, chosen.size, Path(folder) / str(number))
            scene = replace(scene, truth={**scene.truth, **dict(chosen.truth)})
            for reference in range(chosen.references):
                row = measure(scene, reference, chosen)
                rows.append(row)
                print(
                    f"{number} {reference} {row['object']} under {row['light']}: error {100 * row['error']:.2f} %, "
                    f"inside {row['inside']} of {row['seen']}, wrong {row['wrong']}, {row['cpu_seconds']:.1f} CPU s",
                    flush=True,
                )
                if chosen.out is not None:
                    with chosen.out.open("a") as lines:
                        lines.write(json.dumps(row) + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()
