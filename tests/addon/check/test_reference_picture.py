# SPDX-License-Identifier: Apache-2.0
"""The reference over the camera's view, dropped onto the panel, behind the camera, and scaled to the frame."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from mfo_backend.scene.image_file import read_image, write_exr


def test_a_scaled_picture_is_the_mean_of_what_it_covers() -> None:
    """Oracle: Pillow's box filter, which is exact where pixels cover whole ones."""
    from blender_addon.check.picture_copy import covering

    pixels = np.random.default_rng(3).random((24, 48, 3), dtype=np.float32)
    channels = [
        Image.fromarray(pixels[:, :, c]).resize((8, 8), Image.Resampling.BOX, (12, 0, 36, 24)) for c in range(3)
    ]
    assert covering(pixels, (8, 8)) == pytest.approx(np.dstack([np.asarray(channel) for channel in channels]), abs=1e-6)
    assert covering(np.full_like(pixels, 0.25), (19, 7)) == pytest.approx(0.25, abs=1e-6)


def test_a_ramp_stays_a_ramp_at_any_scale() -> None:
    from blender_addon.check.picture_copy import covering

    ramp = np.broadcast_to(np.arange(40, dtype=np.float32)[None, :, None], (20, 40, 1))
    half = covering(ramp, (20, 10))
    assert half[3, :, 0] == pytest.approx(np.arange(20) * 2 + 0.5)
    odd = covering(ramp, (30, 15))
    assert odd[3, :, 0].mean() == pytest.approx(19.5)
    wide = covering(ramp, (80, 40))  # centres of new pixels lie a quarter beside the old ones
    assert wide[3, 2:-2, 0] == pytest.approx(np.arange(80)[2:-2] / 2 - 0.25)
    cut = covering(ramp, (20, 20))  # as high, half as wide: the middle of it
    assert cut[3, :, 0] == pytest.approx(np.arange(10, 30))


def test_a_linear_picture_keeps_its_numbers(scene: SimpleNamespace, tmp_path: Path) -> None:
    settings = scene.bpy.context.scene.mfo
    write_exr(tmp_path / "big.exr", np.full((128, 192, 3), (4.0, 0.5, 0.25), np.float32))
    settings.reference_path = str(tmp_path / "big.exr")
    assert scene.bpy.ops.mfo.mend(kind="scale", argument="96x64") == {"FINISHED"}
    copy = Path(settings.reference_path)
    assert copy.name == "big 96x64.exr"
    pixels = read_image(copy, (96, 64)).pixels
    assert pixels.reshape(-1, 3).mean(axis=0) == pytest.approx((4.0, 0.5, 0.25), rel=1e-5)


def test_a_display_picture_is_averaged_in_light(scene: SimpleNamespace, tmp_path: Path) -> None:
    """Black and white lines give the grey of half the light: 188 in sRGB, not 128."""
    lines = np.zeros((128, 192, 3), np.uint8)
    lines[::2] = 255
    Image.fromarray(lines).save(tmp_path / "lines.png")
    settings = scene.bpy.context.scene.mfo
    settings.reference_path = str(tmp_path / "lines.png")
    scene.bpy.ops.mfo.mend(kind="scale", argument="96x64")
    with Image.open(settings.reference_path) as copy:
        assert np.asarray(copy).reshape(-1, 3).tolist() == [[188, 188, 188]] * (96 * 64)


def test_an_image_of_the_file_is_scaled_too(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    settings = bpy.context.scene.mfo
    settings.reference_source, settings.reference_image = "IMAGE", bpy.data.images.load(scene.reference)
    bpy.ops.mfo.mend(kind="scale", argument="48x32")
    assert settings.reference_source == "FILE"
    with Image.open(settings.reference_path) as copy, Image.open(scene.reference) as old:
        assert copy.size == (48, 32)
        assert copy.getpixel((24, 16)) == old.getpixel((48, 32))  # inside the disc, of one colour


def test_it_lies_over_the_view_and_leaves_nothing(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    settings, camera = bpy.context.scene.mfo, bpy.context.scene.camera.data
    settings.reference_path = ""
    assert not bpy.ops.mfo.overlay_reference.poll()
    settings.reference_path = scene.reference
    mine = camera.background_images.new()
    before = set(bpy.data.images)
    assert bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    shown = camera.background_images[1]
    assert (shown.image.size[:], shown.display_depth, shown.alpha) == ((96, 64), "FRONT", 0.5)
    settings.overlay.opacity = 0.25
    assert shown.alpha == 0.25
    assert bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    assert list(camera.background_images) == [mine]
    assert set(bpy.data.images) == before


def test_a_dropped_picture_is_the_reference_and_seen_at_once(scene: SimpleNamespace, tmp_path: Path) -> None:
    from blender_addon.operators.reference import MFO_FH_reference

    bpy = scene.bpy
    settings = bpy.context.scene.mfo
    settings.reference_path = scene.reference
    bpy.ops.mfo.overlay_reference()
    Image.new("RGB", (10, 20)).save(tmp_path / "other.png")
    assert bpy.ops.mfo.use_reference(filepath=str(tmp_path / "other.png")) == {"FINISHED"}
    assert settings.reference_path == str(tmp_path / "other.png")
    assert bpy.context.scene.camera.data.background_images[0].image.size[:] == (10, 20)
    assert ".webp" in MFO_FH_reference.bl_file_extensions.split(";")
    tab = SimpleNamespace(active_panel_category="Item")
    taken = {
        (area, region): MFO_FH_reference.poll_drop(
            SimpleNamespace(area=SimpleNamespace(type=area, regions=[tab]), region=SimpleNamespace(type=region))
        )
        for area, region in (("VIEW_3D", "UI"), ("VIEW_3D", "WINDOW"), ("PROPERTIES", "WINDOW"))
    }
    assert list(taken.values()) == [True, False, True]


def test_what_lies_behind_the_camera_is_offered(scene: SimpleNamespace) -> None:
    from blender_addon.check.checks import quick_check

    bpy = scene.bpy
    settings = bpy.context.scene.mfo
    settings.reference_path = ""
    image = bpy.data.images.load(scene.reference)
    bpy.context.scene.camera.data.background_images.new().image = image
    first = quick_check(bpy.context.scene, bpy.context.view_layer)[0]
    assert [(fix.kind, fix.argument) for fix in first.fixes] == [("background", image.name)]
    bpy.ops.mfo.mend(kind="background", argument=image.name)
    assert settings.reference_image == image
    assert all(f.level != "stops" for f in quick_check(bpy.context.scene, bpy.context.view_layer))
