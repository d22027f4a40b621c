# SPDX-License-Identifier: Apache-2.0
"""Values onto a node and back, without a fit: what is set, what is kept, and what is left alone."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

FLOAT32 = 1e-6
JOB = Path("job")


@pytest.fixture
def inputs(scene: SimpleNamespace):
    """The sockets of the material's Principled node."""
    from blender_addon.write_back import principled_node

    return principled_node(glaze(scene)).inputs


def glaze(scene: SimpleNamespace):
    return scene.bpy.data.materials["Glaze"]


def test_a_color_keeps_its_alpha(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.write_back import apply_values, revert_values

    inputs["Base Color"].default_value = (0.1, 0.2, 0.3, 0.25)
    assert apply_values(glaze(scene), {"Base Color": (0.5, 0.25, 0.125)}, JOB) == []
    assert tuple(inputs["Base Color"].default_value) == pytest.approx((0.5, 0.25, 0.125, 0.25), abs=FLOAT32)
    revert_values(glaze(scene))
    assert tuple(inputs["Base Color"].default_value) == pytest.approx((0.1, 0.2, 0.3, 0.25), abs=FLOAT32)


def test_a_second_result_keeps_the_originals_of_the_first(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.write_back import apply_values, revert_values, toggle_values

    material = glaze(scene)
    inputs["Roughness"].default_value = 0.5
    apply_values(material, {"Roughness": 0.25}, JOB)
    assert material.mfo.job_folder == str(JOB)
    assert toggle_values(material) == []
    assert (inputs["Roughness"].default_value, material.mfo.shows_original) == (0.5, True)
    apply_values(material, {"Roughness": 0.125}, JOB)  # from the original's side
    assert (inputs["Roughness"].default_value, material.mfo.shows_original) == (0.125, False)
    assert revert_values(material) == []
    assert inputs["Roughness"].default_value == 0.5
    assert (len(material.mfo.originals), len(material.mfo.applied), material.mfo.job_folder) == (0, 0, "")


def test_what_a_user_sets_after_apply_comes_back_with_the_toggle(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.write_back import apply_values, toggle_values

    inputs["Roughness"].default_value = 0.5
    apply_values(glaze(scene), {"Roughness": 0.25}, JOB)
    inputs["Roughness"].default_value = 0.75
    toggle_values(glaze(scene))
    assert inputs["Roughness"].default_value == 0.5
    toggle_values(glaze(scene))
    assert inputs["Roughness"].default_value == 0.75


def test_nothing_is_set_where_one_value_does_not_fit(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.write_back import WriteBackError, apply_values

    before = inputs["Roughness"].default_value
    with pytest.raises(WriteBackError, match="has 2 numbers for Base Color, which holds 4"):
        apply_values(glaze(scene), {"Roughness": 0.25, "Base Color": (0.5, 0.5)}, JOB)
    assert inputs["Roughness"].default_value == before
    assert len(glaze(scene).mfo.originals) == 0


def test_links_and_unknown_sockets_are_left_and_said(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.write_back import apply_values

    tree = glaze(scene).node_tree
    tree.links.new(tree.nodes.new("ShaderNodeValue").outputs[0], inputs["Roughness"])
    before = inputs["Roughness"].default_value
    notes = apply_values(glaze(scene), {"Roughness": 0.25, "Glitter": 1.0, "Metallic": 0.75}, JOB)
    assert notes == [
        "Roughness has a link and was left as it is.",
        "Glitter does not exist in this Blender version and was skipped.",
    ]
    assert (inputs["Roughness"].default_value, inputs["Metallic"].default_value) == (before, 0.75)


def test_what_cannot_be_restored_is_said(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.write_back import apply_values, keep_value, revert_values

    kept = glaze(scene).mfo
    apply_values(glaze(scene), {"Metallic": 0.75}, JOB)
    keep_value(kept.originals, "Roughness", (0.5, 0.5))
    keep_value(kept.originals, "Glitter", 1.0)
    assert revert_values(glaze(scene)) == [
        "Roughness was kept as 2 numbers and could not be set.",
        "Glitter does not exist any more and was skipped.",
    ]
    assert inputs["Metallic"].default_value == 0.0


def test_another_working_space_gets_the_same_color(
    scene: SimpleNamespace, inputs, monkeypatch: pytest.MonkeyPatch
) -> None:
    import numpy as np

    from blender_addon import write_back

    to_rec709 = np.array([[1.6, -0.5, -0.1], [-0.1, 1.2, -0.1], [0.0, -0.1, 1.1]])
    monkeypatch.setattr(write_back, "working_space_to_rec709", lambda: to_rec709)
    write_back.apply_values(glaze(scene), {"Base Color": (0.5, 0.25, 0.125)}, JOB)
    found = to_rec709 @ np.array(inputs["Base Color"].default_value[:3])
    np.testing.assert_allclose(found, (0.5, 0.25, 0.125), atol=FLOAT32)
