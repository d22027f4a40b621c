# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles has baked of a surface as a material of the export."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..findings import Findings
from ..images.color_space import to_rec709
from ..material_model import Material, Part, Socket, Texture

# closures with an equal: node -> (our model, {our socket: the node's}, constants of ours)
EXACT = {
    "ShaderNodeBsdfPrincipled": ("principled", {}, {}),
    "ShaderNodeBsdfTransparent": ("null", {}, {}),
    "ShaderNodeBsdfDiffuse": (
        "principled",
        {"Base Color": "Color", "Diffuse Roughness": "Roughness"},
        {"Specular IOR Level": 0.0, "Roughness": 1.0},
    ),
    "ShaderNodeBsdfSheen": (
        "principled",
        {"Sheen Tint": "Color", "Sheen Roughness": "Roughness"},
        {"Base Color": (0.0, 0.0, 0.0), "Sheen Weight": 1.0, "Specular IOR Level": 0.0, "Roughness": 1.0},
    ),
    "ShaderNodeBsdfMetallic": (
        "principled",
        {"Base Color": "Base Color", "Specular Tint": "Edge Tint", "Roughness": "Roughness"},
        {"Metallic": 1.0},
    ),
}
# and those whose nearest model is something else
_MIRROR = ("principled", {"Base Color": "Color", "Specular Tint": "Color", "Roughness": "Roughness"}, {"Metallic": 1.0})
_MATTE = ("diffuse", {"Base Color": "Color"}, {})
NEAREST = {
    "ShaderNodeBsdfGlossy": _MIRROR,
    "ShaderNodeBsdfAnisotropic": _MIRROR,
    "ShaderNodeBsdfGlass": (
        "principled",
        {"Base Color": "Color", "Roughness": "Roughness", "IOR": "IOR"},
        {"Transmission Weight": 1.0},
    ),
    "ShaderNodeBsdfRefraction": (
        "principled",
        {"Base Color": "Color", "Roughness": "Roughness", "IOR": "IOR"},
        {"Transmission Weight": 1.0},
    ),
    "ShaderNodeSubsurfaceScattering": _MATTE,
    "ShaderNodeBsdfTranslucent": _MATTE,
    "ShaderNodeBsdfToon": _MATTE,
    "ShaderNodeBsdfHair": _MATTE,
    "ShaderNodeBsdfHairPrincipled": _MATTE,
}
EMISSION = ("Emission Color", "Emission Strength")
TURNED = ("Anisotropic", "Anisotropy")  # sockets that turn highlights along a tangent
WHITE = 1.0 - 1e-3  # a Transparent BSDF of this colour or brighter counts as white
BLACK = Socket((0.0, 0.0, 0.0))
MISSING = 1e-3  # of the weights' sum, below which nothing is missing
OVER = 1.0 + 1e-3  # weights that add up to more are those of an Add Shader


_Weighted = tuple[NDArray[np.float32], Material]


class Baked:
    """Files and values of one answer of `bake.surface.baked_surface`."""

    def __init__(self, answer: Mapping[str, Any], folder: Path) -> None:
        self._answer, self._folder = answer, folder

    @property
    def corners(self) -> NDArray[np.float32]:
        """UV of the bake, (triangles, 3, 2)."""
        return np.load(self._folder / self._answer["corners"])

    @property
    def place(self) -> list[str]:
        """Labels of nodes that may give each instance of the object something of its own."""
        return self._answer["place"]

    def materials(self, identifier: str, name: str, findings: Findings) -> dict[str, Material]:
        """The surface's material under `identifier`, and those it is mixed of under ids of their own.

        What is not as in Cycles goes into `findings`.
        """
        self._note(name, findings)
        leaves = self._answer["leaves"]
        weighted = [(self._weight(leaf["weight"]), self._leaf(leaf, name, findings)) for leaf in leaves]
        weighted = _normalised(weighted, name, findings)
        emission = self._emission()
        if not weighted:
            return {identifier: Material(name, "emission" if emission else "diffuse", {"Base Color": BLACK} | emission)}
        if len(weighted) == 1:
            whole = weighted[0][1]
            return _with_normal(
                identifier, replace(whole, sockets=whole.sockets | emission, emission_is_dimmed=True), emission
            )
        found: dict[str, Material] = {}
        parts = []
        for number, (share, material) in enumerate(weighted):
            parts.append(Part(share, f"{identifier}_{number}"))
            found |= _with_normal(parts[-1].bsdf, material, {})
        return found | {identifier: Material(name, "mix", emission, parts=tuple(parts))}

    def _leaf(self, leaf: Mapping[str, Any], name: str, findings: Findings) -> Material:
        kind, given = leaf["kind"], leaf["sockets"]
        known = EXACT.get(kind) or NEAREST.get(kind)
        if known is None:
            findings.note(f"Material '{name}': {leaf['label']} is shown as black.")
            return Material(name, "diffuse", {"Base Color": BLACK})
        if kind in NEAREST or leaf.get("fresnel_type") == "PHYSICAL_CONDUCTOR":
            findings.note(f"Material '{name}': {leaf['label']} is approximated by its nearest model.")
        model, renamed, constants = known
        if model == "principled" and not renamed:
            sockets = {ours: self._socket(value) for ours, value in given.items()}
            sockets |= {"Emission Strength": Socket(0.0)} if "Emission Strength" in sockets else {}
        else:
            sockets = {ours: Socket(value) for ours, value in constants.items()}
            sockets |= {ours: self._socket(given[theirs]) for ours, theirs in renamed.items() if theirs in given}
        if kind == "ShaderNodeBsdfTransparent" and np.min(self._socket(given["Color"]).value) < WHITE:
            findings.note(f"Material '{name}': Transparent BSDF is taken for white.")
        normal = None
        if "normal" in leaf and model != "null":
            normal = _texture((0.5 * np.load(self._folder / leaf["normal"]) + 0.5).astype(np.float32))
        distribution = leaf.get("distribution") or ""
        return Material(
            name,
            model,
            sockets,
            distribution if distribution in ("GGX", "MULTI_GGX") else "MULTI_GGX",
            leaf.get("subsurface_method") or "RANDOM_WALK",
            normal=normal,
            displaced=normal is not None and bool(leaf["displaced"]),
        )

    def _emission(self) -> dict[str, Socket]:
        if "emission" not in self._answer:
            return {}
        radiance = self._color(np.load(self._folder / self._answer["emission"]))
        if radiance.max() <= 0.0:
            return {}
        mean = [float(number) for number in radiance.mean(axis=(0, 1))]
        return dict(zip(EMISSION, (Socket(mean, True, _texture(radiance)), Socket(1.0)), strict=True))

    def _socket(self, value: Any) -> Socket:
        if isinstance(value, str):
            pixels = np.load(self._folder / value)
            if pixels.shape[2] == 1:
                return Socket(float(pixels.mean()), True, _texture(pixels))
            pixels = self._color(pixels)
            return Socket([float(number) for number in pixels.mean(axis=(0, 1))], True, _texture(pixels))
        if isinstance(value, list):
            return Socket([float(number) for number in to_rec709(value)])
        return Socket(value)

    def _weight(self, value: Any) -> NDArray[np.float32]:
        if isinstance(value, str):
            return np.load(self._folder / value)
        return np.full((1, 1, 1), value, np.float32)

    def _color(self, pixels: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.ascontiguousarray(to_rec709(pixels).clip(0.0), dtype=np.float32)

    def _note(self, name: str, findings: Findings) -> None:
        if self._answer["view"]:
            findings.note(
                f"Material '{name}': {', '.join(self._answer['view'])} depend on the view; the fit has them as the "
                "camera sees them."
            )
        if self._answer["around"]:
            asked = ", ".join(self._answer["around"])
            findings.note(f"Material '{name}': {asked} sees its own object alone in the fit.")
        if self._answer["sides"]:
            findings.note(f"Material '{name}' asks for Backfacing: in the fit both sides are as its front is.")
        if self._answer["left_out"]:
            left = ", ".join(self._answer["left_out"])
            findings.note(f"Material '{name}': what is linked to {left} is left out.")
        if any(leaf["sockets"].get(turned, 0.0) != 0.0 for leaf in self._answer["leaves"] for turned in TURNED):
            findings.note(f"Material '{name}': its anisotropy follows the UV map of the bake.")
        if self._answer["paths"]:
            asked = ", ".join(self._answer["paths"])
            findings.note(f"Material '{name}' asks Light Path for {asked}: the fit has it as diffuse rays see it.")


def _texture(pixels: NDArray[np.float32]) -> Texture:
    return Texture(pixels, np.eye(3), "clamp", "bilinear")


def _with_normal(identifier: str, material: Material, emission: dict[str, Socket]) -> dict[str, Material]:
    """The material under `identifier`; one with a normal map of its own goes below the map."""
    if material.normal is None:
        return {identifier: material}
    below, weight = f"{identifier}_flat", np.ones((1, 1, 1), np.float32)
    bumped = Material(material.name, "bumped", emission, parts=(Part(weight, below),), normal=material.normal)
    return {below: replace(material, normal=None), identifier: bumped}


def _normalised(weighted: list[_Weighted], name: str, findings: Findings) -> list[_Weighted]:
    """Parts whose weights add up to one: black fills what is missing, and colours take what is too much."""
    if not weighted:
        return weighted
    total = sum((weight for weight, _ in weighted), np.zeros((1, 1, 1), np.float32))
    most = float(total.max())
    if most > OVER:
        findings.note(f"Material '{name}': shaders that add up to {most:.3g} are approximated by brighter colours.")
        weighted = [(weight / np.float32(most), _brighter(material, most)) for weight, material in weighted]
        total = total / np.float32(most)
    rest = np.maximum(1.0 - total, 0.0).astype(np.float32)
    if float(rest.max()) > MISSING:
        weighted = [*weighted, (rest, Material(name, "diffuse", {"Base Color": BLACK}))]
    return weighted


def _brighter(material: Material, factor: float) -> Material:
    found = material.sockets.get("Base Color")
    if found is None:
        return material
    texture = found.texture
    if texture is not None:
        texture = replace(texture, pixels=(texture.pixels * factor).astype(np.float32))
    scaled = Socket([factor * number for number in found.value], found.linked, texture)
    return replace(material, sockets=material.sockets | {"Base Color": scaled})
