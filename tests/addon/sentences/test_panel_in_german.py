# SPDX-License-Identifier: Apache-2.0
"""The panel of a German Blender over a fit with notes: nothing that it draws is English."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from ..test_operators import fit, runtime
from .languages import ENGLISH

SAME = {"Material Fit", "FLIP", "Live", "Material", "Start", "A/B"}  # in both languages
BLENDERS = "Values to Fit"  # looked up by Blender within a longer text
NOTES = [
    "Camera 'Camera' has a shift: its depth of field is left out, everything is sharp.",
    "Light 'the and of' is a portal, which gives no light of its own; it is left out.",
    "Roughness of material 'Glaze' is linked to the node 'Noise' (Noise Texture), which cannot be exported; the "
    "socket's own value is used.",
    "Picture 2 (side.exr): Object 'Text' is a text, which is not exported.",
    "The picture does not determine IOR, Coat Weight: kept as in the scene.",
    "The material of the scene did not match. Fits that began again from one that is of glass or cut out came not "
    "clearly nearer. No fit holds one that is glowing.",
    "With a probability of 31 % it is another material: Metallic 0.9 (not 0.1), Roughness 0.4 (not 0.2).",
    "The image has 0.05 of something. Model gap 4 %: so far the result stays from the reference, noise taken out. "
    "Something in the picture is not in the fit, the fit ended in the wrong place, or the reference was denoised.",
]
VERDICT = (
    "The result is close to the reference: compare before applying. The difference lies at edges: check the camera and "
    "the shape of the object."
)
NEXT = (
    "A further picture with the camera turned by 60 degrees around the object (clockwise from above) would settle IOR "
    "and Coat Weight."
)
WEAK = (
    "Roughness and IOR can be traded against each other: 0.1 more Roughness and 0.2 less IOR would hardly change the "
    "picture; another light would tell them apart."
)
UNKNOWN = "The image has 0.05 of something."  # a sentence that nobody has translated stays, alone


class Layout:
    """Stands for a layout and all that it makes; keeps what a German Blender would show."""

    def __init__(self, shown: list[str]) -> None:
        self.shown = shown

    def __getattr__(self, kind: str) -> Any:
        def draw(*given: Any, text: str | None = None, translate: bool = True, **_others: Any) -> Any:
            self.shown.extend(self.words(kind, given, text, translate))
            return (Layout(self.shown), Layout(self.shown)) if kind == "panel" else Layout(self.shown)

        return draw

    def words(self, kind: str, given: tuple[Any, ...], text: str | None, translate: bool) -> Iterator[str]:
        import bpy

        from blender_addon.translations import LANGUAGES

        if text is None and kind == "operator":
            space, name = given[0].split(".")
            text = getattr(bpy.types, f"{space.upper()}_OT_{name}").bl_label
        elif text is None and kind == "prop":
            text = given[0].bl_rna.properties[given[1]].name
        if text:
            key = ("Operator" if kind == "operator" else "*", text)
            yield LANGUAGES["de_DE"].get(key, text) if translate else text


@pytest.fixture
def german(addon: object, monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a German Blender; the module has no languages, so that it looks nothing up itself."""
    from blender_addon.sentences import translated

    monkeypatch.setattr(translated, "_language", lambda: "de_DE")


def test_panel_shows_no_english(scene: SimpleNamespace, german: None) -> None:
    fit(scene)
    path = Path(scene.job, "result.json")
    found = json.loads(path.read_text()) | {
        "notes": NOTES,
        "verdict": "close",
        "sentence": VERDICT,
        "next_picture": {
            "sentence": NEXT,
            "turn": 60.0,
            "center": [0.0, 0.0, 0.0],
        },
        "weak_combinations": [{"sentence": WEAK}],
    }
    path.write_text(json.dumps(found))
    scene.bpy.ops.mfo.open_job(directory=scene.job)
    scene.bpy.context.scene.mfo.reference_path = scene.reference
    runtime(scene).state, runtime(scene).sentence = "DONE", VERDICT
    shown = drawn(scene)
    assert len(shown) > 70
    assert not {"Reference", "Result", "Error", "Difference"} & set(shown)
    assert any("Schärfentiefe" in text for text in shown)
    assert any("'the and of'" in text.replace("\n", " ") for text in shown)  # names stay
    kept = ("'the and of'", UNKNOWN, BLENDERS)
    quotes = [text for text in shown if text not in SAME and not any(words in text for words in kept)]
    assert [text for text in quotes if ENGLISH.search(text)] == []


def drawn(scene: SimpleNamespace) -> list[str]:
    """Every text of every panel; sentences on one line."""
    from blender_addon.check import preflight
    from blender_addon.panel import _BODIES, reference

    context = scene.bpy.context
    wide = SimpleNamespace(
        scene=context.scene,
        object=context.object,
        view_layer=context.view_layer,
        window_manager=context.window_manager,
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0), addons=context.preferences.addons),
        region=SimpleNamespace(width=5000),
        selected_objects=[context.object],
    )
    preflight.check_now(context.scene, context.view_layer)
    shown: list[str] = []
    for body in (reference.Reference, *_BODIES):
        panel: Any = SimpleNamespace(layout=Layout(shown))
        if hasattr(body, "draw_header"):
            body.draw_header(panel, wide)
        body.draw(panel, wide)
    return shown
