# SPDX-License-Identifier: Apache-2.0
"""Small faults that can be made in a source text: one changed expression or statement each."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

_INVERSE = {
    ast.Lt: ast.GtE, ast.GtE: ast.Lt, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
_BOUNDARY = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt}
_ARITHMETIC = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult}
_LOGIC = {ast.And: ast.Or, ast.Or: ast.And}
_CALLS = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any"}


@dataclass(frozen=True)
class Mutant:
    """One fault: in the file `path` the bytes from `start` to `end`, of one line, are replaced by `after`.

    `old` and `new` are that line without and with the fault.
    """

    path: str
    line: int
    operator: str
    start: int
    end: int
    after: str
    old: str
    new: str

    @staticmethod
    def of(path: str, source: bytes, operator: str, span: tuple[int, int], after: str) -> Mutant:
        """The fault that replaces a span of bytes of a source."""
        start, end = span
        first = source.rfind(b"\n", 0, start) + 1
        last = source.find(b"\n", end) if b"\n" in source[end:] else len(source)
        old, new = source[first:last], source[first:start] + after.encode() + source[end:last]
        line = source[:start].count(b"\n") + 1
        return Mutant(path, line, operator, start, end, after, old.decode().strip(), new.decode().strip())

    @property
    def name(self) -> str:
        """What it is known by; it stays the same when other lines of the file change."""
        return f"{self.path}: {self.old} -> {self.new}"

    def applied(self, source: bytes) -> bytes:
        """The source with the fault."""
        return source[: self.start] + self.after.encode() + source[self.end :]


def mutants_of(path: str, source: bytes) -> Iterator[Mutant]:
    """Every fault that the operators find in a source, in the order of the text.

    Left alone is what does not compute: docstrings, types, texts of errors and assertions.
    """
    tree = ast.parse(source)
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node in _computing(tree):
        for operator, after in _faults_in(node):
            start = starts[node.lineno - 1] + node.col_offset
            end = starts[node.end_lineno - 1] + node.end_col_offset
            before = source[start:end].decode()
            if "\n" not in before and len(before) <= 100 and after != before:
                yield Mutant.of(path, source, operator, (start, end), after)


def _computing(node: ast.AST) -> Iterator[ast.AST]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom, ast.arguments)):
            continue
        if isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant):
            continue
        yield child
        if isinstance(child, ast.AnnAssign):
            if child.value is not None:
                yield child.value
                yield from _computing(child.value)
        elif isinstance(child, (ast.FunctionDef, ast.ClassDef)):
            for statement in child.body:
                if not (isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)):
                    yield from _computing(ast.Module([statement], []))
        else:
            yield from _computing(child)


def _faults_in(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Operator and replacement text of each fault of this very node."""
    if isinstance(node, ast.Compare) and len(node.ops) == 1:
        yield "comparison", _with_operator(node, _INVERSE[type(node.ops[0])])
        counts = any(_counts(side) for side in (node.left, node.comparators[0]))
        if counts and type(node.ops[0]) in _BOUNDARY:
            yield "boundary", _with_operator(node, _BOUNDARY[type(node.ops[0])])
    elif isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC:
        yield "arithmetic", _text(ast.BinOp(node.left, _ARITHMETIC[type(node.op)](), node.right))
    elif isinstance(node, ast.BoolOp):
        yield "logic", _text(ast.BoolOp(_LOGIC[type(node.op)](), node.values))
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not)):
        yield "sign", _text(node.operand)
    elif isinstance(node, ast.Constant) and type(node.value) is bool:
        yield "number", str(not node.value)
    elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield "number", repr(node.value + 1 if type(node.value) is int or node.value == 0.0 else node.value * 10.0)
    elif isinstance(node, ast.Call):
        name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if name in _CALLS:
            other = ast.Name(_CALLS[name])
            if isinstance(node.func, ast.Attribute):
                other = ast.Attribute(node.func.value, _CALLS[name])
            yield "call", _text(ast.Call(other, node.args, node.keywords))
    elif isinstance(node, ast.AugAssign) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
        yield "statement", "pass"


def _with_operator(node: ast.Compare, operator: type[ast.cmpop]) -> str:
    return _text(ast.Compare(node.left, [operator()], node.comparators))


def _text(node: ast.expr) -> str:
    return f"({ast.unparse(node)})"


def _counts(side: ast.expr) -> bool:
    is_length = isinstance(side, ast.Call) and getattr(side.func, "id", "") == "len"
    return is_length or (isinstance(side, ast.Constant) and type(side.value) is int)
