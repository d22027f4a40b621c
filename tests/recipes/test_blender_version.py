# SPDX-License-Identifier: Apache-2.0
"""A Blender version that is added as the recipe says has its own API and its own material; the others keep theirs."""

from __future__ import annotations

from pathlib import Path

import pytest

from .recipe import follow


def test_a_new_blender_version_has_its_own_api_and_material(tmp_path: Path) -> None:
    pytest.importorskip("bpy")
    said = follow("A Blender version", tmp_path).see("""
        from types import SimpleNamespace
        from blender_addon.versions import light_strength

        print(light_strength(SimpleNamespace(power=3.0, exposure=1.0)), light_strength(SimpleNamespace(energy=3.0)))

        from mfo_backend.render.machine.variant import load_variant
        load_variant()
        import drjit as dr
        import mitsuba as mi
        from mfo_backend.material.principled.blender_principled import blender_principled
        from mfo_backend.material.cycles_model import cycles_model
        from mfo_backend.material.principled.needed_lobes import ALL_LOBES

        wi, wo = mi.Vector3f(0.0, 0.6, 0.8), mi.Vector3f(0.0, 0.0, 1.0)
        values = {"coat_weight": 1.0, "coat_tint": (0.5, 1.0, 1.0)}
        white = {**values, "coat_tint": (1.0, 1.0, 1.0)}
        for version in ((5, 2), (6, 0)):
            tinted, plain = (blender_principled(v, wi, wo, ALL_LOBES, cycles_model(version)) for v in (values, white))
            print(dr.abs(tinted - plain).x[0])
    """)
    strengths, old, new = said.splitlines()
    assert strengths.split() == ["6.0", "3.0"]
    assert float(old) > 0.01
    assert float(new) == 0.0
