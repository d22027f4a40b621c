# SPDX-License-Identifier: Apache-2.0
"""The layers of the backend and the wall between the two processes, checked on the source text."""

from __future__ import annotations

import ast
import functools
from collections.abc import Collection
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


@functools.cache
def imports_of(path: Path, package_root: Path) -> tuple[str, ...]:
    """Absolute dotted names of everything `path` imports, relative imports resolved against `package_root`'s parent."""
    package = path.relative_to(package_root.parent).with_suffix("").parts
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level] if node.level else ()
            module = ".".join([*base, *([node.module] if node.module else [])])
            names += [f"{module}.{alias.name}" for alias in node.names]
    return tuple(names)


def short(path: Path) -> str:
    return str(path.relative_to(ROOT))


def test_backend_imports_point_down() -> None:
    wrong = []
    for path in BACKEND_FILES:
        parts = path.relative_to(ROOT / "mfo_backend").parts
        layer = parts[0] if len(parts) > 1 else "cli"
        allowed = set(LAYERS[: LAYERS.index(layer) + 1])
        for name in imports_of(path, ROOT / "mfo_backend"):
            root, *rest = name.split(".")
            if root in {"bpy", "mathutils", "blender_addon"}:
                wrong.append(f"{short(path)} imports {name}: the backend runs without Blender")
            if root in RENDERER_MODULES and layer not in RENDERER_LAYERS:
                wrong.append(f"{short(path)} imports {name}: only {RENDERER_LAYERS} may")
            if root == "mfo_backend" and rest and rest[0] in LAYERS and rest[0] not in allowed:
                wrong.append(f"{short(path)} imports {name}: an arrow that points up")
    assert wrong == []


def test_addon_imports_nothing_of_the_backend() -> None:
    found = [(short(path), name) for path in ADDON_FILES for name in imports_of(path, ROOT / "blender_addon")]
    assert [each for each in found if each[1].split(".")[0] in ADDON_FORBIDDEN] == []


def test_files_stay_small() -> None:
    """A longer one is split by what it holds."""
    lines = {short(path): len(path.read_text("utf-8").splitlines()) for path in [*BACKEND_FILES, *ADDON_FILES]}
    assert {path: count for path, count in lines.items() if count > 400} == {}


# Rooms of fit/ from the ground up; those of one floor do not know each other. A file of fit/ itself is a room, too.
FIT_FLOORS = [
    {"settings", "plans", "tolerances", "random_streams", "candidates"},
    {"result"},
    {"squares"},
    {"search", "certainty"},
    {"judge"},
    {"alike"},
    {"pictures"},
    {"recorded", "traced", "paper"},
    {"recover_material"},
    {"materials"},
]
FIT = ROOT / "mfo_backend" / "fit"
MOST_FILES = 14
FOLDERS = [
    folder
    for top in ("mfo_backend", "blender_addon", "studies", "tools", "tests")
    for folder in (ROOT / top, *sorted((ROOT / top).rglob("*")))
    if folder.is_dir() and any(folder.glob("*.py"))
]


def test_rooms_of_fit_import_what_lies_below_them() -> None:
    floor = {room: number for number, rooms in enumerate(FIT_FLOORS) for room in rooms}
    wrong = []
    for path in sorted(FIT.rglob("*.py")):
        parts = path.relative_to(FIT).with_suffix("").parts
        for name in imports_of(path, ROOT / "mfo_backend") if parts != ("__init__",) else ():
            layer, room = [*name.split("."), "", ""][1:3]
            is_other = name.startswith("mfo_backend.") and layer == "fit" and room != parts[0]
            if is_other and floor[room] >= floor[parts[0]]:
                wrong.append(f"{short(path)} imports {name}: an arrow that does not point down")
    assert wrong == []


def test_a_room_can_be_seen_at_one_glance() -> None:
    """Some files of a fuller one get a room of their own."""
    files = {short(folder): len([*folder.glob("*.py")]) - (folder / "__init__.py").is_file() for folder in FOLDERS}
    assert {folder: count for folder, count in files.items() if count > MOST_FILES} == {}


PACKAGES = pytest.mark.parametrize(
    ("files", "package"), [(BACKEND_FILES, "mfo_backend"), (ADDON_FILES[1:], "blender_addon")], ids=["backend", "addon"]
)


@PACKAGES
def test_no_files_import_each_other_in_a_circle(files: list[Path], package: str) -> None:
    """Imports inside of functions count, too: they only hide the circle."""
    assert _in_circles(_arrows(files, package)) == [], "some of these import each other in a circle"


@PACKAGES
def test_no_rooms_import_each_other_in_a_circle(files: list[Path], package: str) -> None:
    """A room is a folder; a file beside rooms is one, too."""
    arrows = _arrows(files, package)
    folders = {module.rpartition(".")[0] for module in arrows}
    room = {
        module: folder if folder not in {each.rpartition(".")[0] for each in folders} else module
        for module, folder in ((module, module.rpartition(".")[0]) for module in arrows)
    }
    of_rooms: dict[str, set[str]] = {each: set() for each in room.values()}
    for module, others in arrows.items():
        of_rooms[room[module]] |= {room[other] for other in others} - {room[module]}
    assert _in_circles(of_rooms) == [], "some of these rooms import each other in a circle"


def _arrows(files: Collection[Path], package: str) -> dict[str, set[str]]:
    """Which modules of the package each of them imports."""
    modules = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in files}
    return {
        module: {_module(name, modules) for name in imports_of(path, ROOT / package)} - {module, ""}
        for module, path in modules.items()
    }


def _in_circles(arrows: dict[str, set[str]]) -> list[str]:
    """What lies in a circle or between two."""
    left = dict(arrows)
    while ready := [
        each for each in left if not left[each] & set(left) or not any(each in others for others in left.values())
    ]:
        for each in ready:
            del left[each]
    return sorted(left)


def _module(name: str, modules: Collection[str]) -> str:
    """The file that a dotted name is in, the longest first; empty for those of other packages."""
    while name and name not in modules:
        name = name.rpartition(".")[0]
    return name
