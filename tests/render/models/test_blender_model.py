# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mfo_backend.material.principled.blender_selection import select_blender_parameters
from mfo_backend.render.pictures.renderer import Renderer, load_renderer
from mfo_backend.types.errors import BadInputError

SCENE = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="2"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/>
<transform name="to_world"><lookat origin="0, -4, 0" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><rfilter type="box"/><integer name="width" value="16"/><integer name="height" value="16"/></film>
</sensor><bsdf type="twosided" id="glaze"><bsdf type="principled"/></bsdf>
<shape type="sphere" id="target"><ref id="glaze"/></shape>
<emitter type="point"><point name="position" x="2" y="-3" z="3"/><rgb name="intensity" value="20"/></emitter></scene>"""
SOCKETS = {
    "Base Color": {"value": [0.6, 0.2, 0.1], "linked": False},
    "Roughness": {"value": 0.4, "linked": False},
    "Coat Weight": {"value": 0.5, "linked": False},
    "Metallic": {"value": 0.3, "linked": True},
    "Normal": {"value": [0.0, 0.0, 0.0], "linked": False},
}


def load(tmp_path: Path, parameters, materials=None) -> Renderer:
    path = tmp_path / "scene.xml"
    path.write_text(SCENE)
    if materials is None:
        materials = {"glaze": {"name": "Glaze", "distribution": "MULTI_GGX", "sockets": SOCKETS}}
    return load_renderer(path, "target", model="blender_principled", parameters=parameters, materials=materials)


@pytest.mark.parametrize(("leaves", "shown"), [([], "Color"), ([{"shader": "emission", "sockets": {}}], "Gloss/Color")])
def test_values_have_the_labels_of_their_node(tmp_path: Path, leaves: list, shown: str) -> None:
    material = {"name": "Glaze", "distribution": "MULTI_GGX", "sockets": SOCKETS, "shader": "glossy"}
    mixed = {"weight": {"value": 1.0}, "leaves": [leaf | {"weight": {"value": 0.5}} for leaf in leaves]}
    labelled = material | mixed | {"labels": {"base_color": "Color"}, "node": "Gloss"}
    table = load(tmp_path, ("base_color",), {"glaze": labelled}).table
    assert table["base_color"].shown == shown
    assert load(tmp_path, ("base_color",)).table["base_color"].label == ""


def test_starts_at_the_sockets_and_follows_finite_differences(tmp_path: Path) -> None:
    renderer = load(tmp_path, ("base_color", "roughness", "coat_weight"))
    assert renderer.table.unpack(renderer.start) == {
        "base_color": (0.6, 0.2, 0.1),
        "roughness": 0.4,
        "coat_weight": 0.5,
    }
    weight = np.random.default_rng(0).random((16, 16, 3)).astype(np.float32)
    image, pullback = renderer.image_and_pullback(renderer.start, seed=1, spp=4)
    assert image[renderer.target_mask()].max() > 0.05
    gradient = pullback(weight)
    for i, h in enumerate(1e-2 * np.eye(renderer.table.length)):
        low, high = (renderer.image(renderer.start + s * h, seed=1, spp=4).astype(float) for s in (-1, 1))
        # a point light: paths do not move with the material; the rest is the h^2 of the difference and float32
        np.testing.assert_allclose(gradient[i], np.sum((high - low) * weight) / 2e-2, rtol=5e-3)


@pytest.mark.parametrize(
    ("index", "start", "lower", "upper"),
    [
        (3.3, 3.3, 1.01, 3.3),
        (0.7, 0.7, 1 / 2.5, 1 / 1.01),
        (0.2, 0.2, 0.2, 1 / 1.01),
        (1.0, 1.01, 1.01, 2.5),
        (1.45, 1.45, 1.01, 2.5),
    ],
)
@pytest.mark.parametrize("name", ["ior", "coat_ior"])
def test_an_unusual_index_of_the_scene_is_where_a_fit_begins(
    tmp_path: Path, name: str, index: float, start: float, lower: float, upper: float
) -> None:
    """A canopy of 3.3 began at 2.5, which was the most it could be, and "kept" that."""
    socket = {"ior": "IOR", "coat_ior": "Coat IOR"}[name]
    sockets = SOCKETS | {socket: {"value": index}, "Transmission Weight": {"value": 1.0}}
    renderer = load(tmp_path, (name, "roughness"), {"glaze": {"name": "Glaze", "sockets": sockets}})
    assert renderer.table.unpack(renderer.start)[name] == pytest.approx(start)
    assert (renderer.table[name].lower, renderer.table[name].upper) == pytest.approx((lower, upper))
    image, pullback = renderer.image_and_pullback(renderer.start, seed=1, spp=4)
    assert np.isfinite(image).all()
    assert np.isfinite(pullback(np.ones_like(image))).all()


def test_an_unusual_index_of_a_shader_in_a_mix_is_where_a_fit_begins(tmp_path: Path) -> None:
    sockets = {"IOR": {"value": 3.3}, "Base Color": {"value": [0.5, 0.5, 0.5]}, "Coat IOR": {"value": 3.3}}
    free = {"IOR": "Pane/IOR", "Coat IOR": "Pane/Coat IOR"}
    pane = {"name": "Pane", "shader": "principled", "sockets": sockets, "weight": {"value": 0.5}, "free": free}
    mixed = {"name": "Paint", "sockets": SOCKETS, "weight": {"value": 0.5}, "leaves": [pane]}
    renderer = load(tmp_path, ("roughness",), {"glaze": mixed})
    values = renderer.table.unpack(renderer.start)
    assert (values["Pane/IOR"], values["Pane/Coat IOR"]) == (3.3, 3.3)


def test_the_strength_of_a_shader_in_a_mix_may_be_five_times_that_of_the_scene(tmp_path: Path) -> None:
    """A neon of strength 20 began at 5, which was the most it could be."""
    sockets = {"Emission Color": {"value": [1.0, 0.2, 0.1]}, "Emission Strength": {"value": 20.0}}
    free = {"Emission Strength": "Neon/Strength"}
    neon = {"name": "Neon", "shader": "emission", "sockets": sockets, "weight": {"value": 0.5}, "free": free}
    mixed = {"name": "Paint", "sockets": SOCKETS, "weight": {"value": 0.5}, "leaves": [neon]}
    renderer = load(tmp_path, ("roughness",), {"glaze": mixed})
    values = renderer.table.unpack(renderer.start)
    assert values["Neon/Strength"] == 20.0
    assert renderer.table["Neon/Strength"].upper == 100.0


def test_the_whole_set_leaves_out_linked_and_invisible_parameters(tmp_path: Path) -> None:
    names = load(tmp_path, "all").table.names
    assert {"base_color", "roughness", "coat_weight", "sheen_weight", "specular_ior_level"} <= set(names)
    assert not {"metallic", "alpha", "ior", "transmission_weight", "emission_strength"} & set(names)
    assert load(tmp_path, "reduced").table.names == ("base_color", "roughness", "specular_ior_level")


def test_strength_is_free_where_nodes_give_the_colour_of_the_emission() -> None:
    glowing, linked = ("emission_strength", "roughness"), ("emission_color",)
    assert "emission_strength" in select_blender_parameters("all", present=glowing, linked=linked).names
    assert "emission_strength" not in select_blender_parameters("all", present=glowing).names
    assert "emission_strength" not in select_blender_parameters("all", linked=linked).names  # another class's to try
    assert select_blender_parameters(("emission_strength",), linked=linked).names == ("emission_strength",)
    with pytest.raises(BadInputError, match="give it a value in the scene"):
        select_blender_parameters(("emission_color",))


@pytest.mark.parametrize(
    ("parameters", "materials", "sentence"),
    [
        (("roughness",), {}, "Material 'glaze' has no sockets for model 'blender_principled' (given: none)"),
        (("metallic",), None, "'metallic' is linked to a texture"),
        (("emission_strength",), None, "it multiplies 'emission_color'"),
        ("most", None, "Unknown parameter set 'most'"),
        (("gloss",), None, "Unknown parameter 'gloss'"),
    ],
)
def test_refuses_what_it_cannot_fit(tmp_path, parameters, materials, sentence: str) -> None:
    with pytest.raises(BadInputError) as caught:
        load(tmp_path, parameters, materials)
    assert sentence in str(caught.value)
