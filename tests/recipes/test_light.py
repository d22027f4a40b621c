# SPDX-License-Identifier: Apache-2.0
"""A light that is added as the recipe says is exported from Blender and lights a point as the formula says."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from .recipe import follow


def test_a_new_light_goes_from_blender_to_the_floor(tmp_path: Path) -> None:
    pytest.importorskip("bpy")
    said = follow("A light", tmp_path).see("""
        import bpy, xml.etree.ElementTree as ElementTree
        import numpy as np
        from blender_addon.export.findings import Findings
        from blender_addon.export.lights.light_elements import light_element
        from blender_addon.export.lights.read_light import read_light

        data = bpy.data.lights.new("Ring", "AREA")
        data.shape, data.size, data.energy = "DISK", 2.0, 100.0
        data["ring"] = 0.5
        lamp = bpy.data.objects.new("Ring", data)
        bpy.context.scene.collection.objects.link(lamp)
        lamp.location.z = 3.0
        bpy.context.view_layer.update()
        light = read_light(lamp, np.array(lamp.matrix_world), 1.0, Findings(), camera=False, hidden_from=())
        element = ElementTree.fromstring(ElementTree.tostring(light_element(light, "ring", str), "unicode"))

        from mfo_backend.render.machine.plugins import check_plugins
        from mfo_backend.render.machine.variant import load_variant
        load_variant()
        import drjit as dr
        import mitsuba as mi
        from mfo_backend.render.lamps.lamp_plugins import register
        register()
        scene = mi.load_string('<scene version="3.0.0">' + ElementTree.tostring(element, "unicode") + "</scene>")
        emitter = scene.emitters()[0]
        random = np.random.default_rng(0)
        at = dr.zeros(mi.Interaction3f, 1 << 16)
        u = mi.Point2f(*random.random((2, 1 << 16)))
        sample, weight = emitter.sample_direction(at, u)
        print(element.get("type"), float(dr.mean(weight.x * sample.d.z)[0]))
    """)
    kind, irradiance = said.split()[-2:]
    assert kind == "blender_ring"
    # radiance L = P / (pi A); irradiance below the centre of a ring: pi L (R^2 / (R^2 + d^2) - r^2 / (r^2 + d^2))
    radiance = 100.0 / (math.pi * math.pi * (1.0 - 0.25))
    expected = math.pi * radiance * (1.0 / 10.0 - 0.25 / 9.25)
    assert float(irradiance) == pytest.approx(expected, rel=5e-3)
