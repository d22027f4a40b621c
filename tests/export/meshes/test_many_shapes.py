# SPDX-License-Identifier: Apache-2.0
"""Of many shapes those that differ in their faces alone are one in the scene file."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import bpy
import numpy as np
import pytest

from blender_addon.export.job import export_job
from blender_addon.export.scene import scene_file
from blender_addon.export.scene.scene_file import MANY_SHAPES

from ..scenes import add_camera, add_light, add_quad, emission_material, new_material

REFERENCE_SIDE = 8


def shapes_of(folder: Path) -> dict[str, int]:
    """The triangles of each shape of a scene file by its id."""
    found = {}
    for shape in ElementTree.parse(folder / "scene.xml").iter("shape"):
        name = next(each.get("value", "") for each in shape.findall("string") if each.get("name") == "filename")
        head = (folder / name).read_bytes().split(b"end_header")[0].decode("ascii")
        found[shape.get("id", "")] = int(head.split("element face ")[1].split()[0])
    return found


@pytest.fixture
def sprinkled(scene: Any, tmp_path: Path) -> tuple[Any, Any, Path]:
    """A target below as many quads as make them one, of which further ones are not like the others."""
    scene.render.resolution_x = scene.render.resolution_y = REFERENCE_SIDE
    add_camera(ortho_scale=4.0)
    add_light("SUN", energy=2.0)
    target = add_quad("Target", 4.0, 0.0, new_material("Glaze"))
    sugar = new_material("Sugar")
    for number in range(MANY_SHAPES):
        add_quad("Sprinkle", 0.2, 0.1, sugar).location = (number / MANY_SHAPES - 3.0, 1.0, 0.0)
    add_quad("Glowing", 0.3, 0.2, emission_material("Neon", (1.0, 0.5, 0.2))).location = (1.2, 0.0, 0.0)
    add_quad("Glowing", 0.3, 0.2, bpy.data.materials["Neon"]).location = (1.4, 1.0, 0.0)
    picture = tmp_path / "reference.exr"
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    image = bpy.data.images.new("Reference", REFERENCE_SIDE, REFERENCE_SIDE, float_buffer=True)
    image.pixels.foreach_set(np.full(4 * REFERENCE_SIDE**2, 0.5, np.float32))
    image.save_render(str(picture), scene=scene)
    return target, sugar, picture


def test_alike_shapes_are_one_and_what_glows_is_not(sprinkled: tuple[Any, Any, Path], tmp_path: Path) -> None:
    """15,852 sprinkles of a public donut kept a fit of 144 x 81 pixels from ending within four minutes."""
    target, _, picture = sprinkled
    export_job(bpy.context, target, tmp_path / "job", reference=picture, fit={})
    found = shapes_of(tmp_path / "job")
    assert sorted(found.values()) == [2, 2, 2, 2 * MANY_SHAPES]
    assert found["target"] == 2


def test_one_shape_for_many_is_the_same_picture(
    sprinkled: tuple[Any, Any, Path], tmp_path: Path, mitsuba: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ..scene.test_light_paths import picture_of

    target, _, picture = sprinkled
    pictures = []
    for many in (MANY_SHAPES, 10 * MANY_SHAPES):
        monkeypatch.setattr(scene_file, "MANY_SHAPES", many)
        report = export_job(bpy.context, target, tmp_path / str(many), reference=picture, fit={})
        pictures.append(picture_of(report, 1))
    assert (
        len(shapes_of(tmp_path / str(MANY_SHAPES)))
        < len(shapes_of(tmp_path / str(10 * MANY_SHAPES))) - MANY_SHAPES // 2
    )
    np.testing.assert_allclose(pictures[0], pictures[1], rtol=1e-4, atol=1e-6)


def test_shapes_that_rays_or_shadows_treat_otherwise_stay_apart(
    sprinkled: tuple[Any, Any, Path], tmp_path: Path
) -> None:
    target, sugar, picture = sprinkled
    add_quad("Unseen", 0.2, 0.1, sugar).visible_camera = False
    add_quad("Shadowless", 0.2, 0.1, sugar).visible_shadow = False
    walked = new_material("Wax", Subsurface_Weight=1.0)
    for number in range(2):
        add_quad("Wax", 0.2, 0.3 + number, walked).location = (1.0, -1.0, 0.0)
    export_job(bpy.context, target, tmp_path / "job", reference=picture, fit={})
    assert sorted(shapes_of(tmp_path / "job").values()) == [2] * 7 + [2 * MANY_SHAPES]


def test_few_shapes_stay_as_they_are(sprinkled: tuple[Any, Any, Path], tmp_path: Path) -> None:
    target, _, picture = sprinkled
    for item in [item for item in bpy.data.objects if item.name.startswith("Sprinkle")][3:]:
        bpy.data.objects.remove(item)
    export_job(bpy.context, target, tmp_path / "job", reference=picture, fit={})
    assert list(shapes_of(tmp_path / "job").values()) == [2] * 6
