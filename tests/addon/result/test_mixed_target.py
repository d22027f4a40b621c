# SPDX-License-Identifier: Apache-2.0
"""Materials that mix shaders: which leaf is fitted, where its values are written, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

JOB = Path("job")


@pytest.fixture
def mixed(scene: SimpleNamespace) -> SimpleNamespace:
    """A Mix of the material's Principled BSDF (0.7) and a Glossy BSDF (0.3)."""
    material = scene.bpy.data.materials["Glaze"]
    tree, output = material.node_tree, material.node_tree.get_output_node("CYCLES")
    mix, glossy = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfAnisotropic")
    principled = output.inputs["Surface"].links[0].from_node
    mix.inputs[0].default_value = 0.3
    tree.links.new(principled.outputs[0], mix.inputs[1])
    tree.links.new(glossy.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return SimpleNamespace(
        bpy=scene.bpy, material=material, tree=tree, mix=mix, glossy=glossy, principled=principled, output=output
    )


def shares(material) -> dict[str, float]:
    from blender_addon.export.nodes.closure_leaves import closure_leaves

    return {leaf.node.name: round(leaf.share, 3) for leaf in closure_leaves(material)}


def test_leaves_and_shares(mixed: SimpleNamespace) -> None:
    from blender_addon.export.nodes.target_shader import target_shader

    tree, mix = mixed.tree, mixed.mix
    assert shares(mixed.material) == {"Principled BSDF": 0.7, "Glossy BSDF": 0.3}
    assert target_shader(mixed.material).node == mixed.principled  # of the larger share
    mix.inputs[0].default_value = 1.7  # as Cycles clamps it
    assert shares(mixed.material) == {"Glossy BSDF": 1.0}
    mix.inputs[0].default_value = -0.5
    assert shares(mixed.material) == {"Principled BSDF": 1.0}
    mix.inputs[0].default_value = 0.25
    tree.links.remove(mix.inputs[1].links[0])
    assert shares(mixed.material) == {"Glossy BSDF": 0.25}  # the other side is black
    add = tree.nodes.new("ShaderNodeAddShader")
    for side in add.inputs:
        tree.links.new(mix.outputs[0], side)
    tree.links.new(add.outputs[0], mixed.output.inputs["Surface"])
    assert shares(mixed.material) == {"Glossy BSDF": 0.5}  # reached in two ways
    add.mute = True
    assert shares(mixed.material) == {"Glossy BSDF": 0.25}


@pytest.mark.parametrize(("shader", "names"), [("", ["Roughness"]), ("Glossy BSDF", ["Roughness"])])
def test_the_chosen_leaf_is_exported(scene: SimpleNamespace, mixed: SimpleNamespace, shader: str, names: list) -> None:
    mixed.bpy.ops.mfo.fit(
        reference=scene.reference, job_folder=scene.job, parameters="Roughness", max_iterations=3, shader=shader
    )
    request = json.loads((Path(scene.job) / "request.json").read_text("utf-8"))
    target, material = request["target"], request["materials"]["target_bsdf"]
    assert target["node"] == [shader or "Principled BSDF"]
    labels = {"base_color": "Color", "roughness": "Roughness"} if shader else {}
    assert {name: target["labels"].get(name) for name in labels} == labels
    assert material.get("shader", "principled") == ("glossy" if shader else "principled")
    assert material["weight"]["value"] == pytest.approx(0.3 if shader else 0.7)
    (other,) = material["leaves"]
    assert other["name"] == ("Principled BSDF" if shader else "Glossy BSDF")
    assert request["fit"]["parameters"] in (["roughness"], ["Roughness"])


def test_values_go_to_the_leaf_and_back(mixed: SimpleNamespace) -> None:
    from blender_addon.result.write_back import apply_values, revert_values, toggle_values

    glossy, principled = mixed.glossy.inputs, mixed.principled.inputs
    before = (tuple(glossy["Color"].default_value), glossy["Roughness"].default_value)
    own = principled["Roughness"].default_value
    values = {"Base Color": (0.5, 0.25, 0.125), "Roughness": 0.625}
    assert apply_values(mixed.material, values, JOB, leaf="Glossy BSDF") == []
    assert tuple(glossy["Color"].default_value)[:3] == pytest.approx((0.5, 0.25, 0.125), abs=1e-6)
    assert (glossy["Roughness"].default_value, principled["Roughness"].default_value) == (0.625, own)
    assert apply_values(mixed.material, {"Roughness": 0.125}, JOB, leaf="Principled BSDF") == []
    assert (glossy["Roughness"].default_value, principled["Roughness"].default_value) == (0.625, 0.125)
    toggle_values(mixed.material)
    assert (glossy["Roughness"].default_value, principled["Roughness"].default_value) == (before[1], own)
    toggle_values(mixed.material)
    assert revert_values(mixed.material) == []
    assert (tuple(glossy["Color"].default_value), glossy["Roughness"].default_value) == before
    assert principled["Roughness"].default_value == own


def test_several_leaves_and_the_factor_go_back_at_once(mixed: SimpleNamespace) -> None:
    """Whichever leaf has the plain names: a value is kept once."""
    from blender_addon.result.write_back import apply_values, revert_values, toggle_values

    mix, glossy, principled = mixed.mix.inputs, mixed.glossy.inputs, mixed.principled.inputs

    def now() -> tuple[float, ...]:
        color = tuple(glossy["Color"].default_value)[:3]
        return (mix[0].default_value, glossy["Roughness"].default_value, principled["Roughness"].default_value, *color)

    before, factor = now(), f"Mix Shader/{mix[0].name}"
    values = {
        factor: 0.625, "Roughness": 0.75, "Glossy BSDF/Roughness": 0.25, "Glossy BSDF/Color": (0.5, 0.25, 0.125),
    }  # fmt: skip
    assert apply_values(mixed.material, values, JOB, leaf="Principled BSDF") == []
    assert now() == pytest.approx((0.625, 0.25, 0.75, 0.5, 0.25, 0.125), abs=1e-6)
    values = {factor: 0.5, "Roughness": 0.375, "Principled BSDF/Roughness": 0.125}
    assert apply_values(mixed.material, values, JOB, leaf="Glossy BSDF") == []
    assert now() == pytest.approx((0.5, 0.375, 0.125, 0.5, 0.25, 0.125), abs=1e-6)
    toggle_values(mixed.material)
    assert now() == before
    toggle_values(mixed.material)
    assert now() == pytest.approx((0.5, 0.375, 0.125, 0.5, 0.25, 0.125), abs=1e-6)
    assert revert_values(mixed.material) == []
    assert now() == before


def exported(scene: SimpleNamespace, mixed: SimpleNamespace, parameters: str, **options: str) -> dict:
    mixed.bpy.ops.mfo.fit(
        reference=scene.reference, job_folder=scene.job, parameters=parameters, max_iterations=3, **options
    )
    return json.loads((Path(scene.job) / "request.json").read_text("utf-8"))


def test_all_shaders_of_a_mix_are_asked_for(scene: SimpleNamespace, mixed: SimpleNamespace) -> None:
    mixed.principled.inputs["Sheen Weight"].default_value = 0.5
    request = exported(scene, mixed, "all", shader="all")
    assert mixed.material.mfo.leaf == "*"
    material = request["materials"]["target_bsdf"]
    assert request["target"]["node"] == ["Principled BSDF"]  # of the larger share
    assert material["factors"] == [{"name": f"Mix Shader/{mixed.mix.inputs[0].name}", "value": pytest.approx(0.3)}]
    (other,) = material["leaves"]
    assert set(other["free"].values()) >= {"Glossy BSDF/Color", "Glossy BSDF/Roughness"}
    assert material["ways"] == [{"share": pytest.approx(1 / 0.7), "first": [0], "second": []}]
    assert other["ways"] == [{"share": pytest.approx(1 / 0.3), "first": [], "second": [0]}]
    assert "and 1 more and Mix factors" in " ".join(request["notes"])


def test_a_factor_that_colours_make_up_for_is_held(scene: SimpleNamespace, mixed: SimpleNamespace) -> None:
    """Twice the factor and half the colours are the same picture; by its name it is fitted."""
    diffuse = mixed.tree.nodes.new("ShaderNodeBsdfDiffuse")
    mixed.tree.links.new(diffuse.outputs[0], mixed.mix.inputs[1])
    factor = f"Mix Shader/{mixed.mix.inputs[0].name}"
    request = exported(scene, mixed, "all", shader="all")
    assert "factors" not in request["materials"]["target_bsdf"]
    assert any(f"{factor} stays as it is" in note for note in request["notes"])
    request = exported(scene, mixed, factor)
    assert [each["name"] for each in request["materials"]["target_bsdf"]["factors"]] == [factor]


def test_values_of_a_mix_are_chosen_by_name(scene: SimpleNamespace, mixed: SimpleNamespace) -> None:
    """Those of the fitted leaf by its name, too; a mix of which nothing else is asked for has nothing else free."""
    request = exported(scene, mixed, "Principled BSDF/Base Color, glossy bsdf/roughness", shader="Principled BSDF")
    material = request["materials"]["target_bsdf"]
    assert request["fit"]["parameters"] in (["Base Color"], ["base_color"])
    assert [leaf["free"] for leaf in material["leaves"]] == [{"Roughness": "Glossy BSDF/Roughness"}]
    assert "factors" not in material
    request = exported(scene, mixed, "Roughness")
    material = request["materials"]["target_bsdf"]
    assert not {"free", "factors", "ways"} & {key for leaf in (material, *material["leaves"]) for key in leaf}


@pytest.mark.parametrize(
    ("parameters", "said"),
    [("Glossy BSDF/Rougness", "nearest is 'Glossy BSDF/Roughness'"), ("Mix Shader/Blend", "nearest is 'Mix Shader/F")],
)
def test_an_unknown_value_of_a_mix_is_one_sentence(
    scene: SimpleNamespace, mixed: SimpleNamespace, parameters: str, said: str
) -> None:
    with pytest.raises(RuntimeError, match=said):
        exported(scene, mixed, parameters)


def test_what_lets_light_through_keeps_others_held(scene: SimpleNamespace, mixed: SimpleNamespace) -> None:
    glass = mixed.tree.nodes.new("ShaderNodeBsdfGlass")
    mixed.tree.links.new(glass.outputs[0], mixed.mix.inputs[2])
    with pytest.raises(RuntimeError, match="cannot be fitted: 'Glass BSDF' lets light through"):
        exported(scene, mixed, "Glass BSDF/Roughness", shader="Principled BSDF")
    notes = exported(scene, mixed, "all", shader="all")["notes"]
    assert any("'Principled BSDF' alone is fitted: 'Glass BSDF' lets light through" in note for note in notes)


def test_a_wrong_leaf_is_one_sentence(mixed: SimpleNamespace) -> None:
    ops = mixed.bpy.ops.mfo
    with pytest.raises(
        RuntimeError, match="has no shader 'Velvet' that can be fitted: give one of 'Principled BSDF', 'G"
    ):
        ops.choose_shader(shader="Velvet")
    assert ops.choose_shader(shader="Glossy BSDF") == {"FINISHED"}
    assert mixed.material.mfo.leaf == "Glossy BSDF"


def test_a_circle_is_one_sentence(mixed: SimpleNamespace) -> None:
    from blender_addon.export.nodes.target_shader import target_shader, why_no_target

    mixed.tree.links.new(mixed.mix.outputs[0], mixed.mix.inputs[2])
    assert target_shader(mixed.material) is None
    assert "in a circle" in why_no_target(mixed.material)


def test_a_group_without_output_is_one_sentence(mixed: SimpleNamespace) -> None:
    from blender_addon.export.nodes.target_shader import target_shader, why_no_target

    group = mixed.tree.nodes.new("ShaderNodeGroup")
    inner = mixed.bpy.data.node_groups.new("Empty", "ShaderNodeTree")
    inner.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
    group.node_tree = inner
    mixed.tree.links.new(group.outputs[0], mixed.output.inputs["Surface"])
    assert target_shader(mixed.material) is None
    assert "has no Principled BSDF" in why_no_target(mixed.material)


def test_what_has_no_model_is_named(mixed: SimpleNamespace) -> None:
    from blender_addon.export.nodes.target_shader import why_no_target

    for kind, said in (
        ("ShaderNodeBsdfHair", "has lobes that the fit does not have"),
        ("ShaderNodeHoldout", "Holdout"),
    ):
        node = mixed.tree.nodes.new(kind)
        mixed.tree.links.new(node.outputs[0], mixed.output.inputs["Surface"])
        assert said in why_no_target(mixed.material)
    if not hasattr(mixed.bpy.types, "ShaderNodeBsdfMetallic"):
        return  # Blender 4.2
    metal = mixed.tree.nodes.new("ShaderNodeBsdfMetallic")
    metal.fresnel_type = "PHYSICAL_CONDUCTOR"
    if "Thin Film Thickness" not in metal.inputs:
        return  # before 5.0
    metal.inputs["Thin Film Thickness"].default_value = 300.0
    mixed.tree.links.new(metal.outputs[0], mixed.output.inputs["Surface"])
    assert "set its thickness to 0" in why_no_target(mixed.material)


def test_a_volume_inside_of_glass_is_written_to_its_own_node_and_back(mixed: SimpleNamespace) -> None:
    from blender_addon.export.nodes.target_shader import target_shader
    from blender_addon.result.write_back import apply_values, revert_values

    tree, material = mixed.tree, mixed.material
    volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
    tree.links.new(volume.outputs[0], mixed.output.inputs["Volume"])
    names = {"Absorption Density", "Absorption Color"}
    assert not names & target_shader(material).places.keys()  # no light gets in
    mixed.principled.inputs["Transmission Weight"].default_value = 1.0
    assert names <= target_shader(material).places.keys()
    before = [volume.inputs["Density"].default_value, *volume.inputs["Color"].default_value]
    colour = mixed.principled.inputs["Base Color"].default_value[:]
    assert apply_values(material, {"Absorption Density": 3.0, "Absorption Color": (0.1, 0.2, 0.3)}, JOB) == []
    after = [volume.inputs["Density"].default_value, *volume.inputs["Color"].default_value]
    assert after == pytest.approx([3.0, 0.1, 0.2, 0.3, 1.0])
    assert mixed.principled.inputs["Base Color"].default_value[:] == colour
    assert revert_values(material) == []
    assert [volume.inputs["Density"].default_value, *volume.inputs["Color"].default_value] == before
