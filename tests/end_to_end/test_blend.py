# SPDX-License-Identifier: Apache-2.0
"""The whole road: a .blend and a picture in, recovered values on the material out."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip.flip_error import flip_error
from mfo_backend.report.difference_map import NOT_COUNTED
from mfo_backend.scene.image_file import read_image, write_exr, write_png

from .conftest import RENDER, SIZE, Done, Fitted, Scene, run_bpy, run_mfo

Blend = Callable[..., Done]


@pytest.fixture
def blend_here(scene: Scene, mfo_here: Blend) -> Blend:
    """`blend` without processes of its own, for other pictures and settings."""

    def call(reference: Path, *arguments: object) -> Done:
        return mfo_here("blend", scene.start, "--object", scene.object, "--reference", reference, *arguments)

    return call


OPAQUE = ("base_color", "metallic", "roughness", "specular_ior_level", "specular_tint", "coat_weight", "coat_roughness",
          "sheen_weight", "sheen_roughness", "sheen_tint")  # fmt: skip
SHOW = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
node = bpy.data.materials["Head"].node_tree.nodes["Principled BSDF"]
found = {s.name: (list(s.default_value) if hasattr(s.default_value, "__len__") else s.default_value)
         for s in node.inputs if s.type in ("VALUE", "RGBA")}
"""


def test_linear_reference_is_recovered_and_applied(scene: Scene, fitted: Fitted) -> None:
    done = fitted.done
    assert done.code == 0, done.stderr
    gap = done.answer["model_gap"]
    assert 0.0 <= gap["relative"] <= gap["at_most"] < 0.05  # the renderer is Cycles' equal, so little is left
    start, result = done.answer["errors"]["flip"]
    # the floor is the noise of both pictures, about 0.03 at 64 samples; the start is another material altogether
    assert result < 0.06
    assert result < start / 4
    assert done.answer["model"] == "blender_principled"
    assert hashlib.sha256(scene.start.read_bytes()).hexdigest() == fitted.started_from
    shown, recovered = run_bpy(SHOW, fitted.saved), done.answer["recovered"]
    assert shown["Roughness"] == pytest.approx(recovered["roughness"], abs=1e-6)
    assert shown["Base Color"][:3] == pytest.approx(recovered["base_color"], abs=1e-6)
    for name in ("reference", "start", "result", "difference"):
        assert (fitted.job / "pictures" / f"{name}.png").is_file()
    assert "Roughness" in (fitted.job / "index.html").read_text("utf-8").title()


def test_display_picture_is_recovered(scene: Scene, blend_here: Blend, tmp_path: Path) -> None:
    done = blend_here(scene.png, "--out", tmp_path / "job", "--preset", "fast", "--json")
    assert done.code == 0, done.stderr
    start, result = done.answer["errors"]["flip"]
    assert result < 0.06  # as above
    assert result < start / 4


@pytest.fixture
def agx(scene: Scene, tmp_path: Path) -> Path:
    """The start with the view transform AgX."""
    file = tmp_path / "agx.blend"
    run_bpy(
        "bpy.ops.wm.open_mainfile(filepath=argv[0])\n"
        "bpy.context.scene.view_settings.view_transform = 'AgX'\n"
        "bpy.ops.wm.save_as_mainfile(filepath=argv[1], copy=True)",
        scene.start,
        file,
    )
    return file


def test_agx_picture_is_recovered_through_its_view(scene: Scene, blend: Blend, agx: Path, tmp_path: Path) -> None:
    done = blend(scene.agx_png, "--out", tmp_path / "job", "--json", file=agx)
    assert done.code == 0, done.stderr
    start, result = done.answer["errors"]["flip"]
    assert result < 0.06  # as above
    assert result < start / 4
    assert any("is taken as rendered in this scene" in note and "AgX" in note for note in done.answer["notes"])
    reference = read_image(tmp_path / "job" / "pictures" / "reference.png").pixels
    shown = read_image(tmp_path / "job" / "pictures" / "result.png").pixels
    # the report's pictures are seen through the view too: measured 0.007, and 0.020 between AgX and Standard
    assert np.abs(shown - reference).mean() < 0.014


def test_paper_preset_lowers_flip_after_mse(scene: Scene, blend_here: Blend, tmp_path: Path) -> None:
    done = blend_here(
        scene.exr, "--out", tmp_path / "job", "--preset", "paper", "--parameters", "reduced", "--spp", 4,
        "--max-iterations", 150, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    mse, flip = done.answer["stages"]
    assert [mse["name"], flip["name"]] == ["mse-hdr", "flip-hdr"]
    assert mse["status"] == "stale"
    assert mse["loss_best"] < 0.5 * mse["loss_start"]  # a fifth of it is the noise of 4 samples
    assert flip["loss_best"] < flip["loss_start"]
    start, result = done.answer["errors"]["hdr_flip"]
    assert result < start / 2


def test_demo_judges_in_cycles(tmp_path: Path) -> None:
    as_users = {"MFO_THREADS": ""}  # a thread for each processor, which the other tests share
    done = run_mfo("demo", "--out", tmp_path / "demo", "--size", 64, "--samples", 64, "--json", environment=as_users)
    assert done.code == 0, done.stderr
    assert done.answer["flip_after"] <= 0.06
    assert done.answer["flip_after"] * 4 <= done.answer["flip_before"]
    pictures = [read_image(tmp_path / "demo" / f"{name}.exr") for name in ("reference", "after")]
    assert flip_error(*pictures, display=DisplayView()).mean == pytest.approx(done.answer["flip_after"], abs=1e-6)
    assert np.isfinite(pictures[1].pixels).all()


def test_what_the_mask_leaves_out_has_no_part_in_the_fit(scene: Scene, blend_here: Blend, tmp_path: Path) -> None:
    """Something is in front of a quarter of the picture: under the mask the result is that of the whole picture."""
    # of a quarter of the noise: with that of 64 samples three quarters of the pixels are 0.061 from the reference
    calm = tmp_path / "calm.exr"
    run_bpy(RENDER.replace("= 64,", "= 256,"), scene.truth, calm, tmp_path / "calm.png", tmp_path / "agx.png")
    picture = read_image(calm).pixels.copy()
    covered = np.zeros(picture.shape[:2], bool)
    covered[SIZE // 2 :, SIZE // 2 :] = True
    picture[covered] = (0.05, 0.6, 0.1)
    write_exr(tmp_path / "covered.exr", picture)
    write_png(tmp_path / "mask.png", (~covered).astype(np.float32))
    # those of `all` by name: a picture that does not match asks for no fits from other classes of material
    options = ("--preset", "fast", "--parameters", ", ".join(OPAQUE), "--json")
    blind = blend_here(tmp_path / "covered.exr", "--out", tmp_path / "blind", *options).answer
    assert blind["verdict"] == "different"
    seeing = blend_here(tmp_path / "covered.exr", "--mask", tmp_path / "mask.png", "--out", tmp_path / "job", *options)
    assert seeing.code == 0, seeing.stderr
    assert seeing.answer["errors"]["flip"][1] < 0.06  # as above
    assert seeing.answer["difference"]["target"]["shared_at_least"] < 0.01
    assert any("75 % of the reference's pixels count (mask)" in note for note in seeing.answer["notes"])
    shown = read_image(tmp_path / "job" / "pictures" / "difference.png").pixels
    assert np.allclose(shown[covered], NOT_COUNTED, atol=1 / 255)
    assert not np.allclose(shown[~covered], NOT_COUNTED, atol=1 / 255)


def test_a_mask_beside_the_object_is_refused(scene: Scene, blend_here: Blend, tmp_path: Path) -> None:
    done = blend_here(scene.exr, "--crop", "0,0,4,4", "--out", tmp_path / "job")
    assert done.code == 2
    assert "shows nothing of the target" in done.sentence
