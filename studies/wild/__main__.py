# SPDX-License-Identifier: Apache-2.0
"""Try .blend files that nobody here made: how they are read, and recoveries judged by Cycles.

    python -m studies.wild read FOLDER --rows read.jsonl [--files N]
    python -m studies.wild recover FOLDER --read read.jsonl --rows recover.jsonl [--fits N] [--size 96] [--samples 64]
        [--seed 20] [--inside]
    python -m studies.wild table --read read.jsonl [--rows recover.jsonl] [--doc FILE]

FOLDER has the files, the first folder below it naming the author (`studies/wild/sources.txt` lists public repositories
that hold some). Rows that are there are skipped, so a run that was stopped goes on. `recover` renders a material by
Cycles as the reference, gives its unlinked values others (`--inside`: those inside nodes, too), runs
`mfo blend --apply` and renders the saved file; FLIP is taken over the target's pixels by `mfo judge`. Materials are
taken in turn from the authors.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from .rows import Row, add_row, how_read, read_rows, reading_table, recovery_table

READ_SECONDS, RENDER_SECONDS, FIT_SECONDS = 120.0, 300.0, 300.0  # of one child process; more is a row that says so
SEED = 20  # of the order of materials and of their starts, where no other is chosen


class ChildError(Exception):
    """A child process failed; the message is its last line."""


def child(words: list[str], seconds: float) -> dict[str, Any]:
    """The JSON object that a child process says last.

    Raises
    ------
    ChildError
        If it takes longer than that or says none.
    """
    try:
        done = subprocess.run(
            [sys.executable, "-m", *words], capture_output=True, text=True, timeout=seconds, errors="replace"
        )
    except subprocess.TimeoutExpired as error:
        raise ChildError(f"more than {seconds:.0f} s") from error
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    try:
        return json.loads(lines[-1])
    except (IndexError, ValueError):
        last = (done.stderr.strip().splitlines() or ["no word"])[-1]
        said = json.loads(last)["sentence"] if last.startswith('{"') else last[:200]
        raise ChildError(f"ended with {done.returncode}: {said}") from None


def read_files(chosen: argparse.Namespace) -> None:
    """One row a file: what the export says of each of its materials."""
    known = {row["file"] for row in read_rows(chosen.rows)}
    files = sorted(chosen.folder.rglob("*.blend"))
    random.Random(SEED).shuffle(files)
    for path in files[: chosen.files]:
        name = str(path.relative_to(chosen.folder))
        if name in known:
            continue
        try:
            answer = child(["studies.wild.in_blender", "read", str(path)], READ_SECONDS)
        except ChildError as error:
            answer = {"failed": str(error)}
        add_row(chosen.rows, {"file": name, **answer})


def recover_materials(chosen: argparse.Namespace) -> None:
    """One row a material, the authors in turn."""
    known = {(row["file"], row["material"]) for row in read_rows(chosen.rows)}
    for material in in_turn(read_rows(chosen.read), chosen.seed)[: chosen.fits]:
        if (material["file"], material["material"]) not in known:
            add_row(chosen.rows, recover(chosen, material))


def in_turn(rows: list[Row], seed: int = SEED) -> list[Row]:
    """Materials that are no bare emission, one of each author after the other, in an order drawn once."""
    draw = random.Random(seed)
    authors: dict[str, list[Row]] = {}
    for row in rows:
        for material in row.get("materials", ()):
            if material["sort"] != "emission":
                authors.setdefault(row["file"].split("/")[0], []).append({"file": row["file"], **material})
    queues = [draw.sample(materials, len(materials)) for _, materials in sorted(authors.items())]
    return [queue[i] for i in range(max(map(len, queues), default=0)) for queue in queues if i < len(queue)]


def recover(chosen: argparse.Namespace, material: Row) -> Row:
    """Recover one material of one file from its own render; what is refused is not tried."""
    row = {"file": material["file"], "material": material["material"], "read": how_read(material)}
    if material["errors"]:
        return row | {"why": material["errors"][0]}
    folder = Path(tempfile.mkdtemp(prefix="mfo-wild-"))
    job, fitted, target = folder / "job", folder / "fitted.blend", f"--object={material['object']}"
    blender, samples = "studies.wild.in_blender", f"--samples={chosen.samples}"
    try:
        prepare = [str(chosen.folder / material["file"]), target, f"--slot={material['slot']}"]
        prepare += [f"--seed={chosen.seed}", f"--view={material['view']}", *(["--inside"] if chosen.inside else [])]
        child([blender, "prepare", *prepare, f"--out={folder}", f"--size={chosen.size}", samples], RENDER_SECONDS)
        began = time.monotonic()
        fit = [f"{folder}/start.blend", target, f"--reference={folder}/reference.exr", f"--out={job}"]
        fit += ["--shader=all"] if material["sort"] == "mix" else []  # all of them have moved
        said = child(
            ["mfo_backend", "blend", *fit, "--apply", "--make-local", f"--save-as={fitted}", "--json"], FIT_SECONDS
        )
        row["seconds"] = round(time.monotonic() - began, 2)
        if not (job / "result.json").is_file():
            return row | {"why": said.get("sentence", "no result")}
        result = json.loads((job / "result.json").read_text("utf-8"))
        row |= {"verdict": result.get("verdict", ""), "notes": result["notes"]}
        if not fitted.is_file():
            shutil.copyfile(folder / "start.blend", fitted)  # nothing was applied
        child([blender, "render", str(fitted), "--seed=3", f"--out={folder}/after.exr", samples], RENDER_SECONDS)
        for name in ("before", "after", "floor"):
            judged = child(["mfo_backend", "judge", str(job), f"{folder}/{name}.exr", "--json"], FIT_SECONDS)
            if "metrics" not in judged:
                return row | {"why": judged["sentence"]}
            row[name] = round(judged["metrics"]["flip"], 5)
        return row
    except ChildError as error:
        return row | {"why": str(error)}
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def write_table(chosen: argparse.Namespace) -> None:
    """Print the tables or write them into a page."""
    parts = ["# Files that nobody here made", "", "Written by `python -m studies.wild table`.", ""]
    parts += [reading_table(read_rows(chosen.read))]
    if chosen.rows:
        parts += ["", recovery_table(read_rows(chosen.rows))]
    text = "\n".join(parts) + "\n"
    if chosen.doc:
        chosen.doc.write_text(text, "utf-8")
    else:
        print(text)


def main() -> None:
    """Run one part of the study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    command = commands.add_parser("read")
    command.add_argument("folder", type=Path)
    command.add_argument("--rows", type=Path, required=True)
    command.add_argument("--files", type=int, default=None)
    command.set_defaults(run=read_files)
    command = commands.add_parser("recover")
    command.add_argument("folder", type=Path)
    command.add_argument("--read", type=Path, required=True)
    command.add_argument("--rows", type=Path, required=True)
    command.add_argument("--fits", type=int, default=40)
    command.add_argument("--size", type=int, default=96)
    command.add_argument("--samples", type=int, default=64)
    command.add_argument("--seed", type=int, default=SEED)
    command.add_argument("--inside", action="store_true")
    command.set_defaults(run=recover_materials)
    command = commands.add_parser("table")
    command.add_argument("--read", type=Path, required=True)
    command.add_argument("--rows", type=Path)
    command.add_argument("--doc", type=Path)
    command.set_defaults(run=write_table)
    chosen = parser.parse_args()
    chosen.run(chosen)


if __name__ == "__main__":
    main()
