# SPDX-License-Identifier: Apache-2.0
"""What the check marks as a problem keeps a fit from starting: in the panel, by F3 and for a script, by one list."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mfo_backend.scene.image_file import write_exr

from ..panel.laid_out import Layout
from ..test_operators import runtime
from .found import check
from .test_checks import SPOILED, another_size, no_material


def no_picture(scene: SimpleNamespace) -> None:
    scene.bpy.context.scene.mfo.reference_path = ""


def no_second_file(scene: SimpleNamespace) -> None:
    scene.bpy.ops.mfo.add_picture()


def no_picture_used(scene: SimpleNamespace) -> None:
    scene.bpy.ops.mfo.add_picture()
    settings = scene.bpy.context.scene.mfo
    settings.first_picture.use = settings.pictures[0].use = False


SPOILERS = [*dict.fromkeys(spoil for spoil, _ in SPOILED), no_picture, no_second_file, no_picture_used]


@pytest.fixture
def unstarted(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """A scene with a reference, whose backend must not start."""
    from blender_addon.running import running_job

    monkeypatch.setattr(running_job, "start", lambda *_, **__: pytest.fail("the backend was started"))
    scene.bpy.context.scene.mfo.reference_path = scene.reference
    return scene


def check_now(scene: SimpleNamespace) -> list[str]:
    """What of the check stops the fit or is still to choose."""
    from blender_addon.check import preflight

    context = scene.bpy.context
    preflight.check_now(context.scene, context.view_layer)
    return [f.sentence for f in preflight.findings if f.level in ("stops", "to_choose")]


@pytest.mark.parametrize("spoil", SPOILERS, ids=lambda spoil: spoil.__name__)
def test_no_fit_starts_with_a_problem(unstarted: SimpleNamespace, spoil: Callable[[SimpleNamespace], None]) -> None:
    from blender_addon.check import preflight

    bpy = unstarted.bpy
    assert check_now(unstarted) == []
    assert preflight.refusal(bpy.context) == ""
    assert buttons(unstarted)["mfo.fit"]
    spoil(unstarted)
    assert preflight.refusal(bpy.context) == "" or not buttons(unstarted)["mfo.fit"]  # known once it is checked
    said = check_now(unstarted)
    assert preflight.refusal(bpy.context) == said[0]
    assert not buttons(unstarted)["mfo.fit"]
    with pytest.raises(RuntimeError) as error:
        bpy.ops.mfo.fit(job_folder=unstarted.job)
    assert said[0] in str(error.value)
    assert not Path(unstarted.job).exists()
    texts = drawn(unstarted)
    assert texts.count(said[0]) == 1
    assert "The fit did not begin: the check above says what is to be mended." in texts


def test_nothing_is_said_of_a_refusal_whose_reason_was_mended(unstarted: SimpleNamespace) -> None:
    """Also where nothing else that the panel looks at has changed."""
    bpy = unstarted.bpy
    bpy.data.objects["Väse"].hide_render = True
    check_now(unstarted)
    with pytest.raises(RuntimeError, match="'Väse' is hidden in the render"):
        bpy.ops.mfo.fit(job_folder=unstarted.job)
    said = runtime(unstarted).sentence
    assert said in check_now(unstarted)
    assert bpy.ops.mfo.mend(kind="show_in_render") == {"FINISHED"}
    texts = drawn(unstarted)
    assert texts.count(said) == 1  # the line of the check that was mended
    assert "The fit did not begin: the check above says what is to be mended." not in texts


@pytest.mark.parametrize(("spoil", "is_of_all"), [(another_size, True), (no_picture, True), (no_material, False)])
def test_selected_objects_have_the_pictures_in_common(
    unstarted: SimpleNamespace, spoil: Callable[[SimpleNamespace], None], is_of_all: bool
) -> None:
    """A material that cannot be fitted stops its own fit alone."""
    from blender_addon.check import preflight

    spoil(unstarted)
    said = check_now(unstarted)
    assert said
    assert bool(preflight.refusal(unstarted.bpy.context, of_all=True)) == is_of_all
    if is_of_all:
        with pytest.raises(RuntimeError) as error:
            unstarted.bpy.ops.mfo.fit_selected()
        assert said[0] in str(error.value)
        assert runtime(unstarted).sentence == said[0]


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "tif", "exr", "hdr"])
def test_an_export_refuses_a_file_of_another_size(unstarted: SimpleNamespace, tmp_path: Path, suffix: str) -> None:
    """Also where a script names picture and object, which the check knows nothing of."""
    path = tmp_path / f"wide.{suffix}"
    if suffix == "exr":
        write_exr(path, np.ones((64, 100, 3), np.float32))
    elif suffix == "hdr":
        image = unstarted.bpy.data.images.new("wide", 100, 64, float_buffer=True)
        image.file_format, image.filepath_raw = "HDR", str(path)
        image.save()
    else:
        Image.new("RGB", (100, 64)).save(path)
    with pytest.raises(RuntimeError, match=f"'wide.{suffix}' is 100x64, but the scene renders 96x64"):
        unstarted.bpy.ops.mfo.fit(reference=str(path), object="Väse", job_folder=unstarted.job)
    assert not Path(unstarted.job).exists()


def test_several_pictures_have_each_its_own_size_and_camera(scene: SimpleNamespace, tmp_path: Path) -> None:
    bpy = scene.bpy
    settings = bpy.context.scene.mfo
    Image.new("RGB", (48, 48), (180, 60, 40)).save(tmp_path / "small.png")
    settings.reference_path = scene.reference
    assert bpy.ops.mfo.add_picture() == {"FINISHED"}
    settings.pictures[0].path = str(tmp_path / "small.png")
    for picture in (settings.first_picture, settings.pictures[0]):
        picture.camera = bpy.context.scene.camera
    bpy.context.scene.render.resolution_x = 64
    bpy.context.scene.camera = None
    assert check_now(scene) == []
    assert bpy.ops.mfo.fit(job_folder=scene.job) == {"FINISHED"}
    settings.first_picture.use, settings.reference_path = False, ""  # which is asked for no more
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 48
    assert check_now(scene) == []
    assert bpy.ops.mfo.fit(job_folder=scene.job + "2") == {"FINISHED"}
    settings.first_picture.use, settings.reference_path = True, scene.reference
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 64, 64
    settings.pictures[0].use = False  # the first alone has the size of the scene
    bpy.context.scene.camera = settings.first_picture.camera
    assert "is 96x64, but the scene renders 64x64" in check_now(scene)[0]


def test_a_script_may_give_what_the_panel_lacks(scene: SimpleNamespace) -> None:
    scene.bpy.context.scene.mfo.reference_path = ""
    assert check(scene)
    assert scene.bpy.ops.mfo.fit(reference=scene.reference, object="Väse", job_folder=scene.job) == {"FINISHED"}


class _Told(Layout):
    """Keeps which buttons can be pressed, and every sentence whole."""

    pressed: dict[str, bool]
    texts: list[str]

    def operator(self, name: str, **options: Any) -> Any:
        self.words.pressed[name] = getattr(self, "enabled", True)
        return super().operator(name, **options)

    def _within(self, kind: str, **options: Any) -> Layout:
        made = super()._within(kind, **options)
        made.__class__ = _Told
        return made


def draw(scene: SimpleNamespace, patch: pytest.MonkeyPatch) -> tuple[dict[str, bool], list[str]]:
    """The buttons of the panels, and the sentences."""
    from blender_addon.panel import check as check_panel
    from blender_addon.panel import layout, run

    context, texts = scene.bpy.context, []
    around = SimpleNamespace(
        scene=context.scene, object=context.object, view_layer=context.view_layer,
        window_manager=context.window_manager, preferences=context.preferences,
        region=SimpleNamespace(width=280), selected_objects=[],
    )  # fmt: skip
    words = type("Words", (), {"pressed": {}, "context": around, "__call__": lambda self, text, _context: text})()
    for module in (check_panel, layout, run):
        patch.setattr(module, "draw_sentence", lambda _layout, _context, text, *_, **__: texts.append(text))
    for body in (check_panel.Check, run.Run):
        panel: Any = SimpleNamespace(layout=_Told(words))
        body.draw(panel, around)
    return words.pressed, texts


def buttons(scene: SimpleNamespace) -> dict[str, bool]:
    with pytest.MonkeyPatch.context() as patch:
        return draw(scene, patch)[0]


def drawn(scene: SimpleNamespace) -> list[str]:
    with pytest.MonkeyPatch.context() as patch:
        return draw(scene, patch)[1]
