# SPDX-License-Identifier: Apache-2.0
"""Plugins of a stranger are not loaded."""

from __future__ import annotations

from pathlib import Path

import pytest

from mfo_backend.render.machine.plugins import OURS, check_plugins
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.scene.scene_xml import read_scene
from mfo_backend.types.errors import BadInputError
from tests.render.scenes import POINT, write_scene


def test_own_and_mitsubas_plugins_are_known(tmp_path: Path) -> None:
    path = write_scene(tmp_path, POINT, shape=f'<bsdf type="{OURS[0]}"/>')
    check_plugins(read_scene(path), "scene.xml")


@pytest.mark.parametrize("where", ["bsdf", "shape", "emitter", "texture", "medium", "volume"])
def test_a_plugin_in_the_working_folder_is_not_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    # Mitsuba opens plugins/evil.so relative to the working folder when it knows no plugin of that name
    monkeypatch.chdir(tmp_path)
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins" / "evil.so").write_bytes(b"no library")
    path = write_scene(tmp_path, POINT + f'<{where} type="evil"/>')
    with pytest.raises(BadInputError, match="type 'evil', which is no plugin of Mitsuba"):
        load_renderer(path, "target", model="mitsuba_principled", parameters="all")
