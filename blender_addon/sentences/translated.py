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

LANGUAGES: dict[str, Mapping[str, str]] = {"de_DE": GERMAN, "de": GERMAN}  # a language is one folder
_PARTS = re.compile(r"(?<=[.:]) (?=[A-Z'0-9])")  # between two sentences
_LIST = re.compile(r"(, | and | or |; )")  # between the names of a list
_GERMAN_JOINTS = {" and ": " und ", " or ": " oder "}
_JOINTS = {"de_DE": _GERMAN_JOINTS, "de": _GERMAN_JOINTS}


def translated(text: str) -> str:
    """The text in the interface's language, or as it is."""
    if not bpy.context.preferences.view.use_translate_interface and not bpy.app.background:
        return text
    return in_language(_language(), text)


def _language() -> str:
    return bpy.app.translations.locale


@lru_cache(maxsize=1024)
def in_language(language: str, text: str) -> str:
    """The text in a language; where it is not known as a whole, by as many sentences at a time as are known."""
    if language not in LANGUAGES or not text:
        return text
    parts, said, begin = _PARTS.split(text), [], 0
    while begin < len(parts):
        ends = range(len(parts), begin, -1)
        known = ((end, _known(language, " ".join(parts[begin:end]))) for end in ends)
        begin, words = next(((end, words) for end, words in known if words is not None), (begin + 1, parts[begin]))
        said.append(words)
    return " ".join(said)


def _known(language: str, text: str) -> str | None:
    table = LANGUAGES[language]
    if text in table:
        return table[text]
    for pattern, english in _patterns(language):
        found = pattern.fullmatch(text)
        if found is None or (english.endswith("{}") and text.endswith(".") and not _ends_in_sentence(english)):
            continue  # a button's words, not the beginning of a sentence
        quoted = [before.endswith("'") for before in english.split("{}")]
        found_words = zip(found.groups(), quoted, strict=False)  # after the last one nothing is put in
        inner = (words if is_name else _put_in(language, words) for words, is_name in found_words)
        return table[english].format(*inner)
    return None


def _ends_in_sentence(english: str) -> bool:
    """Whether what is put in at the end is a sentence of its own."""
    return english.endswith((": {}", ". {}"))


def _put_in(language: str, words: str) -> str:
    """What is put into a sentence: another sentence, words that are known, or a list of these and of sockets' names."""
    parts, joints = _LIST.split(words), _JOINTS.get(language, {})
    known = [joints.get(part, part) if i % 2 else _known(language, part) for i, part in enumerate(parts)]
    if None in known and (whole := in_language(language, words)) != words:
        return whole
    names = bpy.app.translations.pgettext_iface  # sockets are called as Blender shows them
    return "".join(names(part) if said is None else said for part, said in zip(parts, known, strict=True))


@lru_cache(maxsize=4)
def _patterns(language: str) -> list[tuple[re.Pattern[str], str]]:
    """The entries with something put in, those with most words of their own first."""
    holding = [english for english in LANGUAGES[language] if "{}" in english]
    holding.sort(key=lambda english: len(english.replace("{}", "")), reverse=True)
    return [(re.compile("(.+?)".join(map(re.escape, english.split("{}"))), re.DOTALL), english) for english in holding]
