# SPDX-License-Identifier: Apache-2.0
"""What the add-on says at run time goes through translation, and complete languages have all of it."""

from __future__ import annotations

import ast
import re
import string

import pytest

from mfo_backend.types.verdict import Cause, Judgement, Verdict

from .languages import COMPLETE, ENGLISH
from .run_time_sentences import ADDON, BACKEND, run_time_sentences, sentences

SAID = (
    "backend",
    "bake",
    "check",
    "export",
    "graph_values",
    "operators",
    "panel",
    "probe",
    "process",
    "result",
    "running",
)
# what a fit notes and what an artist's picture can be refused for; a job folder is written by the add-on, so that
# sentences on its files are for those who write their own
BY_BACKEND = (
    *("fit/alike", "fit/certainty", "fit/judge", "fit/materials", "fit/pictures", "fit/recorded", "fit/result"),
    *("fit/traced", "fit/recover_material.py", "job/run", "types/status.py", "types/model_gap.py", "types/verdict.py"),
    *("scene/colour_space.py", "scene/exr_file.py", "scene/hdr_file.py", "scene/image_file.py"),
    *("scene/picture_kind.py", "scene/picture_size.py", "scene/png_file.py"),
)
PUT_TOGETHER = {  # of parts, by functions that tests below call
    "A further picture {} {}.",
    "Pictures {} do not go together{}: the light or camera of one of them differs from its scene. {}",
}
FOR_DEVELOPERS = {
    "The view's table {} is {}x{}, but request.json says {} nodes, which is {}x{}: export the job again.",
}
SAME = ("FLIP in Cycles", "X. In X", "Material 'X': X")  # in another language, too


@pytest.fixture
def german(addon: object):
    from blender_addon.sentences.german import SENTENCES

    return SENTENCES


def in_german(text: str) -> str:
    from blender_addon.sentences.translated import in_language

    return in_language("de_DE", text)


def english_in(text: str, language: str) -> str:
    """What is left of a sentence in another language that is English; names stand for what is put in."""
    from blender_addon.sentences.translated import in_language

    said = in_language(language, text.replace("{}", "X"))
    unknown = said == text.replace("{}", "X") and not said.startswith(SAME)
    return said if unknown or ENGLISH.search(said) else ""


@pytest.mark.parametrize("language", COMPLETE)
def test_every_sentence_of_the_addon_is_translated(addon: object, language: str) -> None:
    found = run_time_sentences(SAID)
    assert len(found) > 300
    missing = sorted(s for s in found if english_in(s, language) and not s.startswith("{}."))
    assert missing == [], f"not in {language}: add them to its folder of sentences/"


@pytest.mark.parametrize("language", COMPLETE)
def test_what_the_backend_notes_is_translated(addon: object, language: str) -> None:
    found = {text.removeprefix("{}") if text.startswith("{}S") else text for text in sentences(BACKEND, BY_BACKEND)}
    assert len(found) > 80
    missing = sorted(s for s in found - PUT_TOGETHER - FOR_DEVELOPERS if english_in(s.strip(), language))
    assert missing == [], f"not in {language}: add them to fit.py of its folder of sentences/"


def test_every_verdict_has_german(german) -> None:
    for verdict in Verdict:
        for cause in (None, *Cause):
            for picture in (None, "2 (side.exr)"):
                said = Judgement(verdict, cause, None, None, picture).sentence  # type: ignore[arg-type]
                words = in_german(said)
                assert not re.search(r"\b(the|result|check|object)\b", words), words
                assert picture is None or picture in words


def test_names_and_numbers_are_where_they_belong(german) -> None:
    said = "The reference 'vase.png' is 96x64, but the scene renders 8x8: set the output resolution to the reference's."
    assert in_german(said) == (
        "Die Referenz 'vase.png' hat 96x64, aber die Szene rendert 8x8: "
        "die Ausgabeauflösung auf die der Referenz setzen."
    )
    assert in_german("Ready, 3 notes") == "Bereit, 3 Hinweise"
    assert in_german("Choose the picture to match: a file.").endswith(": eine Datei.")
    assert in_german("The result does not match the reference. Press Apply again to apply it anyway.").startswith(
        "Das Ergebnis passt nicht zur Referenz. Noch einmal"
    )


def test_unknown_sentences_and_other_languages_stay_english(german) -> None:
    from blender_addon.sentences.translated import in_language

    for text in ("Use a smaller picture, or free some memory.", "Select what you like.", ""):
        assert in_german(text) == text
    assert in_language("it_IT", "Ready") == "Ready"


def test_a_second_language_is_found(addon: object) -> None:
    from blender_addon.sentences.translated import in_language

    said = in_language("fr_FR", "Pictures 1, 2 and 3 do not go together: the light or camera of one of them differs "
                       "from its scene.")  # fmt: skip
    assert said.startswith("Les images 1, 2 et 3 ne vont pas ensemble : la lumière")
    assert in_language("fr", "Ready, 3 notes") == "Prêt, 3 remarques"


def test_translations_put_in_what_the_english_ones_do(addon: object) -> None:
    from blender_addon.sentences.languages import FOLDERS

    for language in FOLDERS.values():
        for english, words in {**language.SENTENCES, **language.REPORT}.items():
            fields = [field for _, field, *_ in string.Formatter().parse(words) if field is not None]
            assert len(fields) == english.count("{}"), english
            assert english.endswith(".") == words.endswith("."), english


def test_everything_that_is_reported_goes_through_translation() -> None:
    for path in ADDON.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            name = getattr(getattr(node, "func", None), "attr", "")
            place = {"report": 1, "poll_message_set": 0}.get(name)
            if place is None or len(node.args) <= place:
                continue
            said = node.args[place]
            assert getattr(getattr(said, "func", None), "id", "") == "translated", f"{path.name}:{node.lineno}"
