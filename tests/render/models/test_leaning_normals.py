# SPDX-License-Identifier: Apache-2.0
"""Which materials tell two normals: by the scene's XML."""

from __future__ import annotations

from types import SimpleNamespace
from xml.etree import ElementTree

import pytest

from mfo_backend.render.models.leaning_normals import share_own_normals, tell_own_normals

LEANS = '<texture type="uniform" name="leaning_normals"><float name="value" value="1"/></texture>'
SCENE = """<scene version="3.0.0"><integrator type="cycles_path"/>
<bsdf type="blender_principled" id="plain"/>
<bsdf type="blender_principled" id="other"/>
<bsdf type="closure_tree" id="mix"><bsdf type="blender_principled" name="fitted"/>
<bsdf type="blender_principled" name="leaf_0"/></bsdf>
<bsdf type="blendbsdf" id="baked"><ref id="part"/><bsdf type="null"/></bsdf>
<bsdf type="blender_principled" id="part"/>
<bsdf type="twosided" id="matt"><bsdf type="diffuse"><rgb name="reflectance" value="0.1, 0.2, 0.3"/></bsdf></bsdf>
<shape type="ply" id="fine"><ref id="other"/></shape>
<shape type="ply" id="coarse"><ref id="{id}"/>{leans}</shape></scene>"""


def told(material: str, leans: str = LEANS) -> tuple[ElementTree.Element, list[str]]:
    scene = ElementTree.fromstring(SCENE.format(id=material, leans=leans))
    tell_own_normals(scene)
    flagged = [b for b in scene.iter("bsdf") if b.find("boolean[@name='own_normals']") is not None]
    return scene, [str(b.get("id") or b.get("name")) for b in flagged]


@pytest.mark.parametrize(
    ("material", "expected"),
    [("plain", ["plain"]), ("mix", ["fitted", "leaf_0"]), ("baked", ["part"]), ("matt", ["matt"])],
)
def test_what_leaning_shapes_refer_to_tells_two_normals(material: str, expected: list[str]) -> None:
    scene, flagged = told(material)
    assert flagged == expected
    assert scene.find("integrator/boolean[@name='own_normals']") is not None


def test_other_scenes_stay_as_they_are() -> None:
    before = ElementTree.fromstring(SCENE.format(id="matt", leans=""))
    assert ElementTree.tostring(told("matt", "")[0]) == ElementTree.tostring(before)


def test_a_lambert_surface_becomes_the_plugin_without_reflections() -> None:
    matt = next(b for b in told("matt")[0].iter("bsdf") if b.get("id") == "matt")
    assert matt.get("type") == "blender_principled"
    assert matt.find("rgb[@name='base_color']").get("value") == "0.1, 0.2, 0.3"  # pyright: ignore
    assert matt.find("float[@name='specular_ior_level']").get("value") == "0.0"  # pyright: ignore


@pytest.mark.parametrize("one", [True, False])
def test_plugins_of_one_material_tell_two_normals_together(one: bool) -> None:
    plain, leaf, other, integrator = (SimpleNamespace(own_normals=False) for _ in range(4))
    mix = SimpleNamespace(leaves=[SimpleNamespace(material=leaf), SimpleNamespace(material=other)])
    other.own_normals = one
    share_own_normals([plain, mix], [integrator])
    assert [each.own_normals for each in (plain, leaf, other, integrator)] == [one] * 4
