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
    from blender_addon.result.write_back import fitted_shader

    return fitted_shader(glaze(scene)).node.inputs


def glaze(scene: SimpleNamespace):
    return scene.bpy.data.materials["Glaze"]


def test_a_color_keeps_its_alpha(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.result.write_back import apply_values, revert_values

    inputs["Base Color"].default_value = (0.1, 0.2, 0.3, 0.25)
    assert apply_values(glaze(scene), {"Base Color": (0.5, 0.25, 0.125)}, JOB) == []
    assert tuple(inputs["Base Color"].default_value) == pytest.approx((0.5, 0.25, 0.125, 0.25), abs=FLOAT32)
    revert_values(glaze(scene))
    assert tuple(inputs["Base Color"].default_value) == pytest.approx((0.1, 0.2, 0.3, 0.25), abs=FLOAT32)


def test_a_second_result_keeps_the_originals_of_the_first(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.result.write_back import apply_values, revert_values, toggle_values

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
    from blender_addon.result.write_back import apply_values, toggle_values

    inputs["Roughness"].default_value = 0.5
    apply_values(glaze(scene), {"Roughness": 0.25}, JOB)
    inputs["Roughness"].default_value = 0.75
    toggle_values(glaze(scene))
    assert inputs["Roughness"].default_value == 0.5
    toggle_values(glaze(scene))
    assert inputs["Roughness"].default_value == 0.75


def test_nothing_is_set_where_one_value_does_not_fit(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.result.write_back import WriteBackError, apply_values

    before = inputs["Roughness"].default_value
    with pytest.raises(WriteBackError, match="has 2 numbers for Base Color, which holds 4"):
        apply_values(glaze(scene), {"Roughness": 0.25, "Base Color": (0.5, 0.5)}, JOB)
    assert inputs["Roughness"].default_value == before
    assert len(glaze(scene).mfo.originals) == 0


def test_links_and_unknown_sockets_are_left_and_said(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.result.write_back import apply_values

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
    from blender_addon.result.write_back import apply_values, keep_value, revert_values

    kept = glaze(scene).mfo
    apply_values(glaze(scene), {"Metallic": 0.75}, JOB)
    keep_value(kept.originals, "Roughness", (0.5, 0.5))
    keep_value(kept.originals, "Glitter", 1.0)
    assert revert_values(glaze(scene)) == [
        "Roughness was kept as 2 numbers and could not be set.",
        "Glitter does not exist any more and was skipped.",
    ]
    assert inputs["Metallic"].default_value == 0.0


@pytest.mark.parametrize("given", [(0.5, 0.25, 0.125), (0.5, 0.25, 0.125, 1.0)])
def test_another_working_space_gets_the_same_color(
    scene: SimpleNamespace, inputs, monkeypatch: pytest.MonkeyPatch, given: tuple[float, ...]
) -> None:
    import numpy as np

    from blender_addon.export.images import color_space
    from blender_addon.result.write_back import apply_values

    to_rec709 = np.array([[1.6, -0.5, -0.1], [-0.1, 1.2, -0.1], [0.0, -0.1, 1.1]])
    monkeypatch.setattr(color_space, "working_space_to_rec709", lambda: to_rec709)
    apply_values(glaze(scene), {"Base Color": given}, JOB)
    found = to_rec709 @ np.array(inputs["Base Color"].default_value[:3])
    np.testing.assert_allclose(found, (0.5, 0.25, 0.125), atol=FLOAT32)


@pytest.mark.parametrize("what", ["keyframes", "a driver"])
def test_an_animated_socket_is_left_or_replaced_for_good(scene: SimpleNamespace, inputs, what: str) -> None:
    """The value after a change of the frame is what Blender renders."""
    from blender_addon.result.write_back import apply_values

    current, socket = scene.bpy.context.scene, inputs["Roughness"]
    if what == "keyframes":
        socket.default_value = 0.75
        socket.keyframe_insert("default_value", frame=1)
        socket.default_value = 0.25
        socket.keyframe_insert("default_value", frame=11)
    else:
        socket.driver_add("default_value").driver.type = "SUM"  # of nothing, which is 0
    current.frame_set(1)
    before = socket.default_value
    (note,) = apply_values(glaze(scene), {"Roughness": 0.5, "Metallic": 1.0}, JOB)
    assert note.startswith(f"Roughness has {what} and was left as it is")
    assert (socket.default_value, inputs["Metallic"].default_value) == (before, 1.0)
    assert "Roughness" not in glaze(scene).mfo.originals
    (note,) = apply_values(glaze(scene), {"Roughness": 0.5}, JOB, animated="replace")
    assert ("got a key" if what == "keyframes" else "The driver of Roughness was removed") in note
    current.frame_set(11)
    current.frame_set(1)
    assert socket.default_value == 0.5
    if what == "keyframes":
        current.frame_set(11)
        assert socket.default_value == 0.25


def test_keys_of_a_strip_are_found(scene: SimpleNamespace, inputs) -> None:
    from blender_addon.result.animated_sockets import animation_of

    inputs["Roughness"].keyframe_insert("default_value")
    data = glaze(scene).node_tree.animation_data
    action, slot = data.action, getattr(data, "action_slot", None)
    data.action = None
    assert animation_of(dict(inputs.items())) == {}
    strip = data.nla_tracks.new().strips.new("Strip", 1, action)
    if slot is not None:
        strip.action_slot = slot
    assert animation_of(dict(inputs.items())) == {"Roughness": "keyframes"}
