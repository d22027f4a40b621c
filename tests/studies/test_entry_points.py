# SPDX-License-Identifier: Apache-2.0
"""Every study starts and tells its options, and its docstring names it and no option that it lacks."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
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
