# SPDX-License-Identifier: GPL-3.0-or-later
"""Mitsuba's XML format: small functions that build elements, and the text of a whole scene."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

Element = ElementTree.Element
FORMAT_VERSION = "3.0.0"


class NotFiniteError(ValueError):
    """A number is NaN or infinite, which a scene file cannot hold."""


def number(value: float) -> str:
    """Write a float so that reading it back gives the same float32.

    Raises
    ------
    NotFiniteError
        If it is NaN or infinite.
    """
    if not math.isfinite(value):
        raise NotFiniteError(f"{value} cannot be written to a scene file; numbers must be finite")
    return format(float(value), ".9g")


def plugin(tag: str, plugin_type: str, identifier: str = "", name: str = "") -> Element:
    """Make `<tag type=plugin_type id=identifier name=name>`, without the attributes that are empty."""
    element = Element(tag, {"type": plugin_type})
    if identifier:
        element.set("id", identifier)
    if name:
        element.set("name", name)
    return element


def add(parent: Element, *children: Element) -> Element:
    """Append `children` to `parent` and return `parent`."""
    parent.extend(children)
    return parent


def scalar(name: str, value: float) -> Element:
    """A `<float>`."""
    return Element("float", {"name": name, "value": number(value)})


def integer(name: str, value: int) -> Element:
    """An `<integer>`."""
    return Element("integer", {"name": name, "value": str(int(value))})


def boolean(name: str, value: bool) -> Element:
    """A `<boolean>`."""
    return Element("boolean", {"name": name, "value": "true" if value else "false"})


def string(name: str, value: str) -> Element:
    """A `<string>`."""
    return Element("string", {"name": name, "value": value})


def rgb(name: str, value: Iterable[float]) -> Element:
    """An `<rgb>` of three linear Rec.709 numbers."""
    return Element("rgb", {"name": name, "value": ", ".join(number(component) for component in value)})


def reference(identifier: str, name: str = "") -> Element:
    """A `<ref>` to the object called `identifier`."""
    element = Element("ref", {"id": identifier})
    if name:
        element.set("name", name)
    return element


def transform(name: str, matrix: ArrayLike) -> Element:
    """A `<transform>` that holds one 4x4 matrix (column vectors, as Blender writes them)."""
    values = np.asarray(matrix, dtype=np.float64).reshape(16)
    element = Element("transform", {"name": name})
    ElementTree.SubElement(element, "matrix", {"value": " ".join(number(value) for value in values)})
    return element


def bitmap(
    name: str, path: str, *, raw: bool = True, extension: str = "repeat", filter_type: str = "bilinear"
) -> Element:
    """A bitmap texture; `raw` values are used as they are, without conversion from sRGB."""
    return add(
        plugin("texture", "bitmap", name=name),
        string("filename", path),
        boolean("raw", raw),
        string("wrap_mode", extension),
        string("filter_type", filter_type),
    )


def scene_text(children: Sequence[Element]) -> str:
    """Return the whole scene file."""
    root = add(Element("scene", {"version": FORMAT_VERSION}), *children)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
