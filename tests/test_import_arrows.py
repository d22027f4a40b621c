# SPDX-License-Identifier: Apache-2.0
"""The layers of the backend and the wall between the two processes, checked on the source text."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LAYERS = ["types", "scene", "material", "render", "metrics", "solve", "fit", "report", "job", "bench", "cli"]
RENDERER_MODULES = {"mitsuba", "drjit"}
# material/ holds the models as Dr.Jit functions, render/ everything else that touches Mitsuba
RENDERER_LAYERS = {"render", "material"}
ADDON_ALLOWED_NATIVE = {"bpy", "mathutils", "numpy", "bpy_extras", "gpu", "bl_ext"}
ADDON_FORBIDDEN = {"mitsuba", "drjit", "OpenEXR", "scipy", "PIL", "tqdm", "mfo_backend"}

BACKEND_FILES = sorted((ROOT / "mfo_backend").rglob("*.py"))
ADDON_FILES = [ROOT / "__init__.py", *sorted((ROOT / "blender_addon").rglob("*.py"))]


def imports_of(path: Path, package_root: Path) -> Iterator[str]:
    """Absolute dotted names of everything `path` imports, relative imports resolved against `package_root`'s parent."""
    package = path.relative_to(package_root.parent).with_suffix("").parts
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield from (f"{module}.{alias.name}" for alias in node.names)


def short(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", BACKEND_FILES, ids=short)
def test_backend_imports_point_down(path: Path) -> None:
    parts = path.relative_to(ROOT / "mfo_backend").parts
    layer = parts[0] if len(parts) > 1 else "cli"
    allowed = set(LAYERS[: LAYERS.index(layer) + 1])
    for name in imports_of(path, ROOT / "mfo_backend"):
        root, *rest = name.split(".")
        assert root not in {"bpy", "mathutils", "blender_addon"}, (
            f"{short(path)} imports {name}: the backend runs without Blender"
        )
        if root in RENDERER_MODULES:
            assert layer in RENDERER_LAYERS, f"{short(path)} imports {name}: only {RENDERER_LAYERS} may"
        if root == "mfo_backend" and rest and rest[0] in LAYERS:
            assert rest[0] in allowed, f"{short(path)} imports {name}: an arrow that points up"


@pytest.mark.parametrize("path", ADDON_FILES, ids=short)
def test_addon_imports_nothing_of_the_backend(path: Path) -> None:
    for name in imports_of(path, ROOT / "blender_addon"):
        assert name.split(".")[0] not in ADDON_FORBIDDEN, f"{short(path)} imports {name} into Blender's process"


@pytest.mark.parametrize("path", [*BACKEND_FILES, *ADDON_FILES], ids=short)
def test_files_stay_small(path: Path) -> None:
    lines = len(path.read_text("utf-8").splitlines())
    assert lines <= 400, f"{short(path)} has {lines} lines; split it by what it holds"
