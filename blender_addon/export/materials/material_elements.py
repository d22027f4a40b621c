# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials as Mitsuba BSDFs. Knows nothing of bpy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..files.xml_scene import Element, add, bitmap, boolean, plugin, reference, rgb, scalar, transform
from ..findings import Findings
from ..material_model import SHADING_NORMAL, Material, Part, Socket, Texture
from .principled_mapping import UNMATCHED, sockets_to_mitsuba

# sockets whose pictures Mitsuba's model can take as they are
TEXTURED = {
    "Base Color": "base_color",
    "Roughness": "roughness",
    "Metallic": "metallic",
    "Anisotropic": "anisotropic",
    "Transmission Weight": "spec_trans",
}
FLIP_V = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])
# Of v from the top: what lies on the edge between two pixels, as all of a mesh without a UV map, has the upper one in
# Blender, and would have the lower one
BELOW_EDGE = 1e-6


def bsdf_element(
    material: Material, identifier: str, save: Callable[[Texture], str], findings: Findings, *, every: bool
) -> Element:
    """Return the `<bsdf>` of `material`. `every` writes parameters that are zero too, so that all can be read back."""
    if material.model in ("diffuse", "emission"):
        color = material.sockets.get("Base Color", Socket((0.0, 0.0, 0.0)))
        inner = add(plugin("bsdf", "diffuse"), _value("reflectance", color.value, color.texture, save))
        return add(plugin("bsdf", "twosided", identifier), inner)
    if material.model == "null":
        return plugin("bsdf", "null", identifier)
    if material.model == "bumped":
        assert material.normal is not None
        normals = texture_element("normalmap", material.normal, save(material.normal))
        return add(plugin("bsdf", "normalmap", identifier), normals, reference(material.parts[0].bsdf))
    if material.model == "by_ray":
        looks = (reference(bsdf, rays) for rays, bsdf in material.by_ray.items())
        return add(plugin("bsdf", "by_ray", identifier), *looks)
    if material.model == "mix":
        return _mixed(material.parts, identifier, save)
    inner = _principled(material, save, findings, every)
    alpha = material.sockets.get("Alpha", Socket(1.0))
    masked = alpha.texture is not None or alpha.value < 1.0
    transmits = _transmits(material)
    if not masked:
        if transmits:
            inner.set("id", identifier)
            return inner
        return add(plugin("bsdf", "twosided", identifier), inner)
    body = inner if transmits else add(plugin("bsdf", "twosided"), inner)
    opacity = _value("opacity", min(max(float(alpha.value), 0.0), 1.0), alpha.texture, save)
    return add(plugin("bsdf", "mask", identifier), opacity, body)


def _mixed(parts: Sequence[Part], identifier: str, save: Callable[[Texture], str]) -> Element:
    """Blends of two within each other: each shows its first part, or with the weight of the rest all others."""
    first, rest = parts[0].share, sum((part.share for part in parts[1:]), np.zeros((1, 1, 1), np.float32))
    whole = first + rest
    weight = np.divide(rest, whole, out=np.zeros(whole.shape, np.float32), where=whole > 0.0)
    if weight.size == 1:
        shown = scalar("weight", float(weight.flat[0]))
    else:
        texture = Texture(weight, np.eye(3), "clamp")
        shown = texture_element("weight", texture, save(texture))
    others = reference(parts[1].bsdf) if len(parts) == 2 else _mixed(parts[1:], "", save)
    return add(plugin("bsdf", "blendbsdf", identifier), shown, reference(parts[0].bsdf), others)


def emission_element(material: Material, scale: float, save: Callable[[Texture], str]) -> Element | None:
    """Return the `<emitter>` for a shape of `material`, its radiance times `scale`; None if it emits nothing.

    What alpha, coat and sheen take of it is for the backend to say, unless the emission is dimmed already.
    """
    color, strength = material.sockets.get("Emission Color"), material.sockets.get("Emission Strength")
    if material.emission.max(initial=0.0) <= 0.0:
        return None
    emitter = plugin("emitter", "blender_glow")
    if material.is_mixed or color is None or strength is None:  # of a mix the mean; the backend knows all
        return add(emitter, rgb("radiance", material.emission * scale))
    if not material.emission_is_dimmed:
        add(emitter, boolean("layered", True))
    if strength.texture is not None or color.texture is None:
        return add(emitter, rgb("radiance", material.emission * scale))
    pixels = color.texture.pixels * np.float32(float(strength.value) * scale)
    return add(emitter, _value("radiance", None, replace(color.texture, pixels=pixels), save))


def approximated(material: Material) -> list[str]:
    """Return a sentence for each thing that no model of the backend has, Blender's own included."""
    found = []
    below = material.scattering
    if len(below) > 1:
        found.append("Subsurface of several shaders is shown as diffuse: no light travels below the surface.")
    elif below and material.passes_light:
        found.append("Subsurface is fitted as diffuse, for the material lets light through.")
    elif (
        below
        and below[0].subsurface_method not in ("RANDOM_WALK", "BURLEY")
        and below[0].value("Subsurface Anisotropy", 0.0) < 0.0
    ):
        found.append("a Subsurface Anisotropy below zero is fitted as zero: choose Random Walk for Subsurface.")
    if material.value("Thin Wall", False):
        found.append("Thin Wall is left out.")
    return found


def _above_emission(leaf: Material) -> list[str]:
    """The layers above what a leaf emits itself."""
    if float(leaf.value("Emission Strength", 0.0)) == 0.0:
        return []
    layers = {"Alpha": 1.0, "Coat Weight": 0.0, "Sheen Weight": 0.0}
    return [name for name, nothing in layers.items() if leaf.value(name, nothing) != nothing]


def _transmits(material: Material) -> bool:
    socket = material.sockets.get("Transmission Weight", Socket(0.0))
    return socket.texture is not None or socket.value > 0.0


def _principled(material: Material, save: Callable[[Texture], str], findings: Findings, every: bool) -> Element:
    values = sockets_to_mitsuba({name: socket.value for name, socket in material.sockets.items()})
    textures = {
        TEXTURED[name]: socket.texture
        for name, socket in material.sockets.items()
        if socket.texture is not None and name in TEXTURED
    }
    for name, socket in material.sockets.items():
        if socket.texture is not None and name not in (*TEXTURED, "Alpha", "Emission Color", SHADING_NORMAL):
            findings.note_of_mitsuba(
                f"Material '{material.name}': scene.xml has the average of the picture on {name}, which Mitsuba's "
                "principled cannot take as a picture."
            )
    lost = [name for name, nothing in UNMATCHED.items() if material.value(name, nothing) != nothing]
    if lost:
        findings.note_of_mitsuba(
            f"Material '{material.name}': {', '.join(lost)} has no counterpart in Mitsuba's principled and is missing "
            "in a fit with the model mitsuba_principled."
        )
    above = [name for name in _above_emission(material) if name != "Alpha"]
    if above and not (material.is_mixed or material.emission_is_dimmed):
        findings.note_of_mitsuba(
            f"Material '{material.name}': the emission is not dimmed by {', '.join(above)} in a fit with the model "
            "mitsuba_principled."
        )
    if material.value("Anisotropic", 0.0) != 0.0 and material.sockets.get("Tangent", Socket(0.0)).by_mesh:
        findings.note_of_mitsuba(
            f"Material '{material.name}': its highlights turn along the UV map in a fit with the model "
            "mitsuba_principled."
        )
    for sentence in approximated(material):
        findings.note(f"Material '{material.name}': {sentence}")
    element = plugin("bsdf", "principled")
    for name, value in values.items():
        if every or name in textures or name in ("base_color", "roughness", "eta") or value != 0.0:
            add(element, _value(name, value, textures.get(name), save))
    return element


def _value(name: str, value: Any, texture: Texture | None, save: Callable[[Texture], str]) -> Element:
    if texture is not None:
        return texture_element(name, texture, save(texture))
    return scalar(name, value) if isinstance(value, float) else rgb(name, value)


def texture_element(name: str, texture: Texture, path: str) -> Element:
    """Return the `<texture>`; the meshes carry 1 - v because Mitsuba counts rows from the top."""
    element = bitmap(name, path, extension=texture.wrap, filter_type=texture.filter_type)
    nearest = texture.filter_type == "nearest"
    if nearest or not np.allclose(texture.uv_matrix, np.eye(3)):
        # Mitsuba 3.9 takes rotation and scale from the upper left 2x2, the translation from the fourth column
        flat = FLIP_V @ texture.uv_matrix @ FLIP_V
        flat[1, 2] -= BELOW_EDGE if nearest else 0.0
        matrix = np.eye(4)
        matrix[:2, :2], matrix[:2, 3] = flat[:2, :2], flat[:2, 2]
        add(element, transform("to_uv", matrix))
    return element
