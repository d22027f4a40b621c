# SPDX-License-Identifier: Apache-2.0
"""The reference against the camera's view: seen through, split, subtracted, and under the scene's view transform."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mfo_backend.scene.image_file import write_exr

from .test_view_paint import in_light


def painted(scene: SimpleNamespace) -> NDArray[np.float64]:
    """Display values and alpha of what lies over the view, first row at the top (shown by a gamma of 2.2)."""
    image = scene.bpy.context.scene.camera.data.background_images[0].image
    numbers = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(numbers)
    pixels = numbers.astype(np.float64).reshape(image.size[1], image.size[0], 4)[::-1]
    pixels[..., :3] = in_light(pixels[..., :3]) ** (1.0 / 2.2)
    return pixels


@pytest.fixture
def shown(scene: SimpleNamespace) -> SimpleNamespace:
    settings = scene.bpy.context.scene.mfo
    settings.reference_path = scene.reference
    assert scene.bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    return scene


def test_it_is_split_where_the_line_is(shown: SimpleNamespace) -> None:
    over = shown.bpy.context.scene.mfo.overlay
    whole = painted(shown)
    with Image.open(shown.reference) as reference:
        assert whole[..., :3] == pytest.approx(np.asarray(reference.convert("RGB")) / 255.0, abs=0.003)
    assert (whole[..., 3] == 1.0).all()
    over.mode = "SPLIT"
    assert painted(shown)[0, :, 3].sum() == 49.0  # half of 96 columns and the line
    over.line = 0.25
    parted = painted(shown)
    assert parted[:, :24] == pytest.approx(whole[:, :24])
    assert (parted[:, 24] == 1.0).all()
    assert not parted[:, 25:, 3].any()


def test_opacity_is_for_a_blend_alone(shown: SimpleNamespace) -> None:
    over, camera = shown.bpy.context.scene.mfo.overlay, shown.bpy.context.scene.camera.data
    over.opacity = 0.25
    over.mode = "DIFFERENCE"
    assert camera.background_images[0].alpha == 1.0
    over.mode = "BLEND"
    assert camera.background_images[0].alpha == 0.25
    assert (painted(shown)[..., 3] == 1.0).all()


def test_the_line_moves_in_a_file_that_was_opened_again(shown: SimpleNamespace, tmp_path: Path) -> None:
    bpy = shown.bpy
    bpy.context.scene.mfo.overlay.mode = "SPLIT"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "again.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "again.blend"))
    assert painted(shown)[0, :, 3].sum() == 49.0
    bpy.context.scene.mfo.overlay.line = 0.25
    assert painted(shown)[0, :, 3].sum() == 25.0
    assert bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    assert not bpy.context.scene.camera.data.background_images


def test_a_reference_that_went_away_is_said_by_the_button(shown: SimpleNamespace) -> None:
    bpy = shown.bpy
    over = bpy.context.scene.mfo.overlay
    bpy.ops.mfo.overlay_reference()
    bpy.context.scene.mfo.reference_path += ".gone.png"
    over.mode = "SPLIT"
    with pytest.raises(RuntimeError, match="cannot be shown"):
        bpy.ops.mfo.overlay_reference()


def test_an_exr_of_layers_is_seen_through_but_not_split(scene: SimpleNamespace, tmp_path: Path) -> None:
    bpy = scene.bpy
    render = bpy.context.scene.render
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    render.filepath, render.engine = str(tmp_path / "layers.exr"), "CYCLES"
    bpy.context.scene.cycles.samples = 1
    bpy.ops.render.render(write_still=True)
    settings, camera = bpy.context.scene.mfo, bpy.context.scene.camera.data
    settings.reference_path = render.filepath
    assert bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    assert camera.background_images[0].image.filepath == render.filepath
    settings.overlay.mode = "SPLIT"
    assert not camera.background_images
    with pytest.raises(RuntimeError, match="several layers"):
        bpy.ops.mfo.overlay_reference()


def test_a_large_picture_has_no_more_pixels_than_a_view(scene: SimpleNamespace, tmp_path: Path) -> None:
    bpy = scene.bpy
    Image.new("RGB", (2304, 1536), (30, 60, 90)).save(tmp_path / "large.png")
    bpy.context.scene.mfo.reference_path = str(tmp_path / "large.png")
    bpy.ops.mfo.overlay_reference()
    seen = painted(scene)
    assert seen.shape == (1365, 2048, 4)
    # NumPy's comparison: that of pytest takes eight million numbers one by one, for most of a minute
    np.testing.assert_allclose(
        seen[..., :3], np.broadcast_to(np.array([30, 60, 90]) / 255, (1365, 2048, 3)), atol=0.003
    )


def test_a_line_is_dragged_without_new_paint(shown: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.pictures import overlay, view_paint

    made = []
    for name in ("whole", "difference"):
        way = getattr(view_paint, name)
        monkeypatch.setattr(view_paint, name, lambda picture, n=name, way=way: made.append(n) or way(picture))
    over = shown.bpy.context.scene.mfo.overlay
    overlay.show(shown.bpy.context.scene)
    over.mode = "SPLIT"
    for over.line in (0.2, 0.4, 0.6):
        overlay.repaint(shown.bpy.context.scene)  # as an undo does
    assert made == ["whole"]
    for over.mode in ("DIFFERENCE", "BLEND"):
        overlay.repaint(shown.bpy.context.scene)
    assert made == ["whole", "difference", "whole"]
    overlay.hide(shown.bpy.context.scene.camera)
    assert overlay._shown is None


def test_each_scene_has_its_own(shown: SimpleNamespace, tmp_path: Path) -> None:
    bpy = shown.bpy
    first = bpy.context.scene
    second = first.copy()
    second.camera = first.camera.copy()
    second.camera.data = first.camera.data.copy()
    second.camera.data.background_images.clear()
    Image.new("RGB", (96, 64), (10, 200, 10)).save(tmp_path / "green.png")
    second.mfo.reference_path = str(tmp_path / "green.png")
    with bpy.context.temp_override(scene=second, view_layer=second.view_layers[0]):
        assert bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    before = painted(shown)
    first.mfo.overlay.mode = "SPLIT"
    assert painted(shown)[:, :48] == pytest.approx(before[:, :48])


def test_a_picture_of_another_size_fills_the_render_region(scene: SimpleNamespace, tmp_path: Path) -> None:
    render = scene.bpy.context.scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.0, 0.5
    Image.new("RGB", (30, 20), (10, 200, 10)).save(tmp_path / "small.png")
    scene.bpy.context.scene.mfo.reference_path = str(tmp_path / "small.png")
    assert scene.bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    rows, columns = np.nonzero(painted(scene)[..., 3])
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (32, 63, 24, 71)


RAMP = np.linspace(0.0, 3.0, 96, dtype=np.float32)[None, :, None] * np.array([1.0, 0.6, 0.3], np.float32)


def blenders_own(bpy: Any, path: Path, picture: Path) -> NDArray[np.float64]:
    """What Blender writes for an EXR under the scene's view."""
    image = bpy.data.images.load(str(path))
    settings = bpy.context.scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "8"
    image.save_render(str(picture), scene=bpy.context.scene)
    bpy.data.images.remove(image)
    with Image.open(picture) as written:
        return np.asarray(written) / 255.0


def test_scene_linear_values_are_seen_under_the_scenes_view(scene: SimpleNamespace, tmp_path: Path) -> None:
    bpy = scene.bpy
    view = bpy.context.scene.view_settings
    view.view_transform, view.exposure = "AgX", 0.7
    write_exr(tmp_path / "ramp.exr", np.broadcast_to(RAMP, (64, 96, 3)).copy())
    bpy.context.scene.mfo.reference_path = str(tmp_path / "ramp.exr")
    bpy.ops.mfo.overlay_reference()
    assert painted(scene)[..., :3] == pytest.approx(
        blenders_own(bpy, tmp_path / "ramp.exr", tmp_path / "ramp.png"), abs=0.006
    )


def test_a_photograph_is_seen_as_its_light_under_the_scenes_view(scene: SimpleNamespace, tmp_path: Path) -> None:
    """Of the same light a render under Standard, with the scene's exposure, and one under AgX look alike."""
    bpy = scene.bpy
    view, settings = bpy.context.scene.view_settings, bpy.context.scene.mfo
    write_exr(tmp_path / "dim.exr", np.broadcast_to(RAMP / 8.0, (64, 96, 3)).copy())
    view.view_transform, view.exposure, view.gamma = "Standard", 0.7, 1.2
    blenders_own(bpy, tmp_path / "dim.exr", tmp_path / "photo.png")
    view.view_transform = "AgX"
    expected = blenders_own(bpy, tmp_path / "dim.exr", tmp_path / "agx.png")
    settings.reference_path = str(tmp_path / "photo.png")
    bpy.ops.mfo.overlay_reference()
    as_it_is = painted(scene)[..., :3]
    settings.reference_view = "standard"
    assert painted(scene)[..., :3] == pytest.approx(expected, abs=0.02)  # of 8 bits, which AgX lifts in the shadows
    assert np.abs(as_it_is - expected).max() > 0.07
