# SPDX-License-Identifier: Apache-2.0
"""A name of a number means one thing: who reads it in one file and knows it from another is not misled."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import pytest

from studies.census import named_numbers

ROOT = Path(__file__).resolve().parents[1]
LAYERS = [*sorted(path for path in (ROOT / "mfo_backend").iterdir() if (path / "__init__.py").is_file())]


@pytest.mark.parametrize("layer", [*LAYERS, ROOT / "blender_addon"], ids=lambda path: path.name)
def test_a_public_name_has_one_value_in_a_layer(layer: Path) -> None:
    found: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for path in sorted(layer.rglob("*.py")):
        for name, value in named_numbers(ast.parse(path.read_text("utf-8"))):
            if not name.startswith("_"):
                found[name][ast.unparse(value)].append(str(path.relative_to(layer)))
    assert {name: dict(values) for name, values in found.items() if len(values) > 1} == {}
