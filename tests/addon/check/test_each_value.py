# SPDX-License-Identifier: Apache-2.0
"""What the check lets begin, the backend takes: each value chosen alone, at materials with and without lobes."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from mfo_backend.material.principled.blender_selection import REDUCED, select_blender_parameters
from mfo_backend.types.errors import BadInputError


@pytest.mark.parametrize("weights", [0.0, 0.5])
def test_the_check_and_the_backend_agree_on_each_value_chosen_alone(scene: SimpleNamespace, weights: float) -> None:
    from blender_addon.check.checks import quick_check
    from blender_addon.properties import SOCKET_ITEMS

    context = scene.bpy.context
    settings = context.scene.mfo
    settings.reference_path, settings.parameter_set = scene.reference, "chosen"
    nodes = scene.bpy.data.materials["Glaze"].node_tree.nodes
    shader = next(node for node in nodes if node.type == "BSDF_PRINCIPLED")
    for name in ("Coat Weight", "Sheen Weight", "Subsurface Weight", "Anisotropic", "Emission Strength"):
        shader.inputs[name].default_value = weights
    shader.inputs["Thin Film Thickness"].default_value = weights
    present = [s.name.lower().replace(" ", "_") for s in shader.inputs if s.type == "VALUE" and s.default_value != 0.0]
    disagree, begin = [], 0
    for key, name, *_ in SOCKET_ITEMS:
        if name not in shader.inputs:
            continue
        settings.sockets = {key}
        stops = [f.sentence for f in quick_check(context.scene, context.view_layer) if f.level == "stops"]
        begin += not stops
        try:
            select_blender_parameters([key], present=present)
        except BadInputError as error:
            disagree += [] if stops else [str(error)]
        else:
            disagree += stops
    assert disagree == []
    assert begin >= 12


@pytest.mark.parametrize("named", ["reduced", "all"])
@pytest.mark.parametrize("linked", [REDUCED, REDUCED[1:]], ids=["all four", "three"])
def test_they_agree_on_what_links_leave_of_a_set(scene: SimpleNamespace, linked: tuple[str, ...], named: str) -> None:
    from blender_addon.check.checks import quick_check

    context = scene.bpy.context
    context.scene.mfo.reference_path, context.scene.mfo.parameter_set = scene.reference, named
    tree = scene.bpy.data.materials["Glaze"].node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    for socket in shader.inputs:
        if socket.name.lower().replace(" ", "_") in linked:
            tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], socket)
    stops = [f.sentence for f in quick_check(context.scene, context.view_layer) if f.level == "stops"]
    try:
        select_blender_parameters(named, linked=linked)
    except BadInputError:
        assert stops == ["No value is chosen that has no link: choose at least one, or All."]
    else:
        assert stops == []
    assert bool(stops) == (named == "reduced" and linked == REDUCED)
