# SPDX-License-Identifier: Apache-2.0
"""Follow a recipe of docs/reference/recipes.md in a copy of the program, word for word."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "recipes.md"
_BLOCK = re.compile(r"^ *```(diff|python)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Followed:
    """A copy of the program in which a recipe was followed."""

    folder: Path

    def see(self, code: str) -> str:
        """What a Python prints that imports the copy; it must succeed."""
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(code)],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()


def follow(title: str, folder: Path) -> Followed:
    """Do what the section `title` says, in a copy of add-on and backend below `folder`."""
    for package in ("mfo_backend", "blender_addon"):
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))
    section = PAGE.read_text("utf-8").split(f"\n## {title}\n", 1)[1].split("\n## ", 1)[0]
    for kind, text in _BLOCK.findall(section):
        head, body = textwrap.dedent(text).split("\n", 1)
        path = head.removeprefix("# ").partition(" (new)")[0]
        file = folder / path
        if kind == "python":
            assert "(new)" in head, head
            assert not file.exists(), f"{path} is there already"
            file.write_text(body, "utf-8")
        else:
            file.write_text(changed(file.read_text("utf-8"), body, path), "utf-8")
    return Followed(folder)


def changed(text: str, diff: str, path: str) -> str:
    """`text` with the lines of a block replaced; the beginning of a line stands for itself where nothing follows it."""
    for old, new in re.findall(r"((?:^-.*\n)+)((?:^\+.*\n)+)", diff, re.MULTILINE):
        before, after = ("\n".join(line[1:] for line in lines.rstrip("\n").split("\n")) for lines in (old, new))
        assert text.count(before) == 1, f"{path} has {before!r} {text.count(before)} times: mend the recipe"
        text = text.replace(before, after)
    return text
