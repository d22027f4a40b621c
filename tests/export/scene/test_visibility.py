# SPDX-License-Identifier: Apache-2.0
"""Whether the camera sees the target: said where it does not, and silent where a part of it lies in the frame."""

from __future__ import annotations

from typing import Any

import pytest

from blender_addon.export.findings import ExportError
from tests.export.scenes import add_camera, add_light, add_mesh, add_quad, new_material

UNSEEN = "The camera does not see 'Target': move it into the frame."


@pytest.fixture
def lit(scene: Any) -> Any:
    """A camera five metres above the origin that sees a square of two metres, and a light."""
    add_light("POINT", energy=100.0)
    return add_camera(ortho_scale=2.0)


@pytest.mark.parametrize("limits", [{"clip_end": 4.0}, {"clip_start": 6.0}], ids=["too far", "too near"])
def test_what_the_camera_clips_is_not_seen(limits: dict[str, float], lit: Any, export: Any) -> None:
    for name, value in limits.items():
        setattr(lit.data, name, value)
    with pytest.raises(ExportError) as caught:
        export(add_quad("Target", 1.0, 0.0, new_material("Paint")))
    assert str(caught.value) == UNSEEN


def test_a_face_much_larger_than_the_frame_is_seen(lit: Any, export: Any) -> None:
    """None of the points that are tried lies in the frame, and corners lie on all of its sides."""
    corners = [(-9000.0, -8000.0, 0.0), (9000.0, -8000.0, 0.0), (0.0, 7000.0, 0.0)]
    export(add_mesh("Target", corners, [(0, 1, 2)], new_material("Paint")))


@pytest.mark.parametrize(("across", "is_seen"), [(0.99, True), (1.01, False)])
def test_the_frame_ends_where_the_picture_ends(across: float, is_seen: bool, lit: Any, export: Any) -> None:
    target = add_quad("Target", 0.5, 0.0, new_material("Paint"))
    target.location.x = across + 0.25
    if is_seen:
        export(target)
    else:
        with pytest.raises(ExportError) as caught:
            export(target)
        assert str(caught.value) == UNSEEN


@pytest.mark.parametrize("faces", [1, 60])
def test_a_gap_in_what_hides_it_is_found(faces: int, lit: Any, export: Any) -> None:
    """The lid leaves a thirtieth of the target free, which few large faces have no middle in."""
    step = 1.0 / faces
    corners = [(x, y, 0.0) for y in (-0.5, 0.5) for x in (-0.5 + step * i for i in range(faces + 1))]
    squares = [(i, i + 1, faces + 2 + i, faces + 1 + i) for i in range(faces)]
    target = add_mesh("Target", corners, squares, new_material("Paint"))
    lid = add_quad("Lid", 1.0, 1.0, new_material("Lid"))
    lid.location.x = 1.0 / 30
    export(target)
    lid.location.x = 0.0
    lid.scale = (1.01, 1.01, 1.0)
    with pytest.raises(ExportError, match="hidden behind 'Lid'"):
        export(target)


@pytest.mark.parametrize("kind", ["ORTHO", "PERSP"])
@pytest.mark.parametrize(("clip_start", "is_seen"), [(0.9, False), (1.1, True)])
def test_what_the_camera_clips_hides_nothing(kind: str, clip_start: float, is_seen: bool, lit: Any, export) -> None:
    """A lid a metre before the camera, which looks past the target's middle."""
    lit.data.type, lit.data.clip_start, lit.location.x = kind, clip_start, 0.3
    target = add_quad("Target", 1.0, 0.0, new_material("Paint"))
    add_quad("Lid", 3.0, 4.0, new_material("Lid"))
    if is_seen:
        export(target)
    else:
        with pytest.raises(ExportError, match="hidden behind 'Lid'"):
            export(target)


def test_an_object_may_hide_its_own_slot(lit: Any, export: Any) -> None:
    """A small square of another material below a large one of the same object."""
    corners = [(x * s, y * s, z) for s, z in ((0.2, 0.0), (0.5, 1.0)) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    target = add_mesh("Target", corners, [(0, 1, 2, 3), (4, 5, 6, 7)], new_material("Paint"))
    target.data.materials.append(new_material("Lid"))
    target.data.polygons[1].material_index = 1
    with pytest.raises(ExportError, match="it is hidden behind 'Target'"):
        export(target)
    target.active_material_index = 1
    export(target)


@pytest.mark.parametrize(
    ("sockets", "bends"),
    [
        ({"Transmission_Weight": 1.0}, True),
        ({"Transmission_Weight": 1.0, "Alpha": 0.5}, False),
        ({"Alpha": 0.5}, False),
    ],
    ids=["glass", "half clear glass", "half clear"],
)
def test_values_inside_nodes_stay_where_glass_covers_the_target(
    sockets: dict[str, float], bends: bool, lit: Any, export: Any
) -> None:
    """Whole light paths fit the values of sockets alone."""
    material = new_material("Paint", Subsurface_Weight=0.5)
    tree = material.node_tree
    hue = tree.nodes.new("ShaderNodeHueSaturation")
    tree.links.new(hue.outputs[0], tree.get_output_node("CYCLES").inputs[0].links[0].from_node.inputs["Base Color"])
    target = add_quad("Target", 1.0, 0.0, material)
    glass = add_quad("Glass", 1.5, 1.0, new_material("Glass", **sockets))
    reason = "the camera sees it through 'Glass' alone"
    said = [note for note in export(target, name="covered").notes if "'Glass'" in note]
    assert any(note.endswith(f"stay as they are: {reason}.") for note in said) == bends
    assert any("Subsurface is fitted as diffuse" in note for note in said) == bends
    named = {"parameters": ["Hue Saturation Value/Value"]}
    if bends:
        with pytest.raises(ExportError, match=f"cannot be fitted: {reason}"):
            export(target, name="named", fit=named)
    glass.location.x = 1.0
    report = export(target, name="beside", fit=named)  # a part of it lies beside the glass
    assert report.request["graph"]["values"]
