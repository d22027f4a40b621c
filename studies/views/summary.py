# SPDX-License-Identifier: Apache-2.0
"""What the rows of `studies.views` say, in lines of text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

_OPEN = ("weak", "not_visible", "not_told_apart")
KNOWN = 0.15  # of the box: a deviation above it is none (`fit/tolerances.py`)
WITHIN = 1.5  # factor between the predicted and the realised deviation


def summary(rows: Sequence[dict[str, Any]]) -> str:
    """The lines."""
    open_ones, settled = 0, {"proposed": 0, "drawn": 0}
    weak_ones, weak_settled = 0, {"proposed": 0, "drawn": 0}
    better, compared, ratios = 0, 0, []
    for row in rows:
        before = row["one"]["certainty"]
        left = [name for name, c in before.items() if c["level"] in _OPEN]
        weak = [name for name, c in before.items() if c["level"] == "weak"]
        open_ones, weak_ones = open_ones + len(left), weak_ones + len(weak)
        for kind in settled:
            after = row[kind]["certainty"]
            settled[kind] += sum(after.get(name, {}).get("level") == "determined" for name in left)
            weak_settled[kind] += sum(after.get(name, {}).get("level") == "determined" for name in weak)
        if row["proposal"]:
            predicted = row["proposal"]["predicted"]
            after = row["proposed"]["certainty"]
            bounds = row["one"]["bounds"]
            for name, sd in predicted.items():
                width = bounds[name][1] - bounds[name][0]
                # a value that may lie anywhere is no better known than that, whatever its number says
                if sd < KNOWN * width and name in after:
                    ratios.append(min(after[name]["sd"], KNOWN * width) / sd)
            spreads = [_log_spread(row[kind]["certainty"], predicted) for kind in ("proposed", "drawn")]
            compared, better = compared + 1, better + (spreads[0] < spreads[1])
    near = np.mean([1.0 / WITHIN <= ratio <= WITHIN for ratio in ratios]) if ratios else float("nan")
    planted = [row["planted"]["contradiction"] for row in rows]
    right = sum(bool(c) and len(c["pictures"]) == 1 and c["pictures"][0].startswith("2 ") for c in planted)
    among = sum(bool(c) and any(p.startswith("2 ") for p in c["pictures"]) for c in planted)
    silent = sum(not c and row["planted"]["verdict"] == "same" for c, row in zip(planted, rows, strict=True))
    false = sum(bool(row[kind]["contradiction"]) for row in rows for kind in ("proposed", "drawn", "three"))
    return "\n".join(
        (
            f"scenes: {len(rows)}",
            f"values not determined after one picture: {open_ones}; determined after the proposed second: "
            f"{settled['proposed']}, after a drawn one: {settled['drawn']}",
            f"of these weak: {weak_ones}; determined after the proposed second: {weak_settled['proposed']}, after a "
            f"drawn one: {weak_settled['drawn']}",
            f"proposed better than drawn: {better} of {compared}",
            f"realised deviation over predicted: median {np.median(ratios) if ratios else float('nan'):.2f}, within a "
            f"factor {WITHIN}: {100 * near:.0f} % of {len(ratios)}",
            f"planted contradictions: named {right} of {len(rows)}, among those named {among}, silent {silent}; named "
            f"where there is none: {false} of {3 * len(rows)}",
            f"seconds: one {np.median([r['one']['seconds'] for r in rows]):.1f}, two "
            f"{np.median([r['proposed']['seconds'] for r in rows]):.1f}, three "
            f"{np.median([r['three']['seconds'] for r in rows]):.1f}",
        )
    )


def _log_spread(certainty: dict[str, Any], names: dict[str, float]) -> float:
    """Mean logarithm of the deviations of these values."""
    return float(np.mean([np.log(max(certainty[name]["sd"], 1e-6)) for name in names if name in certainty]))
