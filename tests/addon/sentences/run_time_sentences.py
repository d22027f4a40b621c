# SPDX-License-Identifier: Apache-2.0
"""The sentences that the add-on makes at run time, found in its source, with `{}` for what is put in."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ADDON = Path(__file__).resolve().parents[3] / "blender_addon"
# calls whose texts an artist reads, and which of their arguments they are
_SAID = {"Finding": 1, "translated": 0, "draw_sentence": 2}
_NAMED = {"said", "sentence"}  # what a sentence is called before it goes into one of them
_KINDS = {"Kind": (0, 1)}


def run_time_sentences(folders: tuple[str, ...]) -> set[str]:
    """Every sentence of these folders and files of the add-on."""
    found: set[str] = set()
    for name in folders:
        place = ADDON / name
        for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.Call):
                    found.update(_of_call(node))
                elif isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") in _NAMED:
                    found.update(_texts(node.value))
    return found


def _of_call(node: ast.Call) -> Iterator[str]:
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    for number in _KINDS.get(name, (_SAID[name],) if name in _SAID else ()):
        if number < len(node.args):
            yield from _texts(node.args[number])
    if name.endswith("Error") and node.args:
        yield from _texts(node.args[0])


def _texts(node: ast.expr) -> Iterator[str]:
    if isinstance(node, ast.IfExp):
        yield from _texts(node.body)
        yield from _texts(node.orelse)
        return
    text = ""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        text = node.value
    elif isinstance(node, ast.JoinedStr):
        text = "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
    if any(letter.isalpha() for letter in text.replace("{}", "")):
        yield text
