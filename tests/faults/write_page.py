# SPDX-License-Identifier: Apache-2.0
"""Tables of `docs/reference/reliability.md` from the records of measured runs: ``python -m tests.faults.write_page``.

A record that is missing leaves its table saying so. The text around the tables is written by hand.
"""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "reliability.md"
RECORDS = ROOT / "docs" / "reliability"


def main() -> None:
    """Rewrite the page and its plots in place."""
    PAGE.write_text(page(PAGE.read_text("utf-8")), "utf-8")
    for name in ("backend", "blender"):
        record = _record(name)
        if record is not None:
            (RECORDS / f"{name}.svg").write_text(memory_plot(record), "utf-8")


def page(text: str) -> str:
    """The page with everything between ``<!-- table NAME -->`` and ``<!-- end -->`` made anew."""

    def filled(found: re.Match[str]) -> str:
        name = found[1]
        record = _record(name)
        body = TABLES[name](record) if record is not None else f"Not measured yet: no `reliability/{name}.json`.\n"
        return f"<!-- table {name} -->\n{body}<!-- end -->"

    return re.sub(r"<!-- table (\w+) -->\n.*?<!-- end -->", filled, text, flags=re.DOTALL)


def _record(name: str) -> Any:
    path = RECORDS / f"{name}.json"
    return json.loads(path.read_text("utf-8")) if path.exists() else None


def _table(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    lines = [list(map(str, head)), *(list(map(str, row)) for row in rows)]
    lines.insert(1, ["---"] * len(lines[0]))
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def _fuzz(record: Any) -> str:
    rows = [(name, f"{r['inputs']:,}", f"{r['cpu_seconds']:.0f} s", r["killed"]) for name, r in record.items()]
    total = [sum(r[key] for r in record.values()) for key in ("inputs", "cpu_seconds", "killed")]
    rows.append(("all", f"{total[0]:,}", f"{total[1]:.0f} s", total[2]))
    return _table(("reader", "inputs", "processor time", "crashes"), rows)


def _kill(record: Any) -> str:
    a, b = record["blender"], record["backend"]
    order = {"none": "starting", "opened": "exporting", "started": "fitting", "fitted": "applying", "applied": "saving",
             "saved": "done"}  # fmt: skip
    killed = a["killed_after"]
    after = ", ".join(f"{killed[step]} while {word}" for step, word in order.items() if step in killed)
    rows = [
        ("moments", a["moments"], b["moments"]),
        ("of them before the end", a["moments"] - a["killed_after"].get("saved", 0), b["killed"]),
        (".blend or material as it was", a["unchanged"], b["moments"] - b["complete"] - b["half"]),
        ("all values of a result", a["complete"], b["complete"]),
        ("half-applied material", a["half"], b["half"]),
        (".blend that does not open", a["unreadable"], "-"),
        ("material changed without Apply, or not reverted", "-", b["changed_without_apply"] + b["not_reverted"]),
        ("end without a sentence", "-", b["without_sentence"]),
        ("processes left after 12 s", a["orphans"], "-"),
        ("temporary files after the next start", len(a["left_after_next_start"]), len(b["left"])),
    ]
    return (
        _table(("", "Blender killed", "backend killed"), rows)
        + f"\n{textwrap.fill(f'Blender was killed {after}.', 118)}\n"
    )


def _limits(record: Any) -> str:
    rows = []
    for r in record:
        ended = f"signal {-r['exit']}" if r["exit"] < 0 else f"exit code {r['exit']}"
        rows.append((r["fault"], ended, r["sentence"] or "(native code crashed)", r["result"], len(r["left"])))
    return _table(("fault", "backend", "its last sentence", "result", "temporary files"), rows)


def _heavy(record: Any) -> str:
    rows = [(r["what"], r["exit"], r["sentence"], f"{r['megabytes']:,} MB", f"{r['cpu_seconds']} s") for r in record]
    return _table(("run", "exit code", "its sentence", "peak resident memory", "processor time"), rows)


def _endurance(record: Any) -> str:
    rows = [
        ("fits, of them failed", f"{record['fits']}, {record['bad']}"),
        ("seconds of a fit, first and last tenth", " and ".join(f"{s:.2f}" for s in record["seconds"])),
        ("resident memory, first and last tenth", " and ".join(f"{m:.0f} MB" for m in record["megabytes"])),
        ("memory by fit, a line through all", f"{record['megabytes_per_fit'] * 1000:.0f} kB"),
        ("open files, threads (first to last tenth)", "; ".join(f"{a:.0f} to {b:.0f}" for a, b in
                                                             (record["files"], record["threads"]))),
    ]  # fmt: skip
    if "kernels" in record:
        rows.append(("kernels on disk after the warm-up and at the end", " and ".join(map(str, record["kernels"]))))
    if "images" in record:
        rows.append(("image datablocks, first and last", " and ".join(map(str, record["images"]))))
    return _table(("", ""), rows)


def _repeat(record: Any) -> str:
    rows = []
    for preset, r in record.items():
        for part, words in (("values", "recovered values, certainty"), ("errors", "errors")):
            cells = [_difference(r[part][key]) for key in ("one_thread", "same_threads", "any_threads")]
            rows.append((preset, r["runs"], words, *cells))
    return _table(("preset", "runs", "part of result.json", "one thread", "1, 2 or 4 threads, same count", "any"), rows)


def _difference(value: float) -> str:
    return "equal bits" if value == 0.0 else f"{value:.1e}"


TABLES: dict[str, Callable[[Any], str]] = {
    "fuzz": _fuzz,
    "kill": _kill,
    "limits": _limits,
    "heavy": _heavy,
    "backend": _endurance,
    "blender": _endurance,
    "repeat": _repeat,
}


def memory_plot(record: Any, width: int = 640, height: int = 220) -> str:
    """Resident memory and seconds over the fits, one small SVG."""
    megabytes = [row[1] for row in record["rows"]]
    seconds = [row[0] for row in record["rows"]]

    def line(values: list[float], top: float, color: str) -> str:
        step = (width - 60) / max(len(values) - 1, 1)
        points = " ".join(
            f"{50 + i * step:.1f},{height - 25 - (height - 50) * v / top:.1f}" for i, v in enumerate(values)
        )
        return f'<polyline fill="none" stroke="{color}" stroke-width="1.5" points="{points}"/>'

    top, slow = 1.1 * max(megabytes), 1.1 * max(seconds)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" '
        f'font-size="11"><rect width="{width}" height="{height}" fill="white"/>'
        f"{line(seconds, slow, '#bbbbbb')}{line(megabytes, top, '#1f77b4')}"
        f'<text x="50" y="15">resident memory, 0 to {top:.0f} MB (blue), and seconds of a fit, 0 to {slow:.1f} (grey)'
        f'</text><text x="{width - 70}" y="{height - 8}">fit {len(megabytes)}</text></svg>\n'
    )


if __name__ == "__main__":
    main()
