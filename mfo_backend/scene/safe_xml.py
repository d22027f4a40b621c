# SPDX-License-Identifier: Apache-2.0
"""XML from a stranger: no document type (entities, external files), bounded size and depth, before a tree is built."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from ..types.errors import BadInputError

Element = ElementTree.Element
LARGEST_FILE = 2**26  # bytes; a scene of 10,000 shapes takes 3 MB
DEEPEST = 64  # elements inside each other; a scene has five, and Mitsuba's own reader recurses without a limit


def parse_xml(path: Path) -> Element:
    """The root element of an XML file.

    Raises
    ------
    BadInputError
        If the file cannot be read, is not XML, is too large or too deep, or has a document type.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        raise BadInputError(f"Cannot read the scene {path}: {getattr(error, 'strerror', None) or error}.") from None
    if len(data) > LARGEST_FILE:
        raise BadInputError(f"{path.name} is larger than {LARGEST_FILE >> 20} MB: put meshes into files of their own.")
    parser = ElementTree.XMLParser(target=_Builder(path.name))
    try:
        parser.feed(data)
        return parser.close()
    # an encoding that Python does not know is a LookupError, one of several bytes a ValueError
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise BadInputError(f"{path.name} is not XML ({error}): give a Mitsuba 3 scene file.") from None


class _Builder(ElementTree.TreeBuilder):
    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name
        self._depth = 0

    def start(self, tag: str, attributes: dict[str, str], /) -> Element:
        self._depth += 1
        if self._depth > DEEPEST:
            raise BadInputError(f"{self._name} has elements more than {DEEPEST} deep: give a Mitsuba 3 scene file.")
        return super().start(tag, attributes)

    def end(self, tag: str, /) -> Element:
        self._depth -= 1
        return super().end(tag)

    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        """Called before anything the document type declares is used."""
        raise BadInputError(f"{self._name} has a document type (<!DOCTYPE {name}>): remove it, scenes need none.")
