# SPDX-License-Identifier: Apache-2.0
"""The sentences that add-on and backend make at run time, found in their source, with `{}` for what is put in."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
ADDON, BACKEND = ROOT / "blender_addon", ROOT / "mfo_backend"
# calls whose texts an artist reads, and which of their arguments they are
_SAID = {"Finding": 1, "translated": 0, "draw_sentence": 2, "note": 0, "error": 0, "Named": 1, "Step": 2}
_NAMED = {"said", "sentence"}  # what a sentence is called before it goes into one of them
_KINDS = {"Kind": (0, 1)}
_FIELD = re.compile(r"\{[^{}]*\}")  # of a template that is filled in later
_SENTENCE = re.compile(r"[A-Za-z{'](\S* ){3}.*(\.|: \{\}|\. \{\})")  # whatever call it is in


def run_time_sentences(folders: tuple[str, ...]) -> set[str]:
    """Every sentence of these folders and files of the add-on, and every text that is said as one."""
    found = set(sentences(ADDON, folders))
    for tree in _trees(ADDON, folders):
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                found.update(_of_call(node))
            elif isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") in _NAMED:
                found.update(_texts(node.value))
    return found


def sentences(root: Path, folders: tuple[str, ...]) -> Iterator[str]:
    """Every text of these folders and files below `root` that reads as one or more sentences."""
    for tree in _trees(root, folders):
        silent = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}  # of documentation
        parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
        for node in ast.walk(tree):
            if isinstance(node, ast.expr) and id(node) not in silent | parts:
                yield from (text for text in _texts(node) if _SENTENCE.fullmatch(text))


def _trees(root: Path, folders: tuple[str, ...]) -> Iterator[ast.Module]:
    for name in folders:
        place = root / name
        for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            yield ast.parse(path.read_text("utf-8"))


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
        text = "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
    text = _FIELD.sub("{}", text)
    if any(letter.isalpha() for letter in text.replace("{}", "")):
        yield text
