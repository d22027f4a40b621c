# SPDX-License-Identifier: Apache-2.0
"""The page about the faults that were tried: how many the tests noticed, and why each other one was not."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import fill

from .reasons import REASONS

_HEAD = """# Faults that the tests notice

Written by `python -m studies.mutants` (options: `--help`). One fault at a time is put into a copy of the sources, and
the tests of the same folder run up to the first failure. Faults are drawn from those that operators find in the syntax
tree (an inverted comparison, another arithmetic operator, a dropped sign, a changed number, a deleted statement); some
are written by hand, because they were once noticed by no test. Where a fault that was wrong behaviour was not noticed
at first, a test was written.
"""


def page(rows: Iterable[dict], places: list[str]) -> str:
    """The whole page in Markdown; of several rows of a fault the first and the last count."""
    counted = [row for row in rows if row["state"] in ("killed", "survived")]
    at_first = {row["mutant"]: row["state"] for row in reversed(counted)}
    rows = list({row["mutant"]: row for row in counted}.values())
    lines = [_HEAD, "| where | faults | noticed at first | noticed now | share |", "|---|--:|--:|--:|--:|"]
    listed = set()
    for place in [*places, ""]:
        here = [row for row in rows if row["path"].startswith(place) and row["mutant"] not in listed]
        listed |= {row["mutant"] for row in here}
        if here:
            lines.append(_count(f"`{place}`" if place else "elsewhere", here, at_first))
    if rows:
        lines.append(_count("all", rows, at_first))
    lines += ["", f"Commits: {', '.join(sorted({row['commit'] for row in rows}))}.", "", "## Not noticed", ""]
    for row in sorted(rows, key=lambda row: row["mutant"]):
        if row["state"] == "survived":
            reason = REASONS.get(row["mutant"], "No reason is known: a test is missing.")
            lines += [f"`{row['path']}`, line {row['line']}:", ""]
            lines += ["```diff", f"- {row['old']}", f"+ {row['new']}", "```", "", fill(reason, 118), ""]
    return "\n".join(lines).rstrip() + "\n"


def _count(name: str, rows: list[dict], at_first: dict[str, str]) -> str:
    first = sum(at_first[row["mutant"]] == "killed" for row in rows)
    killed = sum(row["state"] == "killed" for row in rows)
    return f"| {name} | {len(rows)} | {first} | {killed} | {100 * killed / len(rows):.0f} % |"
