# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences in the language of the interface, found by pattern where they reach the user.

Code makes its sentences in English, whoever reads them: a log, a script, another process. What the panel and the
reports show goes through `translated`, which knows a sentence by its words and puts the names and numbers of the
English one into the other. What no pattern knows stays English.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache

import bpy

from .german import GERMAN

LANGUAGES: dict[str, Mapping[str, str]] = {"de_DE": GERMAN, "de": GERMAN}  # a language is one file
_PARTS = re.compile(r"(?<=[.:]) (?=[A-Z'0-9])")  # between two sentences


def translated(text: str) -> str:
    """The text in the interface's language, or as it is."""
    if not bpy.context.preferences.view.use_translate_interface and not bpy.app.background:
        return text
    return in_language(bpy.app.translations.locale, text)


@lru_cache(maxsize=1024)
def in_language(language: str, text: str) -> str:
    """The text in a language, sentence by sentence where it is not known as a whole."""
    if language not in LANGUAGES or not text:
        return text
    whole = _known(language, text)
    if whole is not None:
        return whole
    parts = [_known(language, part) or part for part in _PARTS.split(text)]
    return " ".join(parts)


def _known(language: str, text: str) -> str | None:
    table = LANGUAGES[language]
    if text in table:
        return table[text]
    for pattern, english in _patterns(language):
        found = pattern.fullmatch(text)
        if found is None or (english.endswith("{}") and text.endswith(".")):
            continue  # a button's words, not the beginning of a sentence
        inner = (table.get(words, words) for words in found.groups())
        return table[english].format(*inner)
    return None


@lru_cache(maxsize=4)
def _patterns(language: str) -> list[tuple[re.Pattern[str], str]]:
    """The entries with something put in, those with most words of their own first."""
    holding = [english for english in LANGUAGES[language] if "{}" in english]
    holding.sort(key=lambda english: len(english.replace("{}", "")), reverse=True)
    return [(re.compile("(.+?)".join(map(re.escape, english.split("{}"))), re.DOTALL), english) for english in holding]
