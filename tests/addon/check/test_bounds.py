# SPDX-License-Identifier: Apache-2.0
"""Limits of single values, from the panel's button to the request."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from mfo_backend.fit.settings import FitSettings
from mfo_backend.material.principled import blender_selection

from ..test_operators import fit


def asked(job: str) -> dict:
    return json.loads(Path(job, "request.json").read_text("utf-8"))["fit"]


def test_limits_of_chosen_values_reach_the_backend(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    settings = bpy.context.scene.mfo
    settings.parameter_set, settings.sockets = "chosen", {"roughness", "ior"}
    for name in ("roughness", "ior", "metallic"):
        assert bpy.ops.mfo.limit_value(name=name) == {"FINISHED"}
    settings.bounds["roughness"].lower, settings.bounds["roughness"].upper = 0.25, 0.75
    fit(scene)
    assert asked(scene.job)["bounds"] == {"roughness": [0.25, 0.75], "ior": [1.0, 3.0]}  # metallic is not fitted
    assert FitSettings.from_request(asked(scene.job)).bounds["ior"] == (1.0, 3.0)
    bpy.ops.mfo.limit_value(name="roughness")
    settings.parameter_set = "all"
    fit(scene, job_folder=scene.job + "1")
    assert "bounds" not in asked(scene.job + "1")
    assert [bound.name for bound in settings.bounds] == ["ior", "metallic"]


def test_limits_the_wrong_way_round_are_named_by_the_check(scene: SimpleNamespace) -> None:
    from blender_addon.check.checks import quick_check

    context = scene.bpy.context
    settings = context.scene.mfo
    settings.reference_path, settings.parameter_set, settings.sockets = scene.reference, "chosen", {"roughness"}
    scene.bpy.ops.mfo.limit_value(name="roughness")
    settings.bounds["roughness"].lower = 1.0
    found = [f.sentence for f in quick_check(context.scene, context.view_layer) if f.level == "stops"]
    assert found == ["The limits of Roughness leave nothing: the least must be below the most."]
    with pytest.raises(RuntimeError, match="limits of Roughness"):
        fit(scene)


def test_details_of_a_lobe_without_weight_are_named_before_the_fit(scene: SimpleNamespace) -> None:
    from blender_addon.check.checks import quick_check

    bpy, context = scene.bpy, scene.bpy.context
    settings = context.scene.mfo
    settings.reference_path, settings.parameter_set = scene.reference, "chosen"
    coat = next(n for n in bpy.data.materials["Glaze"].node_tree.nodes if n.type == "BSDF_PRINCIPLED").inputs[
        "Coat Weight"
    ]

    def stops() -> list[str]:
        return [f.sentence for f in quick_check(context.scene, context.view_layer) if f.level == "stops"]

    settings.sockets, coat.default_value = {"roughness", "coat_roughness"}, 0.0
    assert stops() == ["Coat Roughness has no effect while Coat Weight is 0: give that a value, or choose it too."]
    coat.default_value = 0.5
    assert stops() == []
    settings.sockets, coat.default_value = {"coat_weight", "coat_roughness"}, 0.0
    assert stops() == []


def test_a_strength_is_fitted_where_its_colour_has_a_link(scene: SimpleNamespace) -> None:
    from blender_addon.check.checks import quick_check

    settings, material = scene.bpy.context.scene.mfo, scene.bpy.context.object.active_material
    settings.reference_path, settings.parameter_set = scene.reference, "chosen"
    settings.sockets = {"roughness", "emission_strength"}

    def said() -> list[str]:
        found = quick_check(scene.bpy.context.scene, scene.bpy.context.view_layer)
        return [f.sentence for f in found if f.sentence.startswith("Emission Strength")]

    assert said() == ["Emission Strength multiplies Emission Color, which has no link: choose that."]
    nodes, links = material.node_tree.nodes, material.node_tree.links
    links.new(nodes.new("ShaderNodeRGB").outputs[0], nodes["Principled BSDF"].inputs["Emission Color"])
    assert said() == []


def test_which_details_belong_to_a_lobe_is_as_the_backend_has_it() -> None:
    from blender_addon.check.checks import AMOUNT_OF

    def key(name: str) -> str:
        return name.lower().replace(" ", "_")

    assert {key(detail): key(amount) for detail, amount in AMOUNT_OF.items()} == blender_selection.AMOUNT_OF
