# SPDX-License-Identifier: GPL-3.0-or-later
"""What Cycles has baked of a surface as a material of the export."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...probe.light_path import BEHIND, OF_RAYS
from ..findings import Findings
from ..images.color_space import to_rec709
from ..lights.light_model import takes_light
from ..material_model import SHADING_NORMAL, Material, Part, Socket, Texture
from ..nodes.circling import TURNED
from ..nodes.leaf_kinds import CONDUCTOR, KINDS, TRANSPARENT
from .leaf_sockets import GLOSSY, HELD, conductor_colors, stretched

EMISSION = ("Emission Color", "Emission Strength")
WHITE = 1e-3  # a Transparent BSDF this far from 1 counts as white
BLACK = Socket((0.0, 0.0, 0.0))
MISSING = 1e-3  # of the weights' sum, below which nothing is missing
OVER = 1.0 + 1e-3  # weights that add up to more are those of an Add Shader


_Weighted = tuple[NDArray[np.float32], Material]


class Baked:
    """Files and values of one answer of `bake.surface.baked_surface`.

    `circles` says that meshes hold the tangents of all its shaders, and `others` are kinds of rays that find another
    look of it.
    """

    def __init__(
        self, answer: Mapping[str, Any], folder: Path, *, circles: bool = False, others: Collection[str] = ()
    ) -> None:
        self._answer, self._folder, self._circles, self._others = answer, folder, circles, others

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
        weighted = [(weight, leaf) for leaf in leaves if (weight := self._weight(leaf["weight"])).any()]
        weighted = [(weight, self._leaf(leaf, name, findings)) for weight, leaf in weighted]
        weighted = _normalised(weighted, name, findings)
        emission = self._emission(name, findings)
        if not weighted:
            return {identifier: Material(name, "emission" if emission else "diffuse", {"Base Color": BLACK} | emission)}
        if len(weighted) == 1:
            whole, below = weighted[0][1], self._emission_below_layers() if emission else {}
            emission = below or emission
            return _with_normal(
                identifier, replace(whole, sockets=whole.sockets | emission, emission_is_dimmed=not below), emission
            )
        found: dict[str, Material] = {}
        parts = []
        for number, (share, material) in enumerate(weighted):
            parts.append(Part(share, f"{identifier}_{number}"))
            found |= _with_normal(parts[-1].bsdf, material, {})
        return found | {identifier: Material(name, "mix", emission, parts=tuple(parts), emission_is_dimmed=True)}

    def _leaf(self, leaf: Mapping[str, Any], name: str, findings: Findings) -> Material:
        given = leaf["sockets"]
        if leaf["kind"] == TRANSPARENT:
            if np.abs(to_rec709(self._array(given["Color"])) - 1.0).max() > WHITE:
                findings.note(f"Material '{name}': Transparent BSDF is taken for white.")
            return Material(name, "null")
        kind = CONDUCTOR if "Extinction" in given else KINDS.get(leaf["kind"])
        if kind is None:
            findings.note(f"Material '{name}': {leaf['label']} is shown as black.")
            return Material(name, "diffuse", {"Base Color": BLACK})
        if leaf["nearest"]:
            findings.note(f"Material '{name}': {leaf['label']} is approximated by its nearest model.")
        sockets = {ours: Socket(value) for ours, value in kind.held.items()}
        names = {ours: ours for ours in given} if kind.names is None else kind.names
        sockets |= {ours: self._socket(given[theirs]) for ours, theirs in names.items() if theirs in given}
        if leaf["kind"] == GLOSSY:
            turned = [given.get(own, 0.0) for own in ("Anisotropy", "Rotation")]
            if any(isinstance(value, str) for value in turned):
                findings.note(f"Material '{name}': what is linked to Anisotropy of '{leaf['label']}' is left out.")
            else:
                sockets |= stretched(*map(float, turned))
        before, held = HELD.get(leaf["kind"], ("", ()))
        sockets |= {f"{before} {own}": self._socket(given[own]) for own in held if own in given}
        if "Extinction" in given:
            index, extinction = (self._array(given[own]) for own in ("IOR", "Extinction"))
            colours = zip(("Base Color", "Specular Tint"), conductor_colors(index, extinction), strict=True)
            own = (("Metal IOR", index), ("Metal Extinction", extinction))
            sockets |= {ours: Socket(c.mean(axis=(0, 1)).tolist(), True, _picture(c)) for ours, c in (*own, *colours)}
        if "Emission Strength" in sockets:
            sockets["Emission Strength"] = Socket(0.0)
        if self._circles:
            sockets["Tangent"] = Socket([0.0, 0.0, 0.0], True, by_mesh=True)
        normal = self._normals(leaf["normal"]) if "normal" in leaf else None
        if "shading_normal" in leaf:
            bent = self._normals(leaf["shading_normal"])
            sockets[SHADING_NORMAL] = Socket([0.0, 0.0, 0.0], True, bent, turned=bool(leaf["shading_turned"]))
        return Material(
            name,
            "principled",
            sockets,
            leaf["distribution"],
            leaf["walks"],
            normal=normal,
            displaced=normal is not None and bool(leaf["displaced"]),
            turned=normal is not None and bool(leaf["turned"]),
            shader=leaf.get("shader", kind.shader),
        )

    def _emission(self, name: str, findings: Findings) -> dict[str, Socket]:
        if "emission" not in self._answer:
            return {}
        pixels = np.load(self._folder / self._answer["emission"])
        if takes_light(pixels):
            refuse_dark(name, findings)
        radiance = self._color(pixels)
        if radiance.max() <= 0.0:
            return {}
        mean = [float(number) for number in radiance.mean(axis=(0, 1))]
        return dict(zip(EMISSION, (Socket(mean, True, _texture(radiance)), Socket(1.0)), strict=True))

    def _emission_below_layers(self) -> dict[str, Socket]:
        """What a Principled BSDF alone emits before its layers, which dim it by the angle that no bake knows."""
        leaf = self._answer["leaves"][0]["sockets"]
        if not (self._answer["alone"] and all(name in leaf for name in EMISSION)):
            return {}
        color, strength = (self._array(leaf[name]) for name in EMISSION)
        radiance = self._color((color * strength).astype(np.float32))
        mean = [float(number) for number in radiance.mean(axis=(0, 1))]
        return dict(
            zip(EMISSION, (Socket(mean, True, _picture(radiance.astype(np.float64))), Socket(1.0)), strict=True)
        )

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

    def _normals(self, name: str) -> Texture:
        return _texture((0.5 * np.load(self._folder / name) + 0.5).astype(np.float32))

    def _array(self, value: Any) -> NDArray[np.float64]:
        """A value per channel, (height, width, 3), one of them where it is the same everywhere."""
        found = np.load(self._folder / value) if isinstance(value, str) else np.reshape(value, (1, 1, -1))
        return np.broadcast_to(found, (*found.shape[:2], 3)).astype(np.float64)

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
        if self._answer["sides"] and self._others:  # else its back is that of an opaque, closed surface
            if BEHIND not in self._others:
                findings.note(f"Material '{name}' asks for Backfacing: in the fit both sides are as its front is.")
            elif "emission" in self._answer:
                findings.note(f"Material '{name}' asks for Backfacing: in the fit both sides glow as its front does.")
        left_out = [socket for socket in self._answer["left_out"] if not (self._circles and socket == "Tangent")]
        if left_out:
            findings.note(f"Material '{name}': what is linked to {', '.join(left_out)} is left out.")
        turned = any(leaf["sockets"].get(own, 0.0) != 0.0 for leaf in self._answer["leaves"] for own in TURNED)
        if turned and not self._circles:
            findings.note(f"Material '{name}': its anisotropy follows the UV map of the bake.")
        paths = [output for output in self._answer["paths"] if output not in OF_RAYS or "emission" in self._answer]
        if paths:
            asked = ", ".join(paths)
            findings.note(f"Material '{name}' asks Light Path for {asked}: the fit has it as diffuse rays see it.")


def refuse_dark(name: str, findings: Findings) -> None:
    """An error for a material of this name whose emission is negative."""
    findings.error(f"Material '{name}' takes light away (negative emission): make it positive.")


def _picture(values: NDArray[np.float64]) -> Texture | None:
    return None if values.shape[:2] == (1, 1) else _texture(np.ascontiguousarray(values, dtype=np.float32))


def _texture(pixels: NDArray[np.float32]) -> Texture:
    return Texture(pixels, np.eye(3), "clamp", "bilinear")


def _with_normal(identifier: str, material: Material, emission: dict[str, Socket]) -> dict[str, Material]:
    """The material under `identifier`; one with a normal map of its own goes below the map."""
    if material.normal is None:
        return {identifier: material}
    below, weight = f"{identifier}_flat", np.ones((1, 1, 1), np.float32)
    bumped = Material(material.name, "bumped", emission, parts=(Part(weight, below),), normal=material.normal)
    bumped = replace(bumped, emission_is_dimmed=material.emission_is_dimmed)
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
