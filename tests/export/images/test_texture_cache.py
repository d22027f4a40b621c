# SPDX-License-Identifier: Apache-2.0
"""Which pictures Cycles has in its texture cache, by the files that it writes."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import pytest

from blender_addon.export.images import texture_cache
from blender_addon.export.images.texture_cache import uses_texture_cache

FILE = "wood.png.0-926BDA8569F1F2504902F06ABA51E46D.tx"  # as Blender 5.2.2 has named one


def render(*, cache: bool = True, generates: bool = False) -> Any:
    return SimpleNamespace(use_texture_cache=cache, use_auto_generate_texture_cache=generates)


def image(path: Path) -> Any:
    return SimpleNamespace(filepath=str(path), library=None)


@pytest.mark.parametrize("folder", ["blender_tx", "cache", "absolute"])
def test_files_of_the_cache_are_found_where_cycles_looks(
    folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "elsewhere" if folder == "absolute" else tmp_path / "pictures" / folder
    given = str(place) if folder == "absolute" else "//cache"
    preferences = SimpleNamespace(filepaths=SimpleNamespace(texture_cache_directory=given))
    monkeypatch.setattr(texture_cache, "bpy", SimpleNamespace(path=bpy.path, context=SimpleNamespace(
        preferences=preferences)))  # fmt: skip
    picture = image(tmp_path / "pictures" / "wood.png")
    place.mkdir(parents=True)
    (place / FILE.replace("wood", "other")).touch()
    (place / FILE.replace(".tx", ".txt")).touch()
    assert not uses_texture_cache(render(), [picture])
    (place / FILE).touch()
    assert uses_texture_cache(render(), [picture])
    assert not uses_texture_cache(render(cache=False, generates=True), [picture])


def test_a_render_that_makes_the_files_uses_them() -> None:
    assert uses_texture_cache(render(generates=True), [image(Path("wood.png"))])
    assert not uses_texture_cache(render(generates=True), [])
    assert not uses_texture_cache(SimpleNamespace(), [])  # pyright: ignore[reportArgumentType]  # before Blender 5.2
