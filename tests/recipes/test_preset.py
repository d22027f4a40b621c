# SPDX-License-Identifier: Apache-2.0
"""A preset that is added as the recipe says is known to settings, plan, memory, panel and bench."""

from __future__ import annotations

from pathlib import Path

import pytest

from .recipe import follow


def test_a_new_preset_is_known_everywhere(tmp_path: Path) -> None:
    pytest.importorskip("bpy")
    said = follow("A preset", tmp_path).see("""
        from blender_addon.properties import PRESET_ITEMS
        from mfo_backend.bench.rows.method import DEFAULT_METHODS
        from mfo_backend.fit.plans import RecordedPlan
        from mfo_backend.fit.settings import FitSettings
        from mfo_backend.job.run.run_job import _BYTES_PER_PIXEL

        settings = FitSettings(preset="draft")
        print(PRESET_ITEMS[0][0], settings.preset, DEFAULT_METHODS[0], RecordedPlan.of("draft").grid_last,
              set(_BYTES_PER_PIXEL) == {item[0] for item in PRESET_ITEMS})
    """)
    assert said.split() == ["draft", "draft", "draft", "2", "True"]
