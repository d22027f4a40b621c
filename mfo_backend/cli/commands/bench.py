# SPDX-License-Identifier: Apache-2.0
"""`mfo bench`: speed against error on random scenes, and `mfo bench report DIR`: tables and plots of its rows."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from ...bench.report.figure import require_matplotlib
from ...bench.report.headline import fill, has_block
from ...bench.report.report import write_report
from ...bench.rows.method import DEFAULT_METHODS, METHODS, missing_for
from ...bench.rows.row import Row
from ...bench.rows.row_file import RowFile, keep_setup
from ...bench.runs.run_bench import all_tasks, run_bench
from ...bench.runs.scatter import FitRecipe, run_scattered
from ...bench.scenes.assets import Assets
from ...bench.scenes.scenario import SCENARIOS
from ...job.cluster import open_client, threads_each
from ...job.folder.atomic_file import write_atomically
from ...job.output.progress_bar import terminal_columns
from ...job.run.stop import StopSignal
from ...types.errors import BadInputError, MfoError
from ...types.status import Status
from ..blender_host import BlenderHost, find_blender_host
from ..cluster_options import add_cluster_options
from .bench_judge import add_judge_parser
from .bench_surface import add_surface_parser


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo bench` and `mfo bench report`."""
    parser = subparsers.add_parser(
        "bench",
        help="measure speed against error on random scenes",
        description="Fit random scenes with several methods. An interrupted bench goes on where it stopped.",
    )
    parser.add_argument("--scenario", action="append", choices=tuple(SCENARIOS), help="again for more (default: all)")
    standing = "again for more (default: all that can run here, without the ablations)"
    parser.add_argument("--method", action="append", choices=tuple(METHODS), help=standing)
    parser.add_argument("--scenes", type=_positive, default=20, metavar="N", help="scenes of each scenario (20)")
    parser.add_argument("--size", type=_positive, default=128, metavar="PIXELS", help="width and height (128)")
    parser.add_argument("--out", type=Path, default=Path("mfo-bench"), metavar="DIR", help="folder (mfo-bench)")
    add_cluster_options(parser)
    parser.set_defaults(func=run)
    actions = parser.add_subparsers(dest="action", metavar="[report DIR | judge DIR | surface]")
    report = actions.add_parser("report", help="print and write the report of a bench folder")
    report.add_argument("folder", type=Path, metavar="DIR", help="folder of a bench")
    report.add_argument("--note", action="append", default=[], help="a remark for the report, such as a busy machine")
    page = "a Markdown page whose blocks, such as `<!-- bench -->`, get their tables; again for more"
    report.add_argument("--page", type=Path, action="append", default=[], metavar="FILE", help=page)
    report.set_defaults(func=run_report)
    add_judge_parser(actions)
    add_surface_parser(actions)


def run(arguments: argparse.Namespace) -> int:
    """Run the bench with real fits, then report."""
    require_matplotlib()
    assets = Assets.find()
    keep_setup(arguments.out, _setup(arguments, assets))
    pictures = (arguments.out / "pictures").absolute()
    pictures.mkdir(exist_ok=True)
    if arguments.scheduler or arguments.workers:
        manifest = tuple((name, tuple(values)) for name, values in assets.manifest().items())
        threads = 0 if arguments.scheduler else threads_each(arguments.workers)
        recipe = FitRecipe(arguments.size, manifest, str(pictures), threads)
        with open_client(arguments.scheduler, arguments.workers) as client:
            return work(arguments, lambda tasks, file, **common: run_scattered(tasks, file, client, recipe, **common))

    from ...bench.runs.fit_runner import FitRunner
    from ...bench.runs.machine import machine_facts

    runner = FitRunner(arguments.out / "scenes", arguments.size, assets, pictures, host=_blender())
    machine = machine_facts(runner.variant, threads=runner.threads, import_seconds=runner.import_seconds)
    return work(arguments, partial(run_bench, runner=runner, machine=machine, log=partial(_log, arguments.out)))


def work(arguments: argparse.Namespace, bench: Callable[..., bool]) -> int:
    """Run `bench` on the tasks that are left; returns the exit code."""
    from tqdm import tqdm

    file = RowFile(arguments.out)
    methods = arguments.method or [m for m in DEFAULT_METHODS if can_run(m)]
    tasks = all_tasks(arguments.scenario or _scenarios(arguments), methods, arguments.scenes)
    stop = StopSignal()
    with file.only_writer(), stop.watching():
        done = {row.key for row in file.read()}
        left = sum(task.key not in done for task in tasks)
        print(f"{left} of {len(tasks)} rows to measure, in {file.path}", file=sys.stderr)
        # disable=None: shown on a terminal only; the time left is reckoned from the mean of all rows so far
        with tqdm(total=left, unit="row", disable=None, smoothing=0.0, ncols=terminal_columns(), nrows=20) as bar:

            def listener(row: Row) -> None:
                tqdm.write(_line(row), file=sys.stderr)
                bar.update()

            complete = bench(tasks, file, listener=listener, should_stop=stop.requested)
    if file.read():
        print(write_report(arguments.out))
    if not complete:
        print("mfo: stopped; the same command goes on where it was.", file=sys.stderr)
        return Status.CANCELLED.exit_code
    return 0


def can_run(method: str) -> bool:
    """Whether this machine has all a method needs; says on stderr what is missing."""
    missing = missing_for(method)
    if missing:
        print(f"mfo: without {method}: {missing}", file=sys.stderr)
    return not missing


def _scenarios(arguments: argparse.Namespace) -> list[str]:
    """All scenarios, without Cycles' where they cannot run."""
    here = not (arguments.scheduler or arguments.workers) and _blender() is not None
    if not here:
        print("mfo: without cycles: it needs Blender, and one process.", file=sys.stderr)
    return [name for name, scenario in SCENARIOS.items() if here or not scenario.cycles]


def _blender() -> BlenderHost | None:
    try:
        return find_blender_host()
    except MfoError:
        return None


def _log(folder: Path, text: str) -> None:
    with open(folder / "errors.log", "a", encoding="utf-8") as errors:
        errors.write(text + "\n")


def run_report(arguments: argparse.Namespace) -> int:
    """Print and write the report of a folder's rows."""
    rows = RowFile(arguments.folder).read()
    if not rows:
        raise BadInputError(f"{arguments.folder} holds no rows of a bench: run `mfo bench --out {arguments.folder}`.")
    for page in arguments.page:
        write_atomically(page, fill(_page_text(page), rows).encode("utf-8"))
    print(write_report(arguments.folder, notes=arguments.note))
    return 0


def _page_text(page: Path) -> str:
    try:
        text = page.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(f"The page {page} cannot be read ({error}): give a Markdown file.") from None
    if not has_block(text):
        raise BadInputError(
            f"{page} has no block from `<!-- bench -->` to `<!-- end -->`: write one where the table is to be."
        )
    return text


def _setup(arguments: argparse.Namespace, assets: Assets) -> dict:
    return {"size": arguments.size, **assets.manifest()}


def _line(row: Row) -> str:
    name = f"{row.scenario} {row.scene} {row.method}"
    if row.error:
        return f"{name}: {row.status}: {row.error}"
    figures = [(row.seconds, "{:.1f} s"), (row.passes, "{:.0f} passes"), (row.flip, "FLIP {:.4f}")]
    return f"{name}: {', '.join(form.format(v) for v, form in figures if v is not None)}, {row.status}"


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value} is not a whole number from 1 on")
    return value
