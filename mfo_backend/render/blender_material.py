# SPDX-License-Identifier: Apache-2.0
"""A scene whose Principled materials are Blender's own: the plugin takes the place of Mitsuba's `principled`."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

from ..material.blender_selection import select_blender_parameters
from ..material.principled_dict import blender_principled_dict
from ..material.principled_parameters import PARAMETER_OF_SOCKET
from ..scene.scene_xml import Element, Target
from ..types.errors import BadInputError
from .prepared_material import Materials, PreparedMaterial

_DEFAULT_VERSION = (5, 0)


def prepare_blender_principled(
    scene: Element, target: Target, selection: str | Sequence[str], materials: Materials
) -> PreparedMaterial:
    """Replace every BSDF of the scene that `materials` describes by `blender_principled` with Blender's socket values.

    Entries of `materials` are those of request.json; `blender_version` may be added to each, and the `texture` of a
    socket is an absolute path.

    Raises
    ------
    BadInputError
        If the target's material is not among `materials`, or a socket or parameter cannot be used.
    """
    if target.bsdf_id not in materials:
        raise BadInputError(
            f"Model 'blender_principled' needs Blender's socket values for material {target.bsdf_id!r} and the job "
            "holds none: export it from Blender, or fit 'mitsuba_principled'."
        )
    sockets = materials[target.bsdf_id]["sockets"]
    values = {PARAMETER_OF_SOCKET[n]: _value(s["value"]) for n, s in sockets.items() if n in PARAMETER_OF_SOCKET}
    linked = [PARAMETER_OF_SOCKET[n] for n, s in sockets.items() if s.get("linked") and n in PARAMETER_OF_SOCKET]
    present = [name for name, value in values.items() if value != 0.0]
    table = select_blender_parameters(selection, present=present, linked=linked)
    start = table.clip(table.pack({name: value for name, value in values.items() if value is not None}))
    for element in scene.findall("bsdf"):
        identifier = element.get("id", "")
        if identifier in materials:
            free = table.names if identifier == target.bsdf_id else ()
            _rewrite(element, materials[identifier], free)
    inner = Target(target.shape_id, target.bsdf_id, target.outer, target.outer)
    # A free value has to be in the scene even where it is at its default
    for name, value in table.unpack(start).items():
        _replace(target.outer, name, _constant(name, value))
    return PreparedMaterial(table, start, inner, {name: name for name in table.names}, plugin="blender_principled")


def _rewrite(element: Element, material: Mapping[str, Any], free: Sequence[str]) -> None:
    """Turn a BSDF element into `blender_principled`, keeping the id and the texture elements it holds."""
    properties = blender_principled_dict(
        material["sockets"],
        distribution=material.get("distribution", "MULTI_GGX"),
        version=material.get("blender_version", _DEFAULT_VERSION),
        free=free,
    )
    # the scene's own texture elements know wrapping, filter and placement; the request knows the file alone
    textures = {_filename(t): copy.deepcopy(t) for t in element.iter("texture")}
    identifier = element.get("id", "")
    element.clear()
    element.attrib.update({"type": properties.pop("type"), "id": identifier})
    for name, value in properties.items():
        if isinstance(value, Mapping) and value["type"] == "bitmap":
            texture = textures.get(value["filename"]) or _bitmap(value["filename"])
            texture.set("name", name)
            element.append(texture)
        elif isinstance(value, str):
            ElementTree.SubElement(element, "string", name=name, value=value)
        else:
            element.append(_constant(name, tuple(value["value"]) if isinstance(value, Mapping) else value))


def _replace(element: Element, name: str, child: Element) -> None:
    for old in element.findall(f"*[@name='{name}']"):
        element.remove(old)
    element.append(child)


def _constant(name: str, value: float | tuple[float, ...]) -> Element:
    if isinstance(value, tuple):
        return ElementTree.Element("rgb", name=name, value=", ".join(map(repr, value)))
    return ElementTree.Element("float", name=name, value=repr(float(value)))


def _bitmap(filename: str) -> Element:
    texture = ElementTree.Element("texture", type="bitmap")
    ElementTree.SubElement(texture, "string", name="filename", value=filename)
    ElementTree.SubElement(texture, "boolean", name="raw", value="true")
    return texture


def _filename(texture: Element) -> str:
    return next((s.get("value", "") for s in texture.findall("string") if s.get("name") == "filename"), "")


def _value(value: Any) -> Any:
    """A socket value as a table packs it."""
    return tuple(map(float, value)) if isinstance(value, Sequence) else value
