# SPDX-License-Identifier: Apache-2.0
"""The literal texts that the add-on hands to Blender for display, found in its source: (context, text) pairs.

What is put together at run time (sentences with names and numbers) is not here; Blender could not look it up either.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ADDON = Path(__file__).resolve().parents[2] / "blender_addon"
_LABELLED = {"label", "operator", "prop", "prop_enum", "menu", "progress", "popover"}
_PROPERTIES = {
    *("StringProperty", "BoolProperty", "IntProperty", "FloatProperty", "EnumProperty", "FloatVectorProperty"),
    *("PointerProperty", "CollectionProperty"),
}


def shown_messages() -> set[tuple[str, str]]:
    """Every (context, text); the context is Operator for names of operators, else *."""
    found: set[tuple[str, str]] = set()
    for path in ADDON.rglob("*.py"):
        tree = ast.parse(path.read_text("utf-8"))
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef):
                found.update(_of_class(node))
            elif isinstance(node, ast.Call):
                found.update(of_call(node))
            elif isinstance(node, ast.Assign) and any(_name(t).endswith("_ITEMS") for t in node.targets):
                found.update(_of_items(node.value))
            elif isinstance(node, ast.Assign) and _name(node.targets[0]) == "_TITLES":
                titles = node.value.values if isinstance(node.value, ast.Dict) else []
                found.update(pair for title in titles for pair in _texts("*", title))
            elif isinstance(node, ast.Assign) and _name(node.targets[0]) == "_OF_NODES":
                found.update(pair for name in getattr(node.value, "elts", ()) for pair in _texts("*", name))
    return {(context, text) for context, text in found if any(letter.isalpha() for letter in text)}


def _of_class(node: ast.ClassDef) -> Iterator[tuple[str, str]]:
    is_operator = any(_name(base) in ("Operator", "Macro") for base in node.bases)
    for statement in node.body:
        if isinstance(statement, ast.Assign) and _name(statement.targets[0]) == "bl_label":
            yield from _texts("Operator" if is_operator else "*", statement.value)
    description = ast.get_docstring(node, clean=True)
    if is_operator and description:
        yield "*", description


def of_call(node: ast.Call) -> Iterator[tuple[str, str]]:
    """The (context, text) pairs that one call hands over."""
    name = _name(node.func)
    words = {word.arg: word.value for word in node.keywords}
    if name in _PROPERTIES and "HIDDEN" not in ast.dump(node) and "_SCRIPT" not in ast.dump(node):
        for key in ("name", "description"):
            yield from _texts("*", words.get(key))
        yield from _of_items(words.get("items"))
    elif name in _LABELLED:
        yield from _texts("Operator" if name in {"operator"} else "*", words.get("text"))
    elif name == "word":  # text and context
        context = node.args[1].value if len(node.args) > 1 and isinstance(node.args[1], ast.Constant) else "*"
        yield from _texts(str(context), node.args[0])


def _of_items(node: ast.expr | None) -> Iterator[tuple[str, str]]:
    """Names and descriptions of an enumeration written out in place."""
    if isinstance(node, (ast.Tuple, ast.List)):
        for item in node.elts:
            if isinstance(item, ast.Tuple) and len(item.elts) >= 3:
                yield from _texts("*", item.elts[1])
                yield from _texts("*", item.elts[2])


def _texts(context: str, node: ast.expr | None) -> Iterator[tuple[str, str]]:
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield context, node.value
    elif isinstance(node, ast.IfExp):
        yield from _texts(context, node.body)
        yield from _texts(context, node.orelse)


def _name(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""
