# SPDX-License-Identifier: Apache-2.0
"""What the add-on says at run time goes through translation, and has German where the panel and its buttons say it."""

from __future__ import annotations

import ast
import re
import string

import pytest

from mfo_backend.types.verdict import Cause, Judgement, Verdict

from .run_time_sentences import ADDON, run_time_sentences

TRANSLATED = ("panel", "check", "operators", "running")  # what exports and the backend note stays English as yet


@pytest.fixture
def german(addon: object):
    from blender_addon.sentences.german import GERMAN

    return GERMAN


def in_german(text: str) -> str:
    from blender_addon.sentences.translated import in_language

    return in_language("de_DE", text)


def test_every_sentence_of_panel_check_and_buttons_has_german(german) -> None:
    found = run_time_sentences(TRANSLATED)
    assert len(found) > 120
    unknown = {s for s in found if s not in german and in_german(s.replace("{}", "X")) == s.replace("{}", "X")}
    missing = sorted(s for s in unknown if not s.startswith("{}."))
    assert missing == [], "no German: add them to sentences/german.py"


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
    assert in_language("fr_FR", "Ready") == "Ready"


def test_translations_put_in_what_the_english_ones_do(german) -> None:
    for english, words in german.items():
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
