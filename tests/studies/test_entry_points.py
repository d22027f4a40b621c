# SPDX-License-Identifier: Apache-2.0
"""Every study starts and tells its options, and its docstring names it and no option that it lacks."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
STARTED = '__name__ == "__main__"'
FILES = [path for path in sorted((ROOT / "studies").rglob("*.py")) if STARTED in path.read_text("utf-8")]
# one process for all: each would load the renderer anew
CODE = """
import contextlib, io, json, runpy, sys
said = {}
for name in sys.argv[1:]:
    sys.argv = [name, "--help"]
    with contextlib.redirect_stdout(io.StringIO()) as out:
        try:
            runpy.run_module(name, run_name="__main__", alter_sys=True)
            said[name] = [None, out.getvalue()]
        except SystemExit as end:
            said[name] = [end.code, out.getvalue()]
print(json.dumps(said))
"""


def module_of(path: Path) -> str:
    """The name behind `python -m`."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__main__")


@pytest.fixture(scope="module")
def said() -> dict[str, list]:
    command = [sys.executable, "-c", CODE, *map(module_of, FILES)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("path", FILES, ids=module_of)
def test_a_study_says_what_it_can(said: dict[str, list], path: Path) -> None:
    name, source = module_of(path), path.read_text("utf-8")
    code, text = said[name]
    assert code == 0
    assert text.startswith("usage:")
    # the docstring is in the help where another file of the study has it
    described = f"{ast.get_docstring(ast.parse(source), clean=False)}\n{text}"
    usage = re.findall(r"^ {4,10}\S.*$", described, re.MULTILINE)
    source = "".join(file.read_text("utf-8") for file in path.parent.glob("*.py"))
    assert any(f"python -m {name}" in line for line in usage)
    assert all(f'"{option}"' in source for option in re.findall(r"--[a-z][a-z-]*", "".join(usage)))


def _relative_imports() -> Iterator[tuple[Path, Path, str]]:
    """File, imported file or folder, and name of every relative import of the studies, also inside of functions."""
    for path in sorted((ROOT / "studies").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.level:
                place = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
                yield from ((path, place, alias.name) for alias in node.names)


def _bound_in(module: Path) -> set[str]:
    """What a module binds at its top."""
    names: set[str] = set()
    for node in ast.parse(module.read_text("utf-8")).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            names.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names |= {alias.asname or alias.name for alias in node.names}
        names |= {each.id for each in ast.walk(node) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)}
    return names


def test_what_studies_import_from_each_other_is_there() -> None:
    """Type checks leave them out, and a study that fails makes rows of errors."""
    missing = []
    for path, place, name in _relative_imports():
        module = place.with_suffix(".py")
        found = name in _bound_in(module) if module.is_file() else (place / f"{name}.py").is_file()
        found = found or (place / name / "__init__.py").is_file()
        found = found or ((place / "__init__.py").is_file() and name in _bound_in(place / "__init__.py"))
        missing += [] if found else [f"{path.relative_to(ROOT)}: {place.name}.{name}"]
    assert missing == []
