# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader nodes as the Principled BSDF that they are: what their sockets are called there, and what of it is held.

Each is exact to Cycles' single precision where its lobes are (`mfo_backend/material/cycles_model.py`); what is only the
nearest has a sentence that says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import bpy

from ...versions import DIFFUSE, PRINCIPLED, has_diffuse_roughness

# what of a Principled BSDF keeps it opaque, and what takes away its specular reflection
OPAQUE = {"Alpha": 1.0, "Transmission Weight": 0.0}  # of what no light gets through
WITHOUT_SPECULAR = {"Metallic": 0.0, "Roughness": 1.0, "IOR": 1.5, "Specular IOR Level": 0.0, **OPAQUE}
_GLASS = {"Metallic": 0.0, "Alpha": 1.0, "Transmission Weight": 1.0}
_CLEAR = {"Base Color": "Color", "Roughness": "Roughness", "IOR": "IOR"}
_FILM = {"Thin Film Thickness": "Thin Film Thickness", "Thin Film IOR": "Thin Film IOR"}
_MATTE = {"Base Color": "Color"}
_METAL = {"Metallic": 1.0, "IOR": 1.5, "Specular IOR Level": 0.5, **OPAQUE}
_SHEEN = {"Base Color": [0.0, 0.0, 0.0], "Sheen Weight": 1.0, **WITHOUT_SPECULAR}


@dataclass(frozen=True)
class LeafKind:
    """How a node is fitted, or held.

    Attributes
    ----------
    names
        What the node calls values of a Principled BSDF, those that may be linked; None where it is one.
    held
        Values of the Principled BSDF that make it this node.
    shader
        The backend's word for its lobes.
    nearest
        Whether the model is only the nearest.
    """

    names: Mapping[str, str] | None = None
    held: Mapping[str, Any] = field(default_factory=dict)
    shader: str = "principled"
    nearest: bool = False


CLEAR_SHADERS = ("glass", "refraction")  # of those that light goes straight through, all others scatter it
METALLIC, TOON = "ShaderNodeBsdfMetallic", "ShaderNodeBsdfToon"
KINDS: dict[str, LeafKind] = {
    PRINCIPLED: LeafKind(),
    DIFFUSE: LeafKind({"Base Color": "Color", "Diffuse Roughness": "Roughness"}, WITHOUT_SPECULAR),
    "ShaderNodeBsdfAnisotropic": LeafKind({"Base Color": "Color", "Roughness": "Roughness"}, _METAL, "glossy"),
    METALLIC: LeafKind(
        {
            "Base Color": "Base Color",
            "Roughness": "Roughness",
            "Specular Tint": "Edge Tint",
            "Anisotropic": "Anisotropy",
            "Anisotropic Rotation": "Rotation",
            **_FILM,
        },
        _METAL,
    ),
    "ShaderNodeBsdfSheen": LeafKind(
        {"Sheen Tint": "Color", "Sheen Roughness": "Roughness"},
        _SHEEN,
    ),
    "ShaderNodeBsdfGlass": LeafKind({**_CLEAR, **_FILM}, _GLASS, "glass"),
    "ShaderNodeBsdfRefraction": LeafKind(_CLEAR, _GLASS, "refraction"),
    "ShaderNodeBsdfTranslucent": LeafKind(_MATTE, {"Metallic": 0.0, "Alpha": 1.0}, "translucent"),
    "ShaderNodeSubsurfaceScattering": LeafKind(
        {
            "Base Color": "Color",
            "Roughness": "Roughness",
            **{f"Subsurface {name}": name for name in ("Radius", "Scale")},
        },
        {**WITHOUT_SPECULAR, "Subsurface Weight": 1.0},
        "subsurface",
    ),
    TOON: LeafKind({"Sheen Tint": "Color"}, _SHEEN, "toon"),
    "ShaderNodeBsdfHair": LeafKind(_MATTE, WITHOUT_SPECULAR, nearest=True),
    "ShaderNodeBsdfHairPrincipled": LeafKind(_MATTE, WITHOUT_SPECULAR, nearest=True),
}
# a Metallic BSDF by index and extinction, which its setting makes of it
CONDUCTOR = LeafKind(
    {
        "Metal IOR": "IOR",
        "Metal Extinction": "Extinction",
        "Roughness": "Roughness",
        "Anisotropic": "Anisotropy",
        "Anisotropic Rotation": "Rotation",
    },
    _METAL,
    "conductor",
)
GLOSSY_TOON = LeafKind({"Sheen Tint": "Color"}, _SHEEN, "toon_glossy")
UNUSED_SOCKETS = ("Thin Wall",)  # of a Principled BSDF those that no model has, whatever is linked to them
EMISSION, TRANSPARENT = "ShaderNodeEmission", "ShaderNodeBsdfTransparent"
GLOW = LeafKind({"Emission Color": "Color", "Emission Strength": "Strength"}, shader="emission")  # beside others alone
# values of `all` that join only where the node has some of them already
_WHERE_PRESENT = {
    "Anisotropic": "Anisotropic",
    "Anisotropic Rotation": "Anisotropic",
    "Thin Film Thickness": "Thin Film Thickness",
    "Thin Film IOR": "Thin Film Thickness",
    "Absorption Density": "Absorption Density",
    "Absorption Color": "Absorption Density",
}


def is_shader(node: bpy.types.Node) -> bool:
    """Whether a node gives a shader; a colour in the place of one shines in Cycles (ShaderGraph::connect)."""
    return any(output.type == "SHADER" for output in node.outputs)


def kind_of(node: bpy.types.Node) -> LeafKind | None:
    """How a node is fitted, or held; None of one without a model."""
    if node.bl_idname == EMISSION:
        return GLOW
    if node.bl_idname == METALLIC and node.fresnel_type == "PHYSICAL_CONDUCTOR":
        return CONDUCTOR
    if node.bl_idname == TOON and node.component == "GLOSSY":
        return GLOSSY_TOON
    return KINDS.get(node.bl_idname)


def shines(node: bpy.types.Node) -> bool:
    """Whether a node at the end of a surface gives light alone."""
    return node.bl_idname == EMISSION or not is_shader(node)


def is_fitted(node: bpy.types.Node) -> bool:
    """Whether the values of a node can be fitted by themselves: they are fitted in a mix, and it reflects light."""
    return node.bl_idname != EMISSION and is_fitted_in_mix(node)


def is_fitted_in_mix(node: bpy.types.Node) -> bool:
    """Whether the values of a node can be fitted beside those of another one: its model is exact."""
    return kind_of(node) is not None and why_not_fitted(node) is None


def is_numbered(node: bpy.types.Node) -> bool:
    """Whether a leaf beside the fitted one has a number in a job: what passes straight through has none."""
    return node.bl_idname != TRANSPARENT


def why_not_fitted(node: bpy.types.Node) -> str | None:
    """What keeps a shader node of a known kind from being fitted, as the end of a sentence; None if nothing does."""
    if _known(node).nearest:
        return "has lobes that the fit does not have"
    if _is_filmed_metal(node):
        return "has a thin film on a metal by index, which the fit does not have: set its thickness to 0"
    return None


def only_nearest(node: bpy.types.Node) -> bool:
    """Whether a node of a known kind is held as a model that is only the nearest."""
    return _known(node).nearest or _is_filmed_metal(node)


def distribution_of(node: bpy.types.Node) -> str:
    """The distribution of a node's microfacets or, of velvet, of its fibres; that of other lobes counts for nothing."""
    found = getattr(node, "distribution", "")
    return "GGX" if found in ("", "MICROFIBER") else found


def walks_of(node: bpy.types.Node) -> str:
    """How light goes below the surface of a shader node, by the Principled BSDF's words."""
    return getattr(node, "subsurface_method", None) or getattr(node, "falloff", "RANDOM_WALK")


def sockets_of(node: bpy.types.Node) -> dict[str, bpy.types.NodeSocket]:
    """The inputs of a node by name, those that a setting of it hides, too, which `node.inputs[name]` does not find."""
    return {socket.name: socket for socket in node.inputs}


def inputs_of(node: bpy.types.Node) -> dict[str, bpy.types.NodeSocket]:
    """The sockets of a node of a known kind by what the Principled BSDF calls their values."""
    own = sockets_of(node)
    if node.bl_idname == DIFFUSE and not has_diffuse_roughness():
        own.pop("Roughness")
    names = _known(node).names
    return own if names is None else {ours: own[theirs] for ours, theirs in names.items() if theirs in own}


def default_names(values: Mapping[str, Any]) -> list[str]:
    """Of the values that a node may have fitted those that `all` stands for; `values` by the names of `inputs_of`."""

    def is_present(name: str) -> bool:
        if name == "Subsurface Scale":  # it multiplies the radius
            return False
        amount = _WHERE_PRESENT.get(name)
        return amount is None or bool(values.get(amount, 0.0))

    return [name for name in values if is_present(name)]


def _known(node: bpy.types.Node) -> LeafKind:
    kind = kind_of(node)
    assert kind is not None  # asked of known kinds alone
    return kind


def _is_filmed_metal(node: bpy.types.Node) -> bool:
    film = sockets_of(node).get("Thin Film Thickness")
    return kind_of(node) is CONDUCTOR and film is not None and bool(film.is_linked or film.default_value > 0.0)
