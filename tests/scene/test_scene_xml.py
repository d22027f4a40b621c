# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from mfo_backend.scene.scene_xml import (
    find_target,
    prepare_for_fit,
    read_scene,
    read_values,
    require_principled,
    unwrap_twosided,
    write_values,
)
from mfo_backend.types.errors import BadInputError

VALUES = """<rgb name="base_color" value="0.5, 0.1 0.2"/><float name="roughness" value="0.3"/>
<texture type="bitmap" name="metallic"/>"""
INLINE = f'<shape type="sphere" id="target"><bsdf type="principled">{VALUES}</bsdf></shape>'
REFERRED = (
    f'<bsdf type="principled" id="glaze">{VALUES}</bsdf><shape type="sphere" id="target"><ref id="glaze"/></shape>'
)
TWOSIDED = (
    '<shape type="sphere" id="target"><bsdf type="twosided" id="glaze">'
    f'<bsdf type="principled">{VALUES}</bsdf></bsdf></shape>'
)
NESTED_REF = (
    f'<bsdf type="principled" id="inner">{VALUES}</bsdf><bsdf type="twosided" id="glaze"><ref id="inner"/></bsdf>'
    '<shape type="sphere" id="target"><ref id="glaze"/></shape>'
)


def scene_of(body: str) -> ElementTree.Element:
    return ElementTree.fromstring(f'<scene version="3.0.0">{body}</scene>')


@pytest.mark.parametrize(
    ("body", "bsdf_id"),
    [(INLINE, "target_bsdf"), (REFERRED, "glaze"), (TWOSIDED, "glaze"), (NESTED_REF, "glaze")],
    ids=["inline", "ref", "twosided", "ref inside twosided"],
)
def test_finds_the_principled_bsdf_and_its_values(body: str, bsdf_id: str) -> None:
    scene = scene_of(body)
    target = find_target(scene, "target")
    assert target.bsdf_id == bsdf_id
    require_principled(target)
    values, linked = read_values(target.inner)
    assert values == {"base_color": (0.5, 0.1, 0.2), "roughness": 0.3}
    assert linked == ("metallic",)
    # the shape refers to a material at the top of the scene
    assert [e for e in scene.findall("bsdf") if e.get("id") == bsdf_id]
    assert [e.get("id") for e in scene.find("shape").findall("ref")] == [bsdf_id]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("body", "shape_id", "sentence"),
    [
        (INLINE, "vase", "No shape 'vase' in the scene: its shapes are 'target'."),
        ('<shape type="sphere"/>', "vase", "none with an id"),
        ('<shape type="sphere" id="target"/>', "target", "has 0 BSDFs: it needs exactly one"),
        (
            '<shape type="sphere" id="target"><bsdf type="diffuse"/><bsdf type="diffuse"/></shape>',
            "target",
            "has 2 BSDFs",
        ),
        (
            '<shape type="sphere" id="target"><bsdf type="diffuse"/></shape>',
            "target",
            "is 'diffuse': only 'principled' can be fitted",
        ),
        (
            '<shape type="sphere" id="target"><bsdf type="twosided" id="t"><ref id="t"/></bsdf></shape>',
            "target",
            "only 'principled'",
        ),
        (
            '<shape type="sphere" id="target"><bsdf type="twosided"/></shape>',
            "target",
            "holds 0 BSDFs: one is needed",
        ),
    ],
)
def test_names_what_is_wrong_with_a_target(body: str, shape_id: str, sentence: str) -> None:
    with pytest.raises(BadInputError) as caught:
        require_principled(find_target(scene_of(body), shape_id))
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [("not xml", "is not XML"), ("<blend/>", "holds <blend>, not <scene>"), (None, "Cannot read the scene")],
)
def test_refuses_files_that_are_no_scene(tmp_path: Path, content: str | None, sentence: str) -> None:
    path = tmp_path / "scene.xml"
    if content is not None:
        path.write_text(content)
    with pytest.raises(BadInputError, match=sentence):
        read_scene(path)


def test_fills_in_defaults_and_makes_existing_files_absolute(tmp_path: Path) -> None:
    (tmp_path / "a.ply").touch()
    path = tmp_path / "scene.xml"
    path.write_text(
        '<scene version="3.0.0"><default name="res" value="64"/><default name="res_y" value="32"/>'
        '<integer name="width" value="$res"/><integer name="height" value="$res_y"/>'
        '<string name="filename" value="a.ply"/><string name="filename" value="gone.ply"/></scene>'
    )
    scene = read_scene(path)
    assert [e.get("value") for e in scene.findall("integer")] == ["64", "32"]
    assert [e.get("value") for e in scene.findall("string")] == [str((tmp_path / "a.ply").resolve()), "gone.ply"]


def test_written_values_read_back_exactly_and_replace_old_ones() -> None:
    target = find_target(scene_of(INLINE), "target")
    write_values(target.inner, {"base_color": (0.1, 1 / 3, 0.7), "sheen": 1e-3}, drop=("roughness",))
    values, linked = read_values(target.inner)
    assert values == {"base_color": (0.1, 1 / 3, 0.7), "sheen": 1e-3}
    assert linked == ("metallic",)


def test_takes_away_a_twosided_wrapper() -> None:
    target = unwrap_twosided(find_target(scene_of(TWOSIDED), "target"))
    assert target.outer is target.inner
    assert (target.outer.get("type"), target.outer.get("id")) == ("principled", "glaze")
    assert read_values(target.inner)[0]["roughness"] == 0.3


@pytest.mark.parametrize(
    ("integrator", "depth", "roulette", "hidden"),
    [
        ("", "-1", "5", "false"),
        ('<integrator type="direct"/>', "2", "3", "false"),
        (
            '<integrator type="path"><integer name="max_depth" value="4"/>'
            '<boolean name="hide_emitters" value="true"/></integrator>',
            "4",
            "5",
            "true",
        ),
        ('<integrator type="path"><integer name="rr_depth" value="7"/></integrator>', "-1", "7", "false"),
    ],
)
def test_puts_in_the_differentiable_integrator(integrator: str, depth: str, roulette: str, hidden: str) -> None:
    scene = scene_of(integrator + '<sensor type="perspective"/><sensor type="orthographic"/>')
    prepare_for_fit(scene)
    (found,) = scene.findall("integrator")
    assert found.get("type") == "prb"
    assert {e.get("name"): e.get("value") for e in found} == {
        "max_depth": depth,
        "rr_depth": roulette,
        "hide_emitters": hidden,
    }
    (sensor,) = scene.findall("sensor")
    assert sensor.get("type") == "perspective"


def test_keeps_size_crop_border_and_filter_of_the_film() -> None:
    scene = scene_of(
        '<sensor type="perspective"><sampler type="stratified"/><film type="specfilm"><rfilter type="gaussian"/>'
        '<integer name="width" value="64"/><integer name="height" value="32"/><integer name="crop_width" value="8"/>'
        '<string name="pixel_format" value="rgba"/><boolean name="sample_border" value="true"/></film></sensor>'
    )
    prepare_for_fit(scene)
    film = scene.find("sensor/film")
    assert film is not None
    assert film.get("type") == "hdrfilm"
    assert film.find("rfilter").get("type") == "gaussian"  # type: ignore[union-attr]
    options = {e.get("name"): e.get("value") for e in film if e.tag != "rfilter"}
    assert options == {
        "width": "64",
        "height": "32",
        "crop_width": "8",
        "sample_border": "true",
        "pixel_format": "rgb",
        "component_format": "float32",
    }
    assert [e.get("type") for e in scene.findall("sensor/sampler")] == ["independent"]


def test_a_scene_needs_a_camera() -> None:
    with pytest.raises(BadInputError, match="no camera"):
        prepare_for_fit(scene_of(""))


def test_a_wrapper_may_hold_textures_and_must_not_refer_to_nothing() -> None:
    nested = f'<texture type="bitmap"/><ref id="bumps"/><bsdf type="principled">{VALUES}</bsdf>'
    around = '<shape type="sphere" id="target"><bsdf type="bumpmap" id="glaze">{}</bsdf></shape>'
    target = find_target(scene_of('<texture type="bitmap" id="bumps"/>' + around.format(nested)), "target")
    assert target.inner.get("type") == "principled"
    with pytest.raises(BadInputError, match=r"holds 0 BSDFs: one is needed"):
        find_target(scene_of(around.format('<ref id="gone"/>')), "target")


def test_only_numbers_and_textures_are_values() -> None:
    """Words, switches and nested materials have names, too; what has none is no value."""
    bsdf = ElementTree.fromstring(
        '<bsdf type="principled"><float name="roughness" value="0.3"/><rgb name="base_color" value="0.1, 0.2, 0.3"/>'
        '<texture type="bitmap" name="metallic"/><ref id="picture" name="specular"/>'
        '<string name="distribution" value="ggx"/><boolean name="sample_visible" value="true"/>'
        '<bsdf type="diffuse" name="below"/><float value="0.7"/></bsdf>'
    )
    values, linked = read_values(bsdf)
    assert values == {"roughness": 0.3, "base_color": (0.1, 0.2, 0.3)}
    assert linked == ("metallic", "specular")
