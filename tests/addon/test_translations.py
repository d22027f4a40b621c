# SPDX-License-Identifier: Apache-2.0
"""Every text the add-on shows has an entry in each complete language, none is stale there, and Blender finds them."""

from __future__ import annotations

import pytest

from .sentences.languages import COMPLETE
from .shown_messages import shown_messages


def test_shown_messages_are_found() -> None:
    found = shown_messages()
    assert ("Operator", "Fit Material") in found
    assert ("*", "Balanced") in found  # an item of an enumeration
    assert ("*", "Backend: ready") in found
    assert ("*", "Select an object") in found
    assert ("Operator", "Install Again") in found  # one of two texts of a condition
    assert len(found) > 100


def test_each_complete_language_has_every_message_and_no_other(addon: object) -> None:
    from blender_addon.translations import CONTEXT, LANGUAGES

    shown = shown_messages()
    for language in COMPLETE:
        entries = {key: text for key, text in LANGUAGES[language].items() if key[0] != CONTEXT}
        assert sorted(shown - set(entries)) == [], f"not in {language}: add them to labels.py of sentences/"
        assert sorted(set(entries) - shown) == [], f"shown nowhere any more: drop them from {language}"


def test_entries_end_as_the_english_ones(addon: object) -> None:
    from blender_addon.translations import LANGUAGES

    for entries in LANGUAGES.values():
        assert all(text.strip() == text and text for text in entries.values())
        for (_, english), text in entries.items():
            assert english.endswith(".") == text.endswith("."), english


def test_blender_finds_them(addon: object) -> None:
    import bpy

    view = bpy.context.preferences.view
    language = next((n for n in ("de_DE", "de") if n in bpy.app.translations.locales), None)
    if language is None:
        pytest.skip("this Blender has no German")
    before = view.language
    try:
        view.language = language
        assert bpy.app.translations.pgettext("Fit Material", "Operator") == "Material anpassen"
        assert bpy.app.translations.pgettext("Backend: ready") == "Backend: bereit"
    finally:
        view.language = before
    assert bpy.app.translations.pgettext("Fit Material", "Operator") == "Fit Material"
