# SPDX-License-Identifier: Apache-2.0
"""The page about the faults that were tried: how many the tests noticed, and why each other one was not."""

from __future__ import annotations

from collections.abc import Iterable

from .reasons import REASONS

_HEAD = """# Faults that the tests notice

Written by `python -m studies.mutants` (options: `--help`). One fault at a time is put into a copy of the sources, and
the tests of the same folder run up to the first failure. Faults are drawn from those that operators find in the syntax
tree (an inverted comparison, another arithmetic operator, a dropped sign, a changed number, a deleted statement); some
are written by hand, because they were once noticed by no test.
"""


def page(rows: Iterable[dict], places: list[str]) -> str:
    """The whole page in Markdown from the last row of each fault."""
    rows = [row for row in rows if row["state"] in ("killed", "survived")]
    lines = [_HEAD, "| where | faults | noticed | share |", "|---|--:|--:|--:|"]
    listed = set()
    for place in [*places, ""]:
        here = [row for row in rows if row["path"].startswith(place) and row["mutant"] not in listed]
        listed |= {row["mutant"] for row in here}
        if here:
            lines.append(_count(f"`{place}`" if place else "elsewhere", here))
    if rows:
        lines.append(_count("all", rows))
    lines += ["", f"Commits: {', '.join(sorted({row['commit'] for row in rows}))}.", "", "## Not noticed", ""]
    for row in sorted(rows, key=lambda row: row["mutant"]):
        if row["state"] == "survived":
            reason = REASONS.get(row["mutant"], "No reason is known: a test is missing.")
            lines += [f"- `{row['path']}`, line {row['line']}:", f"  `{row['old']}`", "  became", f"  `{row['new']}`."]
            lines.append(f"  {reason}")
    return "\n".join(lines) + "\n"


def _count(name: str, rows: list[dict]) -> str:
    killed = sum(row["state"] == "killed" for row in rows)
    return f"| {name} | {len(rows)} | {killed} | {100 * killed / len(rows):.0f} % |"
