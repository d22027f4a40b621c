# SPDX-License-Identifier: Apache-2.0
"""A lobe that is added as the recipe says has its value and its slope, and costs nothing where it is off."""

from __future__ import annotations

from pathlib import Path

import pytest

from .recipe import follow


def test_a_new_lobe_has_its_value_and_its_derivative(tmp_path: Path) -> None:
    said = follow("A lobe", tmp_path).see("""
        from mfo_backend.render.machine.variant import load_variant
        load_variant()
        import drjit as dr
        import mitsuba as mi
        from mfo_backend.material.principled.blender_principled import blender_principled
        from mfo_backend.material.principled.blender_selection import select_blender_parameters
        from mfo_backend.material.arrays.dual import Dual
        from mfo_backend.material.principled.needed_lobes import needed_lobes

        wi, wo = dr.normalize(mi.Vector3f(0.3, 0.1, 1.0)), dr.normalize(mi.Vector3f(0.1, -0.2, 1.0))
        values = {"base_color": (0.5, 0.5, 0.5), "roughness": 0.6}
        plain = blender_principled(values, wi, wo, needed_lobes(values))

        def at(weight):
            pair = (Dual(wi), Dual(wo)) if isinstance(weight, Dual) else (wi, wo)
            return blender_principled({**values, "retro_weight": weight}, *pair, needed_lobes(values, ["retro_weight"]))

        off, on = at(mi.Float(0.0)), at(mi.Float(0.4))
        slope = at(Dual(mi.Float(0.4), {0: mi.Float(1.0)})).x.slopes[0]
        steps = (at(mi.Float(0.5)).x - at(mi.Float(0.3)).x) / 0.2
        table = select_blender_parameters(["retro_weight", "roughness"])
        print(*table.names, needed_lobes(values).retro, dr.dot(wi, wo)[0])
        print(plain.x[0], off.x[0], on.x[0], slope[0], steps[0])
    """)
    first, second = said.splitlines()
    *names, off_by_itself, cosine = first.split()
    assert names == ["roughness", "retro_weight"]
    assert off_by_itself == "False"
    plain, off, on, slope, steps = map(float, second.split())
    assert off == pytest.approx(plain, rel=1e-5)
    assert on == pytest.approx(0.6 * plain + 0.4 * 1.5 / 3.14159265 * float(cosine) ** 2, rel=1e-4)
    assert slope == pytest.approx(steps, rel=1e-3)
