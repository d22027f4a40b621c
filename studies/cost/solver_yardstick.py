# SPDX-License-Identifier: Apache-2.0
"""The product's bounded solver against SciPy's on the problems that it is for.

    python -m studies.cost.solver_yardstick [--scenes 4] [--starts 10] [--size 64] [--doc docs/bench/solver.md]

Pictures are those of recorded light paths of `mfo bench`'s scenes under a point light, so that the truth has cost 0;
residuals are those of the search for a start. All solvers get the same starts, drawn over the whole box, the same
residuals and derivatives, and at most `MOST` evaluations. Solved: relative root mean square error of the picture below
1 %. An evaluation is one picture with all derivatives. The file of `--doc` is written anew.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from mfo_backend.bench.report.table import Table, number
from mfo_backend.solve.bounded_least_squares import SolveLimits, solve_bounded
from studies.recovery.scene_fit import open_bench_scene, true_vector, write_bench_scene

ROOT = Path(__file__).resolve().parents[2]

Vector = NDArray[np.float64]
MOST = 100
SAME_CHANGE = 1e-6  # relative change of the cost that ends any solver
SCENARIOS = ("parameters", "base")


@dataclass(frozen=True)
class Problem:
    """Rows of residuals and derivatives (n, 1 + k) in a box, which end in the truth with a cost of 0."""

    rows: Callable[[Vector], NDArray[np.float64]]
    error: Callable[[Vector], float]
    equations: Callable[[Vector], Any]
    lower: Vector
    upper: Vector


@dataclass(frozen=True)
class Ends:
    """One solver over all starts: evaluations, CPU seconds, and which starts it solved."""

    evaluations: list[int]
    seconds: list[float]
    solved: list[bool]


def main() -> None:
    """Measure and print, and write the page that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=4)
    parser.add_argument("--starts", type=int, default=10)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--doc", type=Path, metavar="FILE")
    arguments = parser.parse_args()
    lines = []
    for scenario in SCENARIOS:
        ends: dict[str, Ends] = {name: Ends([], [], []) for name in SOLVERS}
        values = 0
        for scene_number in range(arguments.scenes):
            with tempfile.TemporaryDirectory() as folder:
                problem = recorded_problem(scenario, scene_number, arguments.size, Path(folder))
                run(problem, arguments.starts, scene_number, ends)
                values = len(problem.lower)
        lines += [line(scenario, values, name, ends[name]) for name in SOLVERS]
    heads = ("scenes", "values", "solver", "starts", "solved", "evaluations, median", "90 %", "CPU s, median", "sum")
    table = "\n".join(Table(heads, lines).markdown())
    print(table)
    if arguments.doc:
        command = f"--scenes {arguments.scenes} --starts {arguments.starts} --size {arguments.size}"
        text = (
            "# The own solver against SciPy's\n\n"
            f"Written by `python -m studies.cost.solver_yardstick {command} --doc FILE`; "
        )
        arguments.doc.write_text(f"{text}what it measures stands at its top.\n\n{table}\n", "utf-8")


def recorded_problem(scenario: str, scene_number: int, size: int, folder: Path) -> Problem:
    """The problem of a bench scene, on a recording near its truth."""
    scene = write_bench_scene(scenario, scene_number, size, folder)
    from mfo_backend.fit.recorded.where_to_look import all_groups
    from mfo_backend.fit.squares.residuals import log_residual, normal_equations, residual_rows
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    renderer, _ = open_bench_scene(scene, "balanced")
    table, truth = renderer.table, true_vector(scene, renderer)
    truth = np.clip(truth, table.lower, table.upper)
    recorded = RecordedScene(renderer, size**2 // 2)
    paths = recorded.record(truth, grid=2, seed=scene_number, near=True)
    evaluate = recorded.evaluator(paths, all_groups(paths, 1), 2)
    true = evaluate(truth)[:, :, 0].copy()
    residual = log_residual(true)

    def error(x: Vector) -> float:
        return float(np.sqrt(np.mean((evaluate(x)[:, :, 0] - true) ** 2) / np.mean(true**2)))

    @lru_cache(maxsize=1)  # SciPy asks for values, then for derivatives
    def rows_at(x: bytes) -> NDArray[np.float64]:
        return residual_rows(evaluate(np.frombuffer(x)), residual).reshape(-1, 1 + table.length)

    def rows(x: Vector) -> NDArray[np.float64]:
        return rows_at(x.tobytes())

    return Problem(rows, error, normal_equations(evaluate, residual), table.lower, table.upper)


def run(problem: Problem, starts: int, seed: int, ends: dict[str, Ends]) -> None:
    """Solve from random starts by every solver."""
    for start in random_starts(problem, starts, seed):
        for name, solve in SOLVERS.items():
            began = time.process_time()
            x, evaluations = solve(problem, start)
            ends[name].seconds.append(time.process_time() - began)
            ends[name].evaluations.append(evaluations)
            ends[name].solved.append(problem.error(x) < 0.01)


def random_starts(problem: Problem, starts: int, seed: int) -> Iterator[Vector]:
    """Vectors over the whole box."""
    rng = np.random.default_rng(seed)
    for _ in range(starts):
        yield problem.lower + (problem.upper - problem.lower) * rng.uniform(0.02, 0.98, len(problem.lower))


def own(problem: Problem, start: Vector) -> tuple[Vector, int]:
    """The product's solver."""
    limits = SolveLimits(evaluations=MOST, cost_change=SAME_CHANGE)
    solution = solve_bounded(problem.equations, start, problem.lower, problem.upper, limits)
    return solution.x, len(solution.costs)


def scipys(method: str) -> Callable[[Problem, Vector], tuple[Vector, int]]:
    """A solver of `scipy.optimize.least_squares`, scaled by the derivatives as its documentation advises."""

    def solve(problem: Problem, start: Vector) -> tuple[Vector, int]:
        found = least_squares(
            lambda x: problem.rows(x)[:, 0],
            start,
            lambda x: problem.rows(x)[:, 1:],
            bounds=(problem.lower, problem.upper),
            method=method,
            x_scale="jac",
            ftol=SAME_CHANGE,
            max_nfev=MOST,
        )
        return found.x, int(found.nfev)

    return solve


SOLVERS = {"own": own, "scipy trf": scipys("trf"), "scipy dogbox": scipys("dogbox")}


def line(scenario: str, values: int, name: str, ends: Ends) -> tuple[str, ...]:
    """One solver's line of the table."""
    solved = f"{np.mean(ends.solved):.0%}"
    counts = (number(float(np.median(ends.evaluations))), number(float(np.quantile(ends.evaluations, 0.9))))
    seconds = (number(float(np.median(ends.seconds))), number(float(np.sum(ends.seconds))))
    return (f"`{scenario}`", str(values), name, str(len(ends.solved)), solved, *counts, *seconds)


if __name__ == "__main__":
    main()
