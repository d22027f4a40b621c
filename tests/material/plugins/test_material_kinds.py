# SPDX-License-Identifier: Apache-2.0
"""Materials that are traced once for all of their kind. Oracle: Dr.Jit's virtual calls, which trace each of them."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.pictures.mitsuba_renderer import load_renderers_together
from mfo_backend.types.light_paths import LightPaths
from tests.render.scenes import AREA, FLOOR, write_scene


def sockets(number):
    """A plain material of its own."""
    colour = [0.2 + 0.6 * ((number * step) % 7) / 7 for step in (1, 3, 5)]
    return {"Base Color": colour, "Roughness": 0.2 + 0.1 * (number % 5)}


def load(folder, count):
    """The target among `count` other balls on a floor of Mitsuba's own material; it and the first other are open."""
    others = "".join(
        f"""<bsdf type="diffuse" id="b{k}"/><shape type="sphere" id="ball{k}">
        <point name="center" x="{1.3 * np.cos(k)}" y="{1.3 * np.sin(k)}" z="{0.8 * np.sin(3 * k)}"/>
        <float name="radius" value="0.35"/><ref id="b{k}"/></shape>"""
        for k in range(count)
    )
    path = write_scene(folder, AREA + FLOOR + others, size=16, depth=3)
    names = ["target_bsdf", *(f"b{k}" for k in range(count))]
    materials = {
        name: {"name": name, "sockets": {s: {"value": v} for s, v in sockets(number).items()}}
        for number, name in enumerate(names)
    }
    targets = [(shape, ["base_color", "roughness"]) for shape in ("target", "ball0")]
    return load_renderers_together(path, targets, materials=materials, light_paths=LightPaths())


def pictures(renderers):
    """As loaded, and with the second ball's material changed."""
    first, second = renderers
    before = first.image(first.start, seed=1, spp=8)
    second.show(np.array([0.9, 0.1, 0.1, 0.3]))
    return before, first.image(first.start, seed=1, spp=8)


def test_pictures_are_those_of_virtual_calls(tmp_path, monkeypatch):
    ours = pictures(load(tmp_path, 4))
    from mfo_backend.material.plugins.material_kinds import MaterialKinds  # needs a variant

    monkeypatch.setattr(MaterialKinds, "eval_pdf", lambda self, bsdf, *rest: bsdf.eval_pdf(*rest))
    monkeypatch.setattr(MaterialKinds, "sample", lambda self, bsdf, *rest: bsdf.sample(*rest))
    theirs = pictures(load(tmp_path, 4))
    assert np.abs(ours[1] - ours[0]).max() > 0.03
    for one, other in zip(ours, theirs, strict=True):
        assert one == pytest.approx(other, rel=1e-4, abs=1e-5)


def test_a_further_material_of_a_kind_is_not_traced(tmp_path, monkeypatch):
    """What a picture of many materials costs in Python is that of their kinds: open ones, and held ones."""
    load(tmp_path, 1)
    from mfo_backend.material.plugins.principled_plugin import BlenderPrincipled  # needs a variant

    traced, plain = [], BlenderPrincipled.layers_at

    def counted(self, *arguments, **values):
        traced.append(self)
        return plain(self, *arguments, **values)

    monkeypatch.setattr(BlenderPrincipled, "layers_at", counted)
    of = {}
    for count in (3, 7):
        first, _ = load(tmp_path, count)
        traced.clear()
        first.image(first.start, seed=1, spp=8)
        of[count] = len(traced), len(set(map(id, traced)))
    assert of[3] == of[7]
    assert of[7][1] == 2
