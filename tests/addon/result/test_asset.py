# SPDX-License-Identifier: Apache-2.0
"""A material with recovered values on the shelf, and the values of another as a start."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.scene.image_file import write_png

HEIGHT, WIDTH = 40, 60


@pytest.fixture
def applied(scene: SimpleNamespace):
    """The material with the values of a fit, whose pictures show a red disc on the right."""
    bpy = scene.bpy
    assert bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job) == {"FINISHED"}
    assert bpy.ops.mfo.apply() == {"FINISHED"}
    rows, columns = np.indices((HEIGHT, WIDTH))
    disc = (rows - 20) ** 2 + (columns - 45) ** 2 < 10**2
    picture = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    picture[disc] = (1.0, 0.2, 0.0)
    pictures = Path(scene.job) / "pictures"
    pictures.mkdir(exist_ok=True)
    write_png(pictures / "result.png", picture)
    write_png(pictures / "counted.png", disc.astype(np.float32))
    return bpy.data.materials["Glaze"]


def test_asset_has_verdict_reference_and_the_picture_of_its_fit(scene: SimpleNamespace, applied) -> None:
    assert scene.bpy.ops.mfo.save_as_asset() == {"FINISHED"}
    data = applied.asset_data
    assert "Material Fit" in [tag.name for tag in data.tags]
    assert "Reference: reference.png." in data.description
    assert "Fit: 20" in data.description
    preview = applied.preview
    pixels = np.array(preview.image_pixels_float[:]).reshape(*tuple(preview.image_size)[::-1], 4)
    assert tuple(preview.image_size) == (256, 256)
    assert pixels[128, 128] == pytest.approx((1.0, 0.2, 0.0, 1.0), abs=0.01)
    covered = (pixels[:, :, 0] > 0.5).mean()
    assert covered == pytest.approx(np.pi / 4 / 1.16**2, abs=0.08)  # a disc in its square with the margin
    assert scene.bpy.ops.mfo.save_as_asset() == {"FINISHED"}  # again, without a second tag
    assert [tag.name for tag in data.tags].count("Material Fit") == 1


def test_a_material_that_shows_its_own_values_is_no_result(scene: SimpleNamespace, applied) -> None:
    scene.bpy.ops.mfo.toggle()
    with pytest.raises(RuntimeError, match="does not show recovered values"):
        scene.bpy.ops.mfo.save_as_asset()
    assert applied.asset_data is None


def test_without_pictures_and_without_a_screen_there_is_no_preview(scene: SimpleNamespace, applied) -> None:
    from blender_addon.result.asset import save_as_asset

    (Path(scene.job) / "pictures" / "counted.png").unlink()
    assert save_as_asset(applied) == "nothing"
    assert applied.asset_data is not None


def test_values_of_another_material_are_taken_without_its_links(scene: SimpleNamespace) -> None:
    from blender_addon.result.start_values import take_values
    from blender_addon.result.write_back import fitted_shader

    material = scene.bpy.data.materials["Glaze"]
    other = material.copy()
    mine, its = (fitted_shader(m).node.inputs for m in (material, other))
    its["Roughness"].default_value, its["Metallic"].default_value = 0.125, 0.75
    its["Base Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    other.node_tree.links.new(other.node_tree.nodes.new("ShaderNodeValue").outputs[0], its["Metallic"])
    metallic = mine["Metallic"].default_value
    assert sorted(take_values(material, other)) == ["Base Color", "Roughness"]
    assert mine["Roughness"].default_value == 0.125
    assert tuple(mine["Base Color"].default_value) == pytest.approx((0.1, 0.2, 0.3, 1.0))
    assert mine["Metallic"].default_value == metallic
