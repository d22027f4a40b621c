# SPDX-License-Identifier: Apache-2.0
"""No text of the panel is cut at the width that the sidebar has in a new Blender, nor at the least that is usual."""

from __future__ import annotations

import ast
import dataclasses
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from ..conftest import new_scene
from ..shown_messages import ADDON, of_call
from ..test_operators import fit, runtime
from .laid_out import AROUND, SUB_HEADER, Cut, Layout

DEFAULT = 280  # of a new Blender, pixels at a scale of 1
WIDTHS = (DEFAULT, 262, 240, 220)
SCALES = (1.0, 1.25, 2.0)  # of hinted letters the widths change by up to 7 %
LANGUAGES = ("en_US", "de_DE", "fr_FR")
WITHIN = {"Cycles prepares the scene", "Values to Fit", "partial"}  # shown as part of a longer text, or as it is
NUMBERS = [f"{value:.3g}" for value in (-0.3125, 0.0074321, 1234.5, 1.2345e-5, -0.0012345, 123456.0)]  # of results
LONG = "kitchen espresso_machine_material_look_v002.png"  # files are told apart by its end
NOT_NOW = {"new node"}  # for a moment after a node was made


def in_language(language: str, text: str, context: str) -> str:
    """A label as a Blender of this language would show it."""
    from blender_addon.translations import CONTEXT, LANGUAGES

    known = LANGUAGES.get(language, {})
    return known.get((context, text), known.get((CONTEXT, text), text))


class Words:
    """A language of the interface, and how wide its texts are."""

    def __init__(self, language: str, scale: float, context: Any) -> None:
        self.language, self.scale, self.context = language, scale, context

    def __call__(self, text: str, context: str) -> str:
        return in_language(self.language, text, context)

    def measure(self, text: str) -> float:
        """In pixels at a scale of 1, as drawn at this one."""
        import blf

        blf.size(0, 11.0 * self.scale)
        return blf.dimensions(0, text)[0] / self.scale


def cut(scene: SimpleNamespace, language: str, width: float, scale: float) -> list[Cut]:
    """What would be cut of all that the panels draw."""
    from blender_addon.panel import _BODIES, reference

    context = scene.bpy.context
    narrow = SimpleNamespace(
        scene=context.scene,
        object=context.object,
        view_layer=context.view_layer,
        window_manager=context.window_manager,
        space_data=SimpleNamespace(shading=SimpleNamespace(type="SOLID")),
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=scale), addons=context.preferences.addons),
        region=SimpleNamespace(width=width * scale),
        selected_objects=list(filter(None, [context.object])),
    )
    words, found = Words(language, scale, narrow), []
    for body in (reference.Reference, *_BODIES):
        if hasattr(body, "poll") and not body.poll(narrow):
            continue
        panel: Any = SimpleNamespace(layout=Layout(words, "header"))
        if hasattr(body, "draw_header"):
            body.draw_header(panel, narrow)
        else:
            panel.layout.label(text=body.bl_label)
        found += panel.layout.cut(width - AROUND - SUB_HEADER, words.measure)
        panel.layout = Layout(words)
        body.draw(panel, narrow)
        found += panel.layout.cut(width - AROUND, words.measure)
    return found


State = Callable[[SimpleNamespace, pytest.MonkeyPatch], Iterator[None]]


def with_problems(scene: SimpleNamespace, _patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.check import preflight

    scene.bpy.context.scene.mfo.reference_path = scene.reference
    scene.bpy.context.scene.render.use_multiview = True
    scene.bpy.context.scene.camera = None
    scene.bpy.context.scene.render.resolution_x = 1920
    preflight.check_now(scene.bpy.context.scene, scene.bpy.context.view_layer)
    yield


def fit_of_glaze(scene: SimpleNamespace) -> SimpleNamespace:
    """What the panel looks at of a running fit."""
    return SimpleNamespace(fit=SimpleNamespace(uids=(scene.bpy.data.materials["Glaze"].session_uid,)))


def while_it_exports(scene: SimpleNamespace, patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.running import running_export

    patch.setattr(running_export, "current", object())
    patch.setattr(running_export, "seconds", lambda: 188.0)
    patch.setattr(running_export, "progress", lambda: (0.4, "Picture 12 of 32"))
    yield
    patch.setattr(running_export, "progress", lambda: (0.0, "Cycles looks at picture 12"))
    yield
    patch.setattr(running_export, "progress", lambda: (None, ""))
    yield


def while_it_runs(scene: SimpleNamespace, patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.pictures import previews
    from blender_addon.running import running_job

    patch.setattr(running_job, "current", fit_of_glaze(scene))
    patch.setattr(previews, "icon", lambda name: 1)
    runtime(scene).material = "Glaze"
    said = ["Starting", "Cancelling", "Checking the values"]
    for stage in (running_job._FIRST_STAGES[0], "flip-hdr"):
        for share, left in ((0.01, None), (0.07, 59.0), (1.0, 3599.0)):
            said.append(running_job.progress_text({"stage": stage, "fraction": share, "remaining_seconds": left}))
    for runtime(scene).progress_text in said:
        yield


def with_questions(scene: SimpleNamespace, _patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.result import shown_result
    from blender_addon.result.job_result import NextPicture

    context = scene.bpy.context
    context.scene.mfo.reference_path = scene.reference
    context.scene.view_settings.view_transform = "AgX"
    yield
    scene.bpy.ops.mfo.check()
    yield
    fit(scene)
    shown = runtime(scene)
    shown.verdict, shown.asked = "different", shown.job_folder
    for light in ("", "Light"):
        picture = NextPicture("Another picture would tell more.", 60.0, (0.0, 0.0, 0.0), light=light)
        shown_result.result = dataclasses.replace(shown_result.result, next_picture=picture)
        yield
    context.object.active_material = None
    yield
    scene.bpy.data.objects.remove(context.object)
    yield


def with_an_overlay(scene: SimpleNamespace, _patch: pytest.MonkeyPatch) -> Iterator[None]:
    settings = scene.bpy.context.scene.mfo
    settings.reference_path = scene.reference
    scene.bpy.ops.mfo.overlay_reference()
    for settings.overlay.mode in ("BLEND", "SPLIT", "DIFFERENCE"):
        yield


def with_a_result(scene: SimpleNamespace, patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.pictures import previews
    from blender_addon.properties import SOCKET_ITEMS

    fit(scene)
    fit(scene)
    names = [name for _, name, *_ in SOCKET_ITEMS] + ["Color Ramp/Stop 0", "Noise Texture/Scale", "Mix/Factor"]
    shown = runtime(scene)
    for i, name in enumerate(names):
        row = shown.values.add()
        row.name, row.start, row.result = name, "0.125", NUMBERS[i % len(NUMBERS)]
        row.sureness = 0.5 if i % 2 else -1.0
    patch.setattr(previews, "icon", lambda name: int(name.startswith("#") or name.isidentifier()))
    yield
    shown.cycles_text, shown.cycles_flip = "FLIP in Cycles: 0.0234", 0.02
    yield
    scene.bpy.ops.mfo.apply()
    for shows in (True, False):
        scene.bpy.context.object.active_material.mfo.shows_original = shows
        yield
    kept = scene.bpy.context.object.active_material.mfo.history
    kept[0].partial = True
    yield


def with_chosen_values(scene: SimpleNamespace, _patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.properties import MODEL_ITEMS, SOCKET_ITEMS, toggle_bound

    settings = scene.bpy.context.scene.mfo
    settings.parameter_set = "chosen"
    settings.sockets = {key for key, *_ in SOCKET_ITEMS}
    for key, *_ in SOCKET_ITEMS:
        toggle_bound(settings, key)
    yield
    tree = scene.bpy.data.materials["Glaze"].node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    noise, ramp = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeValToRGB")
    tree.links.new(noise.outputs[0], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
    yield
    for model, *_ in MODEL_ITEMS:
        settings.model = model
        yield


def with_a_queue(scene: SimpleNamespace, patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.running import cycles_check, fit_queue, running_job

    waits = fit_queue.PreparedFit(Path(), Path(), "Glaze", (), (), True)
    patch.setattr(fit_queue, "waiting", [waits] * 12)
    patch.setattr(fit_queue, "finished", [fit_queue.EndedFit("Glaze", "It was cancelled.", "INFO")] * 8)
    yield
    fit(scene)
    patch.setattr(cycles_check, "is_running", lambda: True)
    patch.setattr(running_job, "current", fit_of_glaze(scene))
    for step in ("Rendering in Cycles", "Rendering in Eevee Next", "Rendering the reference", "Comparing"):
        runtime(scene).cycles_text = f"{step}, sample 4095 of 4096"
        yield


def with_a_mix_and_motion(scene: SimpleNamespace, _patch: pytest.MonkeyPatch) -> Iterator[None]:
    material = scene.bpy.data.materials["Glaze"]
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Roughness"].keyframe_insert("default_value", frame=1)
    fit(scene)
    yield
    other, mix = tree.nodes.new("ShaderNodeBsdfPrincipled"), tree.nodes.new("ShaderNodeMixShader")
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    for index, source in ((1, shader), (2, other)):
        tree.links.new(source.outputs[0], mix.inputs[index])
    tree.links.new(mix.outputs[0], output.inputs[0])
    scene.bpy.context.scene.mfo.parameter_set = "chosen"
    yield


def with_several_pictures(scene: SimpleNamespace, patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.panel import reference

    settings = scene.bpy.context.scene.mfo
    settings.reference_path = scene.reference
    scene.bpy.ops.mfo.add_picture()
    settings.pictures[0].exposure, settings.pictures[0].frame = -12.5, 1250
    patch.setattr(reference, "thumbnail", lambda path: 1)
    yield
    patch.setattr(reference, "thumbnail", lambda path: 0)
    settings.first_picture.part.left = 10.0
    scene.bpy.ops.mfo.list_materials()
    yield
    for view in settings.bl_rna.properties["parameter_set"].enum_items:
        settings.parameter_set = view.identifier
        yield
    tree = scene.bpy.data.materials["Glaze"].node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
    settings.parameter_set = "chosen"  # below the name of each material
    yield
    settings.targets[0].object = None  # as when it was deleted
    yield


def with_the_backend(scene: SimpleNamespace, patch: pytest.MonkeyPatch) -> Iterator[None]:
    from blender_addon.backend import backend_section, backend_state

    for name in backend_section._TITLES:
        state = backend_state.BackendState(
            name, "The backend cannot run.", ["Mitsuba is not installed: install it again."], "/usr/bin/python3",
            "Downloading packages", 0.4, ["Collecting mitsuba==3.9.1 (from -r requirements.txt)"], "log", True,
        )  # fmt: skip
        patch.setattr(backend_state, "current", state)
        patch.setattr(backend_section, "has_trouble", lambda: True)
        yield


def with_long_names(scene: SimpleNamespace, _patch: pytest.MonkeyPatch) -> Iterator[None]:
    settings = scene.bpy.context.scene.mfo
    settings.reference_path = f"/renders/{LONG}"
    scene.bpy.ops.mfo.add_picture()
    settings.pictures[0].path = f"//renders/{LONG}"
    yield
    settings.reference_source, settings.reference_image = "IMAGE", scene.bpy.data.images.new(LONG, 4, 4)
    yield
    for name in ("Glaze.001", "Glaze of cup", "Glaze of the cup.001"):  # in half a line, beside the object, above it
        scene.bpy.data.materials[scene.bpy.context.object.active_material.name].name = name
        scene.bpy.ops.mfo.list_materials()
        yield


STATES = (
    with_problems, with_long_names, with_questions, while_it_exports, while_it_runs, with_a_result, with_chosen_values,
    with_a_queue, with_a_mix_and_motion, with_several_pictures, with_the_backend, with_an_overlay,
)  # fmt: skip


def test_the_states_show_every_label(addon: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A label that no state shows would be measured nowhere."""
    shown: set[str] = set()
    monkeypatch.setattr(Words, "__call__", lambda self, text, context: shown.add(text) or text)
    for state in STATES:
        folder = tmp_path / state.__name__
        folder.mkdir()
        with pytest.MonkeyPatch.context() as patch:
            scene = new_scene(folder, patch)
            for _ in state(scene, patch):
                cut(scene, "en_US", DEFAULT, 1.0)
    drawn = {path for path in (ADDON / "panel").glob("*.py") if path.name != "menu.py"}
    assert _labels({*drawn, ADDON / "backend" / "backend_section.py"}) - shown == WITHIN | NOT_NOW


def _labels(files: set[Path]) -> set[str]:
    """Texts written out in calls that draw, of these files."""
    calls = (node for path in files for node in ast.walk(ast.parse(path.read_text("utf-8"))))
    return {text for node in calls if isinstance(node, ast.Call) for _, text in of_call(node) if text}


def test_a_region_without_width_is_drawn(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    for state in (with_a_result, with_the_backend, with_problems):
        for _ in state(scene, monkeypatch):
            assert cut(scene, "en_US", 1, 1.0)


@pytest.mark.parametrize("state", STATES, ids=lambda state: state.__name__)
@pytest.mark.parametrize("language", LANGUAGES)
def test_no_text_is_cut(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, language: str, state: State) -> None:
    from blender_addon.panel import history, layout, parameters, part, reference, result, run
    from blender_addon.pictures import previews
    from blender_addon.sentences import translated

    monkeypatch.setattr(translated, "_language", lambda: language)
    monkeypatch.setattr(previews, "icon", lambda name: int(name.startswith("#")))  # colours have swatches
    for drawing in (layout, history, parameters, part, reference, result, run):
        monkeypatch.setattr(drawing, "word", lambda text, context="*": in_language(language, text, context))
    found: dict[tuple[str, float], Cut] = {}
    for _ in state(scene, monkeypatch):
        for width in WIDTHS:
            for scale in SCALES:
                found |= {(each.text, width): each for each in cut(scene, language, width, scale)}
    assert not found, "\n".join(f"at {w}: {c.text!r} {c.width:.0f} > {c.room:.0f}" for (_, w), c in found.items())


@pytest.mark.parametrize("width", [220, 280, 400, 1200])
def test_all_of_a_name_is_below_a_field_that_cuts_it(
    scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, width: float
) -> None:
    shown: list[str] = []
    monkeypatch.setattr(Layout, "label", lambda self, *, text="", **_: shown.append(text))
    for _ in with_long_names(scene, monkeypatch):
        shown.clear()
        cut(scene, "en_US", width, 1.0)
        whole = "".join(shown).replace(" ", "").count(LONG.replace(" ", ""))
        assert whole == (0 if width == 1200 else 2)
