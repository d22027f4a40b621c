# SPDX-License-Identifier: Apache-2.0
"""Several shaders of a mix at once, and its factors: pictures at other values than those exported, against Cycles."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.nodes.target_shader import target_shader  # noqa: E402
from blender_addon.graph_values.mix_values import inside_values, mix_values  # noqa: E402
from blender_addon.result.write_back import apply_values, revert_values  # noqa: E402
from mfo_backend.job.folder.job_folder import JobFolder  # noqa: E402
from mfo_backend.job.folder.request import read_request  # noqa: E402
from mfo_backend.job.run.fit_scene import request_materials  # noqa: E402

from .test_mixed_targets import (  # noqa: E402
    BLUE,
    DIFFUSE,
    GLOSSY,
    GLOW,
    GOLD,
    METAL,
    PLASTIC,
    RED,
    SHEEN,
    TURNED,
    Build,
    add,
    bumped,
    material_of,
    mix,
    noise,
    shader,
)
from .test_node_graphs import ball, coordinates, lit_scene  # noqa: E402

COATED = shader("BsdfPrincipled", Base_Color=BLUE, Roughness=0.5, Coat_Weight=1.0, Coat_Roughness=0.3)
LIT_BELOW_A_COAT = shader(
    "BsdfPrincipled",
    Base_Color=BLUE,
    Emission_Color=GOLD,
    Emission_Strength=0.4,
    Coat_Weight=1.0,
    Coat_Roughness=0.4,
    Coat_IOR=2.2,
    Coat_Tint=RED,
)


def displaced(build: Build) -> Build:
    """With a displacement by bump, which bends the normals of all shaders."""

    def build_displaced(tree: Any) -> Any:
        height, displacement = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeDisplacement")
        height.inputs["Scale"].default_value, displacement.inputs["Scale"].default_value = 2.0, 0.3
        tree.links.new(coordinates(tree), height.inputs["Vector"])
        tree.links.new(height.outputs[0], displacement.inputs["Height"])
        tree.links.new(displacement.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
        return build(tree)

    return build_displaced


# a mix, and other values for it
CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    "factor and glossy": (
        mix(0.4, DIFFUSE, GLOSSY),
        {"Mix Shader/Factor": 0.7, "Glossy BSDF/Color": (0.1, 0.6, 0.3), "Glossy BSDF/Roughness": 0.55},
    ),
    "two of a kind below a mask": (
        mix(noise, SHEEN, mix(0.3, PLASTIC, METAL)),
        {"Mix Shader.001/Factor": 0.8, "Principled BSDF.001/Roughness": 0.6, "Principled BSDF.001/Base Color": BLUE},
    ),
    "added, three, a black side": (
        add(mix(0.6, DIFFUSE, None), mix(0.2, GLOSSY, mix(0.7, SHEEN, PLASTIC))),
        {"Mix Shader/Factor": 0.2, "Mix Shader.001/Factor": 0.6, "Principled BSDF/Base Color": RED},
    ),
    "the fitted one bumped": (
        mix(0.4, bumped(DIFFUSE, 4.0), GLOSSY),
        {"Mix Shader/Factor": 0.7, "Glossy BSDF/Color": (0.1, 0.6, 0.3), "Glossy BSDF/Roughness": 0.55},
    ),
    "the other one bumped": (
        mix(0.4, DIFFUSE, bumped(GLOSSY, 4.0)),
        {"Mix Shader/Factor": 0.7, "Glossy BSDF/Color": (0.1, 0.6, 0.3), "Glossy BSDF/Roughness": 0.55},
    ),
    "each bumped, one along its tangent": (
        mix(0.3, bumped(METAL, 2.0, strength=0.3), bumped(TURNED["glossy"], 3.0, strength=0.3)),
        {"Mix Shader/Factor": 0.6, "Glossy BSDF/Color": (0.1, 0.6, 0.3)},
    ),
    "a coat with a bump of its own": (
        mix(0.3, bumped(DIFFUSE, 3.0), bumped(COATED, 5.0, "Coat Normal")),
        {"Mix Shader/Factor": 0.6, "Principled BSDF/Base Color": RED},
    ),
    "normals that lean from their faces": (
        mix(0.4, DIFFUSE, GLOSSY),
        {"Mix Shader/Factor": 0.2, "Glossy BSDF/Color": (0.1, 0.6, 0.3), "Glossy BSDF/Roughness": 0.55},
    ),
    "normals that lean, below a sheen and a coat": (
        mix(0.3, SHEEN, COATED),
        {"Mix Shader/Factor": 0.6, "Principled BSDF/Base Color": RED},
    ),
    "a glow and a coated one": (
        mix(0.4, COATED, GLOW),
        {"Mix Shader/Factor": 0.7, "Emission/Color": GOLD, "Emission/Strength": 0.6},
    ),
    "glows that stay, one below a mask": (
        add(mix(0.3, DIFFUSE, SHEEN), mix(noise, GLOW, None)),
        {"Mix Shader/Factor": 0.6},
    ),
    "one that glows below its coat": (
        mix(0.3, DIFFUSE, LIT_BELOW_A_COAT),
        {"Mix Shader/Factor": 0.8, "Principled BSDF/Base Color": RED},
    ),
    "displaced, the other one bumped": (
        displaced(mix(0.4, DIFFUSE, bumped(GLOSSY, 4.0))),
        {"Mix Shader/Factor": 0.7, "Glossy BSDF/Color": (0.1, 0.6, 0.3), "Glossy BSDF/Roughness": 0.55},
    ),
}


def mix_node_input(material: Any) -> str:
    """What this Blender calls the factor of a Mix Shader."""
    return next(node for node in material.node_tree.nodes if node.type == "MIX_SHADER").inputs[0].name


def box(material: Any) -> Any:
    """A smooth cube, two thirds of which would mirror the view into itself."""
    bpy.ops.mesh.primitive_cube_add(size=1.6, rotation=(0.4, 0.3, 0.2))
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material)
    return bpy.context.object


def named(request: dict[str, Any]) -> list[str]:
    """The names of what is free beside the fitted leaf."""
    target = request["materials"]["target_bsdf"]
    return [f["name"] for f in target.get("factors", ())] + [
        name for leaf in target["leaves"] for name in leaf.get("free", {}).values()
    ]


def loaded(report: Any) -> Any:
    """The renderer of an exported job, with its values free."""
    from mfo_backend.render.pictures.renderer import load_renderer

    path = report.folder / "request.json"
    data = json.loads(path.read_text())
    path.write_text(json.dumps(data | {"reference": {"path": "scene.xml", "encoding": "linear"}}))
    folder = JobFolder.open(report.folder)
    request = read_request(folder)
    return load_renderer(
        folder.root / request.scene, request.target.shape_id, model="blender_principled",
        parameters=request.fit.parameters, materials=request_materials(folder, request),
        light_paths=request.light_paths,
    )  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_pictures_at_other_values_are_cycles(
    addon: None, scene: Any, export: Any, render_cycles: Any, mitsuba: Any, name: str
) -> None:
    """By recorded paths and by the path tracer that judges; derivatives are those of the pictures."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    lit_scene(scene)
    build, others = CASES[name]
    material = material_of(build)
    factor = mix_node_input(material)
    others = {name.replace("Factor", factor): value for name, value in others.items()}
    target = box(material) if "lean" in name else ball(material)
    known = mix_values(target_shader(material))
    values = [value.name for value in known if value.by_default or value.factor or value.name in others]
    fit = {"parameters": ["base_color", "roughness", *values]}
    report = export(target, fit=fit)
    assert set(others) <= set(named(report.request))
    renderer = loaded(report)
    table = renderer.table
    assert set(named(report.request)) <= set(table.names)
    recorded = RecordedScene(renderer, int(renderer.target_mask().sum()))
    paths = recorded.record(renderer.start, grid=4, seed=0, near=False)
    groups = paths.pixel_groups(paths.interior)
    vector = table.pack(table.unpack(renderer.start) | others)
    found = np.asarray(recorded.evaluator(paths, groups)(vector))
    picture = renderer.image(vector, seed=0, spp=256).reshape(-1, 3)[groups.pixels]
    notes = apply_values(material, others, report.folder, leaf="/".join(report.request["target"]["node"]))
    assert notes == []
    truth = render_cycles().reshape(-1, 3)[groups.pixels]
    for shown, most in ((found[:, :, 0], 0.03), (picture, 0.08)):  # in narrow highlights, at 16 and 256 rays a pixel
        assert abs(shown.mean() / truth.mean() - 1.0) < 0.003
        assert np.sqrt(np.mean((shown - truth) ** 2)) / truth.mean() < most
    step = 1e-3
    for j in range(table.length):
        ahead = vector.copy()
        ahead[j] += step if vector[j] + step < table.upper[j] else -step
        change = np.asarray(recorded.pictures(paths, groups)(ahead))[:, :, 0] - found[:, :, 0]
        slope = found[:, :, 1 + j] * (ahead[j] - vector[j])
        assert np.abs(change - slope).max() < 0.05 * np.abs(change).max() + 2e-6, table.names
    revert_values(material)
    np.testing.assert_allclose(loaded(export(target, fit=fit)).start, renderer.start, atol=1e-6)


def test_what_bends_the_normals_of_a_mix_is_held(scene: Any) -> None:
    """Its lanes keep one normal: a noise scale that feeds a factor alone is free, one of a bump besides is not."""
    material = material_of(mix(noise, bumped(DIFFUSE, 4.0), GLOSSY))
    target = target_shader(material)
    assert target is not None
    free = [value.name for value in inside_values(target)]
    assert "Noise Texture/Scale" in free
    assert "Bump/Strength" not in free
    tree = material.node_tree
    bump, texture = (
        tree.nodes["Bump"],
        tree.nodes["Mix Shader"].inputs[0].links[0].from_node.inputs[0].links[0].from_node,
    )
    tree.links.new(texture.outputs[0], bump.inputs["Height"])
    assert "Noise Texture/Scale" not in [value.name for value in inside_values(target_shader(material))]
