# SPDX-License-Identifier: Apache-2.0
"""Count the numbers that have names: in each layer, how many there are and how many say why they are what they are.

    python -m studies.census [--commits COMMIT ...] [--folders mfo_backend/fit ...]

A named number is an assignment of a number, or of a tuple of numbers, to one name at the top of a module, or a default
of a class attribute. One that says something has a comment in its line or right above it. Other literals are numbers
inside functions besides -2 to 3, 0.5, 10, 100, 255 and powers of ten down to 1e-30, which seldom decide anything.
Without a commit the files are read as they lie here.
"""

from __future__ import annotations

import argparse
import ast
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("mfo_backend/fit", "mfo_backend/render", "mfo_backend/solve", "mfo_backend/metrics")
_PLAIN = {-2, -1, 0, 1, 2, 3, 0.5, 10, 100, 255, *(10.0**-k for k in range(31))}


@dataclass(frozen=True)
class Census:
    """Of one folder: files, lines, named numbers at the top of modules and in classes, and what they say."""

    files: int
    lines: int
    module: int
    fields: int
    said: int
    literals: int


def census(sources: dict[str, str]) -> Census:
    """Count in sources by their path."""
    module = fields = said = literals = 0
    for source in sources.values():
        tree, lines = ast.parse(source), source.splitlines()
        for node in tree.body:
            if _names_a_number(node):
                module += 1
                said += _has_comment(node, lines)
            elif isinstance(node, ast.ClassDef):
                fields += sum(map(_names_a_number, node.body))
        literals += sum(map(_is_literal, _inside_functions(tree)))
    count = sum(len(source.splitlines()) for source in sources.values())
    return Census(len(sources), count, module, fields, said, literals)


def named_numbers(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Name and value of every number that is named at the top of a module."""
    for node in tree.body:
        if _names_a_number(node):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            if isinstance(target, ast.Tuple):
                yield from zip((name.id for name in target.elts), node.value.elts, strict=True)
            else:
                yield target.id, node.value


def _names_a_number(node: ast.stmt) -> bool:
    if isinstance(node, ast.AnnAssign):
        return node.value is not None and _is_number(node.value)
    if not isinstance(node, ast.Assign) or len(node.targets) != 1 or not _is_number(node.value):
        return False
    (target,) = node.targets
    several = isinstance(target, ast.Tuple) and all(isinstance(name, ast.Name) for name in target.elts)
    return isinstance(target, ast.Name) or several


def _is_number(value: ast.expr) -> bool:
    """A number, an expression of numbers alone, or a tuple of such."""
    if isinstance(value, ast.Constant):
        return type(value.value) in (int, float)
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    if isinstance(value, ast.BinOp):
        return _is_number(value.left) and _is_number(value.right)
    return isinstance(value, ast.Tuple) and bool(value.elts) and all(map(_is_number, value.elts))


def _has_comment(node: ast.stmt, lines: list[str]) -> bool:
    own = any("#" in line for line in lines[node.lineno - 1 : node.end_lineno])
    above = node.lineno >= 2 and lines[node.lineno - 2].lstrip().startswith("#")
    below = len(lines) > (node.end_lineno or 0) and lines[node.end_lineno or 0].startswith('"""')
    return own or above or below


def _inside_functions(tree: ast.Module) -> Iterator[ast.AST]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            for statement in node.body:
                yield from ast.walk(statement)


def _is_literal(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value not in _PLAIN


def sources_of(folder: str, commit: str | None) -> dict[str, str]:
    """The Python files below a folder, as they lie here or as a commit has them."""
    if commit is None:
        return {str(path.relative_to(ROOT)): path.read_text("utf-8") for path in (ROOT / folder).rglob("*.py")}
    names = _git("ls-tree", "-r", "--name-only", commit, folder).splitlines()
    return {name: _git("show", f"{commit}:{name}") for name in names if name.endswith(".py")}


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout


def main() -> None:
    """Print one table, a line for each folder and commit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commits", nargs="*", default=[])
    parser.add_argument("--folders", nargs="*", default=FOLDERS)
    chosen = parser.parse_args()
    print("| folder | at | files | lines | named at the top | of these with a comment | in classes | other literals |")
    print("|---|---|--:|--:|--:|--:|--:|--:|")
    for folder in chosen.folders:
        for commit in [*chosen.commits, None]:
            c = census(sources_of(folder, commit))
            cells = (c.files, c.lines, c.module, c.said, c.fields, c.literals)
            print(f"| `{folder}` | {commit or 'here'} | {' | '.join(map(str, cells))} |")


if __name__ == "__main__":
    main()
