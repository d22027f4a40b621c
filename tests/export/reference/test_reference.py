# SPDX-License-Identifier: Apache-2.0
"""The reference picture: files are copied, images are written, and display colours only under an invertible view."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.files.exr_file import write_exr
from blender_addon.export.files.png_file import write_png
from blender_addon.export.job import ExportError

from ..scenes import add_camera, add_mesh, add_quad, emission_material, new_material, world_color


@pytest.fixture
def target(scene: Any) -> Any:
    scene.render.resolution_x, scene.render.resolution_y = 6, 4
    scene.view_settings.view_transform = "Standard"
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=2.0)
    return add_quad("Target", 1.0, 0.0, new_material("Target"))


def picture(width: int = 6, height: int = 4) -> np.ndarray:
    return np.random.default_rng(6).random((height, width, 3)).astype(np.float32)


def read(path: Path) -> np.ndarray:
    OpenEXR = pytest.importorskip("OpenEXR")
    return next(iter(OpenEXR.File(str(path)).channels().values())).pixels


def test_exr_file_is_copied(target: Any, export: Any, tmp_path: Path) -> None:
    write_exr(tmp_path / "ref.EXR", picture())
    bpy.context.scene.view_settings.view_transform = "AgX"  # does not touch linear files
    report = export(target, reference=tmp_path / "ref.EXR")
    assert report.request["reference"] == {"path": "reference.exr", "encoding": "linear"}
    assert (report.folder / "reference.exr").read_bytes() == (tmp_path / "ref.EXR").read_bytes()


def test_png_file_and_view(target: Any, export: Any, tmp_path: Path) -> None:
    write_png(tmp_path / "ref.png", np.zeros((4, 6, 3), np.uint8))
    view = bpy.context.scene.view_settings
    view.exposure, view.gamma = 1.5, 0.75
    report = export(target, reference=tmp_path / "ref.png")
    assert report.request["reference"] == {"path": "reference.png", "encoding": "srgb"}
    assert report.request["view"] == {"exposure_ev": 1.5, "gamma": 0.75}


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("view_transform", "AgX", "the view transform AgX"),
        ("look", "Medium High Contrast", "the look Medium High Contrast"),
        ("use_curve_mapping", True, "view curves"),
    ],
)
def test_display_file_under_another_view(
    name: str, value: Any, reason: str, target: Any, export: Any, tmp_path: Path
) -> None:
    """Rendered in this scene unless the user says it is a photograph; either is said."""
    write_png(tmp_path / "ref.png", np.zeros((4, 6, 3), np.uint8))
    setattr(bpy.context.scene.view_settings, name, value)
    report = export(target, reference=tmp_path / "ref.png")
    assert report.request["view"]["lut"]["path"] == "view_lut.exr"
    assert any("ref.png is taken as rendered in this scene: " in n and f"({reason})" in n for n in report.notes)
    report = export(target, reference=tmp_path / "ref.png", reference_view="standard")
    assert report.request["view"] == {"exposure_ev": 0.0, "gamma": 1.0}
    assert not (report.folder / "view_lut.exr").exists()
    assert any(f"ref.png is taken as a photograph or a render under Standard: {reason}" in n for n in report.notes)


def test_the_scenes_view_goes_into_the_job(target: Any, export: Any, tmp_path: Path) -> None:
    write_png(tmp_path / "ref.png", np.zeros((4, 6, 3), np.uint8))
    view = bpy.context.scene.view_settings
    view.view_transform, view.exposure = "AgX", 1.5
    report = export(target, reference=tmp_path / "ref.png")
    assert report.request["reference"] == {"path": "reference.png", "encoding": "srgb"}
    lut = {"path": "view_lut.exr", "size": 48, "log2_min": -14.25, "log2_max": 3.0}
    assert report.request["view"] == {"exposure_ev": 1.5, "gamma": 1.0, "lut": lut}
    table = read(report.folder / "view_lut.exr")
    assert table.shape == (48, 48 * 48, 3)
    np.testing.assert_allclose(table[0, 0], 0, atol=1e-4)  # AgX is black there to a few of 65535 levels
    np.testing.assert_allclose(table[-1, -1], 1, atol=1e-4)
    assert np.argmax(table[0, 47]) == 0  # red is fastest
    assert np.argmax(table[47, 0]) == 2
    again = export(target, reference=tmp_path / "ref.png")  # over the first
    assert (again.folder / "view_lut.exr").is_file()


def test_an_output_with_a_view_of_its_own(target: Any, export: Any, tmp_path: Path) -> None:
    """The picture that Blender writes itself tells which view counts."""
    scene = bpy.context.scene
    output = scene.render.image_settings
    output.file_format, output.color_management = "PNG", "OVERRIDE"
    output.view_settings.view_transform, output.view_settings.exposure = "Filmic", -1.0
    image = bpy.data.images.new("Grey", 6, 4, float_buffer=True)
    image.pixels.foreach_set(np.tile(np.array([0.18, 0.18, 0.18, 1.0], np.float32), 6 * 4))
    image.save_render(str(tmp_path / "ref.png"), scene=scene)
    shown = bpy.data.images.load(str(tmp_path / "ref.png"))
    shown.colorspace_settings.name = "Non-Color"
    report = export(target, reference=tmp_path / "ref.png")
    assert report.request["view"]["exposure_ev"] == -1.0
    lut = report.request["view"]["lut"]
    axis = lut["log2_min"] + np.arange(47) * (lut["log2_max"] - lut["log2_min"]) / 46
    grey = np.einsum("iiic->ic", read(report.folder / "view_lut.exr").reshape(48, 48, 48, 3))[1:, 0]
    assert np.interp(np.log2(0.18), axis, grey) == pytest.approx(shown.pixels[0], abs=2 / 255)
    output.file_format = "OPEN_EXR"  # of which a view is no part
    assert export(target, reference=tmp_path / "ref.png").request["view"] == {"exposure_ev": 0.0, "gamma": 1.0}


def test_another_display_is_refused_unless_it_is_a_photograph(target: Any, export: Any, tmp_path: Path) -> None:
    write_png(tmp_path / "ref.png", np.zeros((4, 6, 3), np.uint8))
    bpy.context.scene.display_settings.display_device = "Display P3"
    with pytest.raises(
        ExportError, match=r"ref\.png holds display colours and the scene is shown on the display device"
    ):
        export(target, reference=tmp_path / "ref.png")
    assert "lut" not in export(target, reference=tmp_path / "ref.png", reference_view="standard").request["view"]


@pytest.mark.parametrize("view", ["Standard", "AgX"])
def test_no_table_where_a_formula_does(view: str, target: Any, export: Any, tmp_path: Path) -> None:
    write_png(tmp_path / "ref.png", np.zeros((4, 6, 3), np.uint8))
    write_exr(tmp_path / "ref.exr", picture())
    bpy.context.scene.view_settings.view_transform = view
    reference = tmp_path / ("ref.png" if view == "Standard" else "ref.exr")
    report = export(target, reference=reference)
    assert "lut" not in report.request["view"]
    assert not (report.folder / "view_lut.exr").exists()
    assert not [note for note in report.notes if "is taken as" in note]


def test_16_bit_image_holds_display_colours(target: Any, export: Any, tmp_path: Path) -> None:
    """Blender loads it as floats."""
    scene = bpy.context.scene
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "PNG", "16"
    image = bpy.data.images.new("Ramp", 6, 4, float_buffer=True)
    image.save_render(str(tmp_path / "deep.png"), scene=scene)
    deep = bpy.data.images.load(str(tmp_path / "deep.png"))
    assert export(target, reference=deep).request["reference"] == {"path": "reference.png", "encoding": "srgb"}
    scene.view_settings.view_transform = "AgX"
    assert any("deep.png is taken as rendered in this scene" in n for n in export(target, reference=deep).notes)


def test_float_image_becomes_linear_exr(target: Any, export: Any) -> None:
    image = bpy.data.images.new("Float", 6, 4, float_buffer=True)
    pixels = np.ones((4, 6, 4), np.float32)
    pixels[..., :3] = picture() * 5
    image.pixels.foreach_set(pixels[::-1].ravel())
    report = export(target, reference=image)
    assert report.request["reference"] == {"path": "reference.exr", "encoding": "linear"}
    np.testing.assert_array_equal(read(report.folder / "reference.exr"), pixels[..., :3])


def test_byte_image_becomes_png(target: Any, export: Any) -> None:
    Image = pytest.importorskip("PIL.Image")
    image = bpy.data.images.new("Bytes", 6, 4)
    pixels = np.full((4, 6, 4), 255, np.uint8)
    pixels[..., :3] = np.arange(72).reshape(4, 6, 3) * 3
    image.pixels.foreach_set((pixels[::-1] / np.float32(255)).ravel())
    report = export(target, reference=image)
    assert report.request["reference"] == {"path": "reference.png", "encoding": "srgb"}
    with Image.open(report.folder / "reference.png") as found:
        np.testing.assert_array_equal(np.asarray(found), pixels[..., :3])


def test_a_pixel_aspect_has_the_reference_averaged(target: Any, export: Any, tmp_path: Path) -> None:
    bpy.context.scene.render.pixel_aspect_x = 2.0
    ramp = np.repeat(np.array([0.0, 2.0, 1.0, 7.0], np.float32)[:, None, None], 6, axis=1).repeat(3, axis=2)
    write_exr(tmp_path / "ref.exr", ramp)
    before = len(bpy.data.images)
    report = export(target, reference=tmp_path / "ref.exr")
    assert (report.request["image"]["width"], report.request["image"]["height"]) == (6, 2)
    assert len(bpy.data.images) == before
    np.testing.assert_allclose(read(report.folder / "reference.exr")[:, 3, 0], [1.0, 4.0], atol=1e-6)
    assert any(note.startswith("Pixel aspect 2:1") for note in report.notes)


def test_an_averaged_reference_is_as_sharp_as_a_render_of_square_pixels(
    scene: Any, export: Any, render_cycles: Any, tmp_path: Path
) -> None:
    """Stretched ones were blurred along one side, which a fit took for roughness."""
    render = scene.render
    render.resolution_x, render.resolution_y, render.pixel_aspect_x, scene.cycles.samples = 32, 48, 2.0, 64
    world_color(scene, 1.0)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=2.0)
    corners = [(x + 0.13 * y, y - 0.13 * x, 0.0) for x in (-0.4, 0.5) for y in (-0.5, 0.4)]
    target = add_mesh("Target", corners, [(0, 2, 3, 1)], new_material("Target"))
    add_quad("Behind", 3.0, -1.0, emission_material("Bright", (4.0, 4.0, 4.0)))
    render_cycles()
    report = export(target, reference=tmp_path / "cycles.exr")
    found = read(report.folder / "reference.exr")[:, :, :3]
    size = report.request["image"]["width"], report.request["image"]["height"]
    render.resolution_x, render.resolution_y, render.pixel_aspect_x = *size, 1.0
    wanted = render_cycles()
    assert np.abs(found - wanted).mean() < 0.02


def tagged(path: Path, pixels: np.ndarray, **header: Any) -> None:
    OpenEXR = pytest.importorskip("OpenEXR")
    OpenEXR.File({"type": OpenEXR.scanlineimage, **header}, {"RGB": pixels}).write(str(path))


AP1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
CONVERTED = "reference.exr: colours were converted from {} to linear Rec.709."


@pytest.mark.parametrize(
    ("header", "space"),
    [
        ({"colorInteropID": "lin_ap1_scene"}, "lin_ap1_scene"),
        ({"chromaticities": AP1}, "the primaries in its header"),
        ({"colorInteropID": "lin_rec709_scene"}, ""),
        ({}, ""),
    ],
)
def test_colour_space_of_an_exr_is_said_in_the_backends_words(
    header: dict[str, Any], space: str, target: Any, export: Any, tmp_path: Path
) -> None:
    from mfo_backend.scene.image_file import read_image

    tagged(tmp_path / "ref.exr", picture(), **header)
    report = export(target, reference=tmp_path / "ref.exr")
    said = [note for note in report.notes if "converted" in note]
    assert said == ([CONVERTED.format(space)] if space else [])
    assert tuple(said) == read_image(report.folder / "reference.exr").notes


@pytest.mark.parametrize("header", [{"colorInteropID": "lin_ap1_scene"}, {"chromaticities": AP1}])
def test_an_averaged_exr_keeps_what_it_says_of_its_colours(
    header: dict[str, Any], target: Any, export: Any, tmp_path: Path
) -> None:
    from mfo_backend.scene.image_file import read_image

    flat = np.full((4, 6, 3), 0.5, np.float32) * np.array([1.0, 0.5, 0.2], np.float32)
    tagged(tmp_path / "ref.exr", flat, **header)
    bpy.context.scene.render.pixel_aspect_x = 2.0
    report = export(target, reference=tmp_path / "ref.exr")
    averaged = read_image(report.folder / "reference.exr")
    assert averaged.height == 2
    np.testing.assert_allclose(averaged.pixels[0, 0], read_image(tmp_path / "ref.exr").pixels[0, 0], rtol=1e-5)


def test_an_exr_without_a_tag_from_an_output_with_a_space_of_its_own(target: Any, export: Any, tmp_path: Path) -> None:
    tagged(tmp_path / "ref.exr", picture())
    output = bpy.context.scene.render.image_settings
    output.file_format, output.color_management = "OPEN_EXR", "OVERRIDE"
    output.linear_colorspace_settings.name = "ACEScg"
    (said,) = (n for n in export(target, reference=tmp_path / "ref.exr").notes if "does not say its colour space" in n)
    assert "this scene writes ACEScg" in said
    output.linear_colorspace_settings.name = "Linear Rec.709"
    assert not [n for n in export(target, reference=tmp_path / "ref.exr").notes if "colour space" in n]


def test_an_image_whose_colour_space_blender_overlooks(target: Any, export: Any, tmp_path: Path) -> None:
    tagged(tmp_path / "ref.exr", picture(), chromaticities=AP1)
    image = bpy.data.images.load(str(tmp_path / "ref.exr"))
    assert any("Blender takes the reference 'ref.exr' as Linear" in n for n in export(target, reference=image).notes)
    image.colorspace_settings.name = "ACEScg"
    assert not [n for n in export(target, reference=image).notes if "Blender takes" in n]


@pytest.mark.parametrize("orientation", range(1, 9))
def test_pictures_that_their_exif_data_want_turned(orientation: int, target: Any, export: Any, tmp_path: Path) -> None:
    """Pillow turns them likewise."""
    from PIL import Image, ImageOps

    exif = Image.Exif()
    exif[274] = orientation
    sideways = orientation >= 5
    levels = np.random.default_rng(0).integers(0, 256, (6, 4, 3) if sideways else (4, 6, 3), np.uint8)
    Image.fromarray(levels).save(tmp_path / "ref.png", exif=exif)
    if sideways:
        with pytest.raises(
            ExportError, match=r"stored as 4x6 .* is the 6x4 of this scene: take a turned copy"
        ) as caught:
            export(target, reference=tmp_path / "ref.png")
        assert [fix.kind for fix in caught.value.fixes] == ["upright"]
    else:
        said = [n for n in export(target, reference=tmp_path / "ref.png").notes if "EXIF" in n]
        assert len(said) == (orientation > 1)
        if said:
            from mfo_backend.scene.image_file import read_image

            assert tuple(said) == read_image(tmp_path / "job" / "reference.png").notes
    report = export(target, reference=tmp_path / "ref.png", upright=True)
    assert not [n for n in report.notes if "EXIF" in n]
    with Image.open(tmp_path / "ref.png") as stored, Image.open(report.folder / "reference.png") as found:
        np.testing.assert_array_equal(np.asarray(found), np.asarray(ImageOps.exif_transpose(stored)))


def test_floats_that_no_file_encoded_are_linear(target: Any, export: Any) -> None:
    """Cycles takes the numbers of a generated float image as they are, whatever its colour space is."""
    image = bpy.data.images.new("Bright", 6, 4, float_buffer=True)
    image.colorspace_settings.name = "sRGB"
    image.pixels.foreach_set(np.tile(np.array([3.0, 2.0, 0.5, 1.0], np.float32), 6 * 4))
    report = export(target, reference=image)
    assert report.request["reference"]["encoding"] == "linear"
    np.testing.assert_array_equal(read(report.folder / "reference.exr")[0, 0], [3.0, 2.0, 0.5])


def test_wrong_references(target: Any, export: Any, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"none\.exr does not exist: choose another file"):
        export(target, reference=tmp_path / "none.exr")
    write_exr(tmp_path / "exr.png", picture())
    with pytest.raises(ExportError, match=r"exr\.png is a OpenEXR file: give its name the ending of that kind"):
        export(target, reference=tmp_path / "exr.png")
    (tmp_path / "ref.txt").write_text("")
    with pytest.raises(ExportError, match=r"ref\.txt is no picture we read: use EXR"):
        export(target, reference=tmp_path / "ref.txt")
    with pytest.raises(ExportError, match="'Small' is 3x3, but the scene renders 6x4: set the output resolution"):
        export(target, reference=bpy.data.images.new("Small", 3, 3))
    empty = bpy.data.images.new("Empty", 1, 1)
    empty.source = "FILE"
    empty.filepath = str(tmp_path / "gone.png")
    empty.reload()
    with pytest.raises(ExportError, match=r"'Empty' has no pixels .is its file missing"):
        export(target, reference=empty)
