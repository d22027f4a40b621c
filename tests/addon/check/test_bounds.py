# SPDX-License-Identifier: Apache-2.0
"""Limits of single values, from the panel's button to the request."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from mfo_backend.fit.settings import FitSettings

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
