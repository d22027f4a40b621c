# SPDX-License-Identifier: Apache-2.0
"""The page about what each rule is worth, from pairs of fits with it and without it."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from .rules import RULES

_HEAD = """# What each rule of a fit is worth

Written by `python -m studies.ablate` (options: `--help`). Each line compares fits of the preset `balanced` on the same
scenes, with the rule and without it, all others on. *solved*: mean FLIP at most 0.02, for hard cases what each case
asks. *worse* and *better*: scenes whose error without the rule is more than a tenth and 0.0005 above or below. *wrong*:
values that the fit calls determined and that are not the truth's. *CPU*: median over the scenes of the seconds without
the rule over those with it; for hard cases the judging is in them. A rule whose line says nothing on these scenes may
still matter on others.

| rule | scenes | fits | changed | solved with | without | worse | better | wrong with | without | CPU |
|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|
"""
WORSE_SHARE, WORSE_LEAST = 0.1, 5e-4


def page(rows: Sequence[dict]) -> str:
    """The whole page in Markdown; of two rows of one fit the later one counts."""
    found = {(row["rule"], row["scenario"], row["scene"]): row for row in rows}
    lines = []
    for rule in RULES:
        for scenario in rule.scenarios:
            keys = [key for key in found if key[:2] == (rule.name, scenario) and ("", *key[1:]) in found]
            if keys:
                pairs = [(found[("", *key[1:])], found[key]) for key in sorted(keys)]
                lines.append(f"| {rule.name} | {scenario} | {' | '.join(_cells(pairs))} |")
    sizes, commits = ({str(row[name]) for row in rows} for name in ("size", "commit"))
    end = f"\nPixels: {', '.join(sorted(sizes))} each way. Commits: {', '.join(sorted(commits))}.\n"
    return _HEAD + "\n".join(lines) + "\n" + end


def _cells(pairs: list[tuple[dict, dict]]) -> list[str]:
    changes = [_change(on, off) for on, off in pairs]
    ratios = [off["seconds"] / on["seconds"] for on, off in pairs if on["seconds"] and off["seconds"]]
    return [
        str(len(pairs)),
        str(sum((on["error"], on["wrong"]) != (off["error"], off["wrong"]) for on, off in pairs)),
        *(str(sum(pair[side]["solved"] for pair in pairs)) for side in (0, 1)),
        *(str(changes.count(sign)) for sign in (1, -1)),
        *(str(sum(len(pair[side]["wrong"]) for pair in pairs)) for side in (0, 1)),
        f"{median(ratios):.2f}" if ratios else "",
    ]


def _change(on: dict, off: dict) -> int:
    """1 where the fit without the rule is worse, -1 where it is better, else 0."""
    before, after = (float("inf") if row["error"] is None else row["error"] for row in (on, off))
    if before == after:
        return 0
    least = max(WORSE_LEAST, WORSE_SHARE * min(before, after))
    return 0 if abs(after - before) <= least else 1 if after > before else -1
