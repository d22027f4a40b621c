# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a fit in the user's language: the backend writes it in English, and here its texts are looked up."""

from __future__ import annotations

import os
import re
import tempfile
from contextlib import suppress
from html import escape, unescape
from pathlib import Path

import bpy

from ..sentences.translated import in_report, report_language

_TAG = re.compile(r"(<style>.*?</style>|<[^>]*>)", re.DOTALL)
_NAMED = re.compile(r'(alt|aria-label)="([^"]*)"')
_MARKED = re.compile(r"([\s,✓○]*)(.*?)([\s,]*)", re.DOTALL)  # marks around a text are no part of it
_BOUNDS = re.compile(r"(\S+) to (\S+)")
_VALUE_LINE = re.compile(r"([^:]+): ([^()]+?)(?: \((.+)\))?")


def shown_report(page: Path) -> Path:
    """Write the page's copy in the user's language beside it, with those below it that it leads to; returns the copy.

    The page itself where the language has no table or the folder cannot be written.
    """
    code = report_language()
    if not code:
        return page
    for below in (*page.parent.glob("*/*/index.html"), *page.parent.glob("*/index.html")):
        with suppress(OSError, UnicodeDecodeError):
            _write_copy(below, code)
    with suppress(OSError, UnicodeDecodeError):
        return _write_copy(page, code)
    return page


def page_in_language(page: str, code: str) -> str:
    """The page with its texts in a language; tags and pictures stay as they are."""
    parts = _TAG.split(page)
    inside = ""
    for i, part in enumerate(parts):
        if i % 2:
            inside = part
            parts[i] = _NAMED.sub(lambda found: f'{found[1]}="{_each_part(found[2], code)}"', part)
            parts[i] = parts[i].replace('/index.html"', f'/index.{code}.html"')
        elif part.strip():
            said = _lines(unescape(part), code) if inside == "<pre>" else _said(unescape(part), code)
            parts[i] = escape(said, quote=False)
    return "".join(parts).replace('<html lang="en">', f'<html lang="{code}">', 1)


def _said(text: str, code: str) -> str:
    """A text of the page; a socket is called as Blender shows it."""
    found = _MARKED.fullmatch(text)
    if found is None:
        return text
    lead, words, tail = found.groups()
    if bounds := _BOUNDS.fullmatch(words):
        words = f"{bounds[1]} {in_report(code, 'to')} {bounds[2]}"
    else:
        words = " ±".join(_named(part, code) for part in words.split(" ±"))
    return f"{lead}{words}{tail}"


def _named(words: str, code: str) -> str:
    said = in_report(code, words)
    return said if said != words else bpy.app.translations.pgettext_iface(words)


def _each_part(text: str, code: str) -> str:
    return escape(": ".join(_named(part, code) for part in unescape(text).split(": ")))


def _lines(text: str, code: str) -> str:
    """Verdict and values as text: a sentence, then a line for each value."""
    first, *lines = text.split("\n")
    said = [_said(first, code)]
    for line in lines:
        found = _VALUE_LINE.fullmatch(line)
        words = "" if found is None or found[3] is None else f" ({_named(found[3], code)})"
        said.append(line if found is None else f"{_named(found[1], code)}: {found[2]}{words}")
    return "\n".join(said)


def _write_copy(page: Path, code: str) -> Path:
    """Written by rename, so that a link of that name in a folder from a stranger is replaced, not followed."""
    text, copy = page_in_language(page.read_text("utf-8"), code), page.with_suffix(f".{code}.html")
    handle, name = tempfile.mkstemp(dir=page.parent, suffix=".tmp")
    with open(handle, "w", encoding="utf-8") as file:
        file.write(text)
    os.replace(name, copy)
    return copy
