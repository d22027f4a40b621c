# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences in the language of the interface, found by pattern where they reach the user.

Code makes its sentences in English, whoever reads them: a log, a script, another process. What the panel and the
reports show goes through `translated`, which knows a sentence by its words and puts the names and numbers of the
English one into the other. What no pattern knows stays English.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import bpy

from .languages import FOLDERS

_PARTS = re.compile(r"(?<=[.:]) (?=[A-Z'0-9])")  # between two sentences
_LIST = re.compile(r"(, | and | or |; )")  # between the names of a list


@dataclass(frozen=True, eq=False)
class Language:
    """Sentences by their English ones, and the words between the names of a list."""

    sentences: Mapping[str, str]
    joints: Mapping[str, str]

    @cached_property
    def patterns(self) -> list[tuple[re.Pattern[str], str]]:
        """The entries with something put in, those with most words of their own first."""
        holding = [english for english in self.sentences if "{}" in english]
        holding.sort(key=lambda english: len(english.replace("{}", "")), reverse=True)
        return [
            (re.compile("(.+?)".join(map(re.escape, english.split("{}"))), re.DOTALL), english) for english in holding
        ]


LANGUAGES = {code: Language(folder.SENTENCES, folder.JOINTS) for code, folder in FOLDERS.items()}
# headings are too plain to be looked for in other texts
_REPORTS = {code: Language(folder.SENTENCES | folder.REPORT, folder.JOINTS) for code, folder in FOLDERS.items()}


def translated(text: str) -> str:
    """The text in the interface's language, or as it is."""
    return in_language(_language(), text) if _is_wanted() else text


def word(text: str, context: str = "*") -> str:
    """A label as Blender shows it: names of operators have the context Operator, other labels none."""
    return bpy.app.translations.pgettext_iface(text, context)


def report_language() -> str:
    """The language that reports are shown in, as `de`; empty for English."""
    code = _code(_language()) if _is_wanted() else ""
    return code if code in _REPORTS else ""


def in_report(language: str, text: str) -> str:
    """A text of a report in a language."""
    return _said(_REPORTS[language], text)


def in_language(language: str, text: str) -> str:
    """The text in a language, called as Blender does (`de_DE`)."""
    known = LANGUAGES.get(_code(language))
    return text if known is None else _said(known, text)


def _is_wanted() -> bool:
    return bpy.context.preferences.view.use_translate_interface or bpy.app.background


def _language() -> str:
    return bpy.app.translations.locale


def _code(language: str) -> str:
    """Blender 4.2 says `de`, 4.3 and later `de_DE`."""
    return language.partition("_")[0]


@lru_cache(maxsize=2048)
def _said(language: Language, text: str) -> str:
    """The text; where it is not known as a whole, by as many sentences at a time as are known."""
    if not text:
        return text
    parts, said, begin = _PARTS.split(text), [], 0
    while begin < len(parts):
        ends = range(len(parts), begin, -1)
        known = ((end, _known(language, " ".join(parts[begin:end]))) for end in ends)
        begin, words = next(((end, words) for end, words in known if words is not None), (begin + 1, parts[begin]))
        said.append(words)
    return " ".join(said)


def _known(language: Language, text: str) -> str | None:
    table = language.sentences
    if text in table:
        return table[text]
    for pattern, english in language.patterns:
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


def _put_in(language: Language, words: str) -> str:
    """What is put into a sentence: another sentence, words that are known, or a list of these and of sockets' names."""
    parts = _LIST.split(words)
    known = [language.joints.get(part, part) if i % 2 else _known(language, part) for i, part in enumerate(parts)]
    if None in known and (whole := _said(language, words)) != words:
        return whole
    names = bpy.app.translations.pgettext_iface  # sockets are called as Blender shows them
    return "".join(names(part) if said is None else said for part, said in zip(parts, known, strict=True))
