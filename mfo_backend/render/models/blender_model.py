# SPDX-License-Identifier: Apache-2.0
"""Scenes whose materials are Blender's Principled BSDF as Cycles evaluates it (our Mitsuba plugin)."""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePosixPath
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ...material.principled.blender_selection import PLAIN, TIMES, select_blender_parameters
from ...material.principled.mix_values import mix_values
from ...material.principled.principled_dict import (
    blender_principled_dict,
    closure_tree_dict,
    emits_by_place,
    is_mixed,
    socket_value,
)
from ...material.principled.principled_parameters import PARAMETER_OF_SOCKET, SOCKET_OF_PARAMETER
from ...scene.scene_xml import Element, Target
from ...types.errors import BadInputError
from ...types.parameter import ParameterTable, Value
from .prepared_material import Materials, PreparedMaterial

# How far light may go below a surface, of a fit: so many times less or more than the least or largest radius of the
# scene, for walks that were made for that tell of it. From four times too small a red radius was found
# (docs/notebook/subsurface.md). Larger: not tried
WALKS_NEAR = 5.0
# Density of a volume and the strength of a glow: at most so many times that of the scene, for both may be any number
DENSITY = "absorption_density"
STRENGTH = "emission_strength"
GLOW = {"emission_color", STRENGTH}
WALK_SIZES, LEAST_SIZE = ("subsurface_radius", "subsurface_scale"), 1e-4
# Of refraction, any number above 0 in Blender: a bubble's in water is below 1, and a canopy had 3.3
INDICES = ("ior", "coat_ior", "thin_film_ior")
LEAST_INDEX = 0.1  # every ray but a straight one is mirrored. No measurement
SOCKETS = frozenset(PARAMETER_OF_SOCKET)
_VERSION = (5, 0)  # of a job that does not say which Blender it comes from


Opened = tuple[Target, ParameterTable, NDArray[np.float64]]  # a target, what is free of it, and the values in the scene


def prepare_blender_principled(
    scene: Element, target: Target, selection: str | Sequence[str], materials: Materials
) -> PreparedMaterial:
    """`prepare_several_blender_principled` of one target."""
    return prepare_several_blender_principled(scene, [(target, selection)], materials)[0]


def prepare_several_blender_principled(
    scene: Element, targets: Sequence[tuple[Target, str | Sequence[str]]], materials: Materials
) -> list[PreparedMaterial]:
    """Replace every BSDF that `materials` describes by sockets, wrappers included; each target's opens its selection.

    Entries of `materials` are those of request.json; `blender_version` and `film_exposure` may be added to each, and
    the `texture` of a socket is an absolute path.

    Raises
    ------
    BadInputError
        If the sockets of a target are not given, or a parameter cannot be fitted.
    """
    opened = {target.bsdf_id: _opened(target, selection, materials) for target, selection in targets}
    textures = _textures(scene)
    for bsdf in scene.findall("bsdf"):
        bsdf_id = bsdf.get("id", "")
        if bsdf_id in materials:
            table = opened[bsdf_id][1] if bsdf_id in opened else None
            start = {} if table is None else table.unpack(opened[bsdf_id][2])
            _put_material(scene, bsdf, materials[bsdf_id], start, textures)
    _put_normal_maps(scene, materials)
    return [_prepared(*found, materials[bsdf_id]) for bsdf_id, found in opened.items()]


def _put_normal_maps(scene: Element, materials: Materials) -> None:
    """Give Blender's shaders below a `normalmap` its normals, which they treat as Cycles does.

    Those of a displacement by bump are the surface's: no bump lies on it, and shadow rays start by them.
    """
    by_id = {bsdf.get("id"): bsdf for bsdf in scene.findall("bsdf")}
    for bsdf in by_id.values():
        nested, normals = bsdf.find("ref"), bsdf.find("texture")
        below = by_id.get(nested.get("id")) if nested is not None else None
        if bsdf.get("type") != "normalmap" or normals is None or below is None:
            continue
        if below.get("type") != "blender_principled":
            continue
        bsdf.attrib["type"] = "blender_principled"
        for child in list(bsdf):
            bsdf.remove(child)
        bsdf.extend(copy.deepcopy(child) for child in below)
        content = materials.get(below.get("id", ""), {})
        name = "shading_normal" if content.get("displaced") else "normal"
        normals.attrib["name"] = "map"
        _add_mapped_normal(bsdf, name, normals, turned=bool(content.get("turned")))


def _opened(target: Target, selection: str | Sequence[str], materials: Materials) -> Opened:
    """What a selection opens of a target, and its values in the scene, moved into the bounds."""
    if target.bsdf_id not in materials:
        known = ", ".join(map(repr, materials)) or "none"
        raise BadInputError(
            f"Material {target.bsdf_id!r} has no sockets for model 'blender_principled' (given: {known}): "
            "export the scene from Blender or choose 'mitsuba_principled'."
        )
    sockets = materials[target.bsdf_id]["sockets"]
    linked = {PARAMETER_OF_SOCKET[name] for name, socket in sockets.items() if socket.get("linked") and name in SOCKETS}
    held = TIMES if is_mixed(materials[target.bsdf_id]) else ()  # a mix's glow is a picture of all its shaders
    shown = {name for name, value in _constants(sockets).items() if value != PLAIN.get(name, 0.0)}
    # values inside nodes may be all that is fitted
    nothing = not isinstance(selection, str) and not selection
    chosen = None if nothing else select_blender_parameters(selection, present=shown.difference(held), linked=linked)
    table = ParameterTable(()) if chosen is None else _labelled(chosen, materials[target.bsdf_id])
    table = _around_own(table, _constants(sockets), WALK_SIZES, (STRENGTH,))
    start = table.clip(table.pack(_constants(sockets)))
    return target, table, start


def _around_own(
    table: ParameterTable,
    values: Mapping[str, Value],
    sizes: Collection[str],
    strengths: Collection[str],
    indices: Collection[str] = INDICES,
) -> ParameterTable:
    """With bounds of these `sizes` around those in the scene, for which light below the surface is recorded, of the
    `strengths` of glows, and of `indices` that no usual surface has."""
    near = []
    for p in table:
        if p.name == DENSITY and values.get(DENSITY):
            p = replace(p, upper=float(np.ravel(values[DENSITY])[0]) * WALKS_NEAR)
        if p.name in strengths:
            p = replace(p, upper=(float(np.ravel(values.get(p.name, 0.0))[0]) or 1.0) * WALKS_NEAR)
        if p.name in indices:
            index = float(np.ravel(values.get(p.name, p.default))[0])
            if index < 1.0:  # which has no gradient, so that neither side leads to the other
                p = replace(p, lower=max(min(1.0 / p.upper, index), LEAST_INDEX), upper=1.0 / p.lower)
            p = replace(p, upper=max(p.upper, index))
        if p.name in sizes:
            present = np.maximum(np.ravel(values.get(p.name, p.default)), LEAST_SIZE)
            begin = tuple(float(v) for v in present) if p.size == 3 else float(present[0])
            lower, upper = float(present.min()) / WALKS_NEAR, float(present.max()) * WALKS_NEAR
            p = replace(p, lower=lower, upper=upper, begin=begin)
        near.append(p)
    return ParameterTable(near)


def _labelled(table: ParameterTable, material: Mapping[str, Any]) -> ParameterTable:
    """With what the fitted node calls its values; that of a mix has its name before."""
    labels = material.get("labels", {})
    prefix = f"{material['node']}/" if material.get("node") and is_mixed(material) else ""
    named = prefix or labels
    return ParameterTable(replace(p, label=f"{prefix}{labels.get(p.name, p.shown)}" if named else "") for p in table)


def _put_material(
    scene: Element,
    bsdf: Element,
    material: Mapping[str, Any],
    start: Mapping[str, Value],
    textures: Mapping[str, Element],
) -> None:
    """Make a BSDF the plugin of a material; what has a `start` is open to change."""
    bsdf_id, version = bsdf.get("id", ""), material.get("blender_version", _VERSION)
    opened = {SOCKET_OF_PARAMETER[name]: {"value": value} for name, value in start.items()}
    properties = blender_principled_dict(
        dict(material["sockets"]) | opened,
        distribution=material.get("distribution", "MULTI_GGX"),
        version=version,
        free=list(start),
        shader=material.get("shader", "principled"),
        subsurface_method=material.get("subsurface_method", "RANDOM_WALK"),
    )
    if is_mixed(material):
        properties = closure_tree_dict(material, properties, version=version)
    _rewrite(bsdf, properties, textures)
    bsdf.set("id", bsdf_id)
    if is_mixed(material) and GLOW & start.keys():
        raise BadInputError("The emission of the fitted shader of a mix is held: leave it out of the parameters.")
    is_free = mix_values(material) is not None if is_mixed(material) else GLOW & {*start, *material.get("varying", ())}
    if emits_by_place(material) or (is_free and not is_mixed(material)):
        _glow_of_surface(scene, bsdf_id, material.get("film_exposure", 1.0), every=bool(is_free))


def _prepared(
    target: Target, table: ParameterTable, start: NDArray[np.float64], material: Mapping[str, Any]
) -> PreparedMaterial:
    """What the renderer is told of a target whose BSDF has been put."""
    outer, mix = target.outer, mix_values(material)
    of_fitted = "fitted." if is_mixed(material) else ""
    key_ends = {name: f"{of_fitted}{name}" for name in table.names}
    if mix is not None:
        named = [(name, shown) for names in mix.leaves.values() for name, shown in names.items()]
        kinds = (WALK_SIZES, (STRENGTH,), INDICES)
        sizes, strengths, indices = ([shown for name, shown in named if name in kind] for kind in kinds)
        others = _around_own(ParameterTable(mix.parameters), mix.start, sizes, strengths, indices)
        start = np.concatenate([start, others.clip(others.pack(mix.start))])
        table, key_ends = ParameterTable([*table, *others]), key_ends | mix.key_ends
    outer_target = Target(target.shape_id, target.bsdf_id, outer, outer)
    return PreparedMaterial(table, start, outer_target, key_ends, mix)


def _glow_of_surface(scene: Element, bsdf_id: str, exposure: float, *, every: bool) -> None:
    """Let shapes of a material glow with what its BSDF emits at any time: those that glow, or `every` one."""
    owners = {bsdf_id, *(b.get("id") for b in scene.iter("bsdf") if b.get("type") == "normalmap" and _has(b, bsdf_id))}
    for shape in scene.iter("shape"):
        emitters = shape.findall("emitter")
        if not (emitters or every) or not any(_has(shape, owner) for owner in owners):
            continue
        for emitter in emitters:
            shape.remove(emitter)
        emitter = ElementTree.SubElement(shape, "emitter", type="blender_glow")
        ElementTree.SubElement(emitter, "boolean", name="of_surface", value="true")
        ElementTree.SubElement(emitter, "float", name="scale", value=repr(float(exposure)))


def _has(element: Element, identifier: str | None) -> bool:
    return any(ref.get("id") == identifier for ref in element.findall("ref"))


def _constants(sockets: Mapping[str, Mapping[str, Any]]) -> dict[str, Value]:
    values: dict[str, Value] = {}
    for socket, content in sockets.items():
        if socket in SOCKETS and content.get("value") is not None:
            values[PARAMETER_OF_SOCKET[socket]] = socket_value(socket, content["value"])
    return values


def _textures(scene: Element) -> dict[str, Element]:
    """Bitmap textures of the scene by file name, with the UV transform the exporter gave them."""
    found = {}
    for texture in scene.iter("texture"):
        for child in texture.findall("string"):
            if child.get("name") == "filename":
                found[PurePosixPath(child.get("value", "").replace("\\", "/")).name] = texture
    return found


def _rewrite(bsdf: Element, properties: Mapping[str, Any], textures: Mapping[str, Element]) -> None:
    """Make an element one of these properties; of what it was its `name` stays."""
    for child in list(bsdf):
        bsdf.remove(child)
    named = {"name": bsdf.get("name", "")} if bsdf.get("name") else {}
    bsdf.attrib.clear()
    bsdf.attrib.update({"type": str(properties["type"]), **named})
    for name, value in properties.items():
        if name == "type":
            continue
        if isinstance(value, str):
            ElementTree.SubElement(bsdf, "string", name=name, value=value)
        elif isinstance(value, Mapping) and value["type"] == "blender_principled":
            _rewrite(ElementTree.SubElement(bsdf, "bsdf", name=name), value, textures)
        elif isinstance(value, Mapping) and value["type"] == "projective":
            bsdf.append(_projective(name, value))
        elif isinstance(value, Mapping) and value["type"] == "mapped_normal":
            _add_mapped_normal(bsdf, name, _picture("map", value["map"], textures), turned=value["turned"])
        elif isinstance(value, Mapping) and value["type"] == "mesh_attribute":
            texture = ElementTree.SubElement(bsdf, "texture", type="mesh_attribute", name=name)
            ElementTree.SubElement(texture, "string", name="name", value=value["name"])
        elif isinstance(value, Mapping) and value["type"] == "rgb":
            ElementTree.SubElement(bsdf, "rgb", name=name, value=", ".join(map(repr, value["value"])))
        elif isinstance(value, Mapping):
            bsdf.append(_picture(name, value, textures))
        else:
            ElementTree.SubElement(bsdf, "float", name=name, value=repr(float(value)))


def _add_mapped_normal(bsdf: Element, name: str, normals: Element, *, turned: bool) -> None:
    direction = ElementTree.SubElement(bsdf, "texture", type="mapped_normal", name=name)
    if turned:
        ElementTree.SubElement(direction, "boolean", name="turned", value="true")
    direction.append(normals)


def _picture(name: str, properties: Mapping[str, Any], textures: Mapping[str, Element]) -> Element:
    file = PurePosixPath(properties["filename"]).name
    texture = copy.deepcopy(textures[file]) if file in textures else _bitmap(properties["filename"])
    texture.attrib.pop("id", None)
    texture.set("name", name)
    return texture


def _projective(name: str, properties: Mapping[str, Any]) -> Element:
    texture = ElementTree.Element("texture", type="projective", name=name)
    for key in ("filename", "positions", "camera", "elsewhere"):
        if key in properties:
            ElementTree.SubElement(texture, "string", name=key, value=properties[key])
    ElementTree.SubElement(texture, "integer", name="depths", value=str(properties["depths"]))
    if properties.get("turned"):
        ElementTree.SubElement(texture, "boolean", name="turned", value="true")
    outside = properties["outside"]
    if isinstance(outside, Sequence):
        ElementTree.SubElement(texture, "rgb", name="outside", value=", ".join(repr(float(v)) for v in outside))
    else:
        ElementTree.SubElement(texture, "float", name="outside", value=repr(float(outside)))
    return texture


def _bitmap(filename: str) -> Element:
    texture = ElementTree.Element("texture", type="bitmap")
    ElementTree.SubElement(texture, "string", name="filename", value=filename)
    ElementTree.SubElement(texture, "boolean", name="raw", value="true")
    return texture
