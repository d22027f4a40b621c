# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's texts in other languages, for `bpy.app.translations`; a test holds them against what is shown.

Blender looks up what it draws: labels, names, tooltips; sentences put together at run time are in `sentences`, which
has a folder for each language.
"""

from __future__ import annotations

from collections.abc import Mapping

import bpy

from .sentences.languages import FOLDERS

CONTEXT = "Material Fit"  # of names that Blender's own languages have as other words: Fast as "Einfügen"
_IN_CONTEXT = ("Preset", "Balanced", "Best", "Fast", "Paper", "Fit", "History")


def _entries(labels: Mapping[str, str], operators: Mapping[str, str]) -> dict[tuple[str, str], str]:
    """By context and English text, as Blender wants them."""
    return {
        **{("*", text): words for text, words in labels.items()},
        **{("Operator", text): words for text, words in operators.items()},
        **{(CONTEXT, text): labels[text] for text in _IN_CONTEXT},
    }


LANGUAGES = {
    locale: _entries(folder.LABELS, folder.OPERATORS) for folder in FOLDERS.values() for locale in folder.LOCALES
}


def register() -> None:
    """Hand the texts to Blender."""
    bpy.app.translations.register(__name__, LANGUAGES)


def unregister() -> None:
    """Take them away again."""
    bpy.app.translations.unregister(__name__)
