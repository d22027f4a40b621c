# SPDX-License-Identifier: Apache-2.0
"""Scenes whose materials are Blender's Principled BSDF as Cycles evaluates it (our Mitsuba plugin)."""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping, Sequence
from pathlib import PurePosixPath
from typing import Any
from xml.etree import ElementTree

from ..material.principled_dict import blender_principled_dict
from ..material.principled_parameters import BLENDER_PRINCIPLED, PARAMETER_OF_SOCKET, SOCKET_OF_PARAMETER
from ..scene.scene_xml import Element, Target
from ..types.errors import BadInputError
from ..types.parameter import ParameterTable, Value
from .prepared_material import Materials, PreparedMaterial

REDUCED = ("base_color", "metallic", "roughness", "specular_ior_level")
# `all` leaves out what an ordinary material does not show: these only where the second name differs from its default
_ONLY_WITH = {
    "ior": "transmission_weight",
    "transmission_weight": "transmission_weight",
    "alpha": "alpha",
    "anisotropic_rotation": "anisotropic",
    "subsurface_weight": "subsurface_weight",
    "thin_film_thickness": "thin_film_thickness",
    "thin_film_ior": "thin_film_thickness",
}
SOCKETS = frozenset(PARAMETER_OF_SOCKET)
_NEVER = ("emission_color", "emission_strength")  # a Mitsuba BSDF cannot emit; the scene has emitters for it


def prepare_blender_principled(
    scene: Element, target: Target, selection: str | Sequence[str], materials: Materials
) -> PreparedMaterial:
    """Replace every BSDF that `materials` describes by sockets, wrappers included; the target's opens `selection`.

    Raises
    ------
    BadInputError
        If the sockets of the target are not given, or a parameter cannot be fitted.
    """
    if target.bsdf_id not in materials:
        known = ", ".join(map(repr, materials)) or "none"
        raise BadInputError(
            f"Material {target.bsdf_id!r} has no sockets for model 'blender_principled' (given: {known}): "
            "export the scene from Blender or choose 'mitsuba_principled'."
        )
    sockets = materials[target.bsdf_id]["sockets"]
    linked = {PARAMETER_OF_SOCKET[name] for name, socket in sockets.items() if socket.get("linked") and name in SOCKETS}
    table = _select(selection, _constants(sockets), linked)
    start = table.clip(table.pack(_constants(sockets)))
    opened = {SOCKET_OF_PARAMETER[name]: {"value": value} for name, value in table.unpack(start).items()}
    textures = _textures(scene)
    for bsdf in scene.findall("bsdf"):
        bsdf_id = bsdf.get("id", "")
        if bsdf_id not in materials:
            continue
        free = table.names if bsdf_id == target.bsdf_id else ()
        described = dict(materials[bsdf_id]["sockets"]) | (opened if free else {})
        properties = blender_principled_dict(
            described, distribution=materials[bsdf_id].get("distribution", "MULTI_GGX"), free=free
        )
        _rewrite(bsdf, bsdf_id, properties, textures)
    outer = target.outer
    return PreparedMaterial(
        table, start, Target(target.shape_id, target.bsdf_id, outer, outer), {name: name for name in table.names}
    )


def _constants(sockets: Mapping[str, Mapping[str, Any]]) -> dict[str, Value]:
    values: dict[str, Value] = {}
    for socket, content in sockets.items():
        if socket in SOCKETS and content.get("value") is not None:
            value = content["value"]
            values[PARAMETER_OF_SOCKET[socket]] = tuple(value) if isinstance(value, Sequence) else float(value)
    return values


def _select(selection: str | Sequence[str], values: Mapping[str, Value], linked: Collection[str]) -> ParameterTable:
    if not isinstance(selection, str):
        for name in selection:
            if name in linked:
                raise BadInputError(f"Parameter {name!r} is linked to a texture: unlink it or leave it out.")
            if name in _NEVER:
                raise BadInputError(f"Parameter {name!r} cannot be fitted: emission comes from the scene's lights.")
        return BLENDER_PRINCIPLED.select(selection)
    if selection not in ("all", "reduced"):
        raise BadInputError(
            f'Unknown parameter set {selection!r}: give "all", "reduced" or names of '
            f"{', '.join(BLENDER_PRINCIPLED.names)}."
        )
    shown = {name for name in BLENDER_PRINCIPLED.names if _is_set(name, values)} | set(linked)
    wanted = REDUCED if selection == "reduced" else BLENDER_PRINCIPLED.names
    return BLENDER_PRINCIPLED.select(
        name
        for name in wanted
        if name not in linked and name not in _NEVER and (name not in _ONLY_WITH or _ONLY_WITH[name] in shown)
    )


def _is_set(name: str, values: Mapping[str, Value]) -> bool:
    default = BLENDER_PRINCIPLED[name].default
    return values.get(name, default) != default


def _textures(scene: Element) -> dict[str, Element]:
    """Bitmap textures of the scene by file name, with the UV transform the exporter gave them."""
    found = {}
    for texture in scene.iter("texture"):
        for child in texture.findall("string"):
            if child.get("name") == "filename":
                found[PurePosixPath(child.get("value", "").replace("\\", "/")).name] = texture
    return found


def _rewrite(bsdf: Element, bsdf_id: str, properties: Mapping[str, Any], textures: Mapping[str, Element]) -> None:
    for child in list(bsdf):
        bsdf.remove(child)
    bsdf.attrib.clear()
    bsdf.attrib.update({"type": str(properties["type"]), "id": bsdf_id})
    for name, value in properties.items():
        if name == "type":
            continue
        if isinstance(value, str):
            ElementTree.SubElement(bsdf, "string", name=name, value=value)
        elif isinstance(value, Mapping) and value["type"] == "rgb":
            ElementTree.SubElement(bsdf, "rgb", name=name, value=", ".join(map(repr, value["value"])))
        elif isinstance(value, Mapping):
            file = PurePosixPath(value["filename"]).name
            if file not in textures:
                raise BadInputError(f"The scene has no texture {value['filename']!r} of {name!r}: export it again.")
            texture = copy.deepcopy(textures[file])
            texture.attrib.pop("id", None)
            texture.set("name", name)
            bsdf.append(texture)
        else:
            ElementTree.SubElement(bsdf, "float", name=name, value=repr(float(value)))
