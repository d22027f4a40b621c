# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that are something else to rays of other kinds: by Light Path, or hidden from them by Ray Visibility."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..findings import Findings
from ..material_model import Material
from ..materials.baked_material import EMISSION
from .scene_data import Hidden, SceneData

NOTHING = "nothing"  # id of a surface that all light passes
# An object is hidden from what all of these do not find: rays that are bent through a surface are glossy, too
HIDDEN = {"scattered": {"diffuse"}, "glossy": {"glossy"}, "transmission": {"glossy", "transmission"}}


def scattered_id(identifier: str) -> str:
    """The id of what scattered rays find at a surface that has others for other rays."""
    return f"{identifier}_scattered"


def put_looks(
    data: SceneData,
    identifier: str,
    name: str,
    looks: Mapping[str, str],
    shapes: Sequence[str],
    findings: Findings,
) -> None:
    """Let rays find a material as it was baked for them, by the ids of its `looks`.

    Where it is nothing to the camera that passes its `shapes`; else the camera has what scattered rays find, for a fit
    looks at its target through nothing that bends light.
    """
    scattered = scattered_id(identifier)
    if scattered not in data.materials:  # its bake has failed
        return
    others = {rays: look for rays, look in looks.items() if rays != "camera"}
    data.materials[identifier] = _by_ray(data.materials[scattered], {"scattered": scattered} | others, findings)
    if "camera" not in looks:
        return
    if data.materials[looks["camera"]].model != "null":
        findings.note(
            f"Material '{name}' is another to the camera (Light Path): before the target the fit has it as diffuse "
            "rays see it."
        )
        return
    data.shapes[:] = [replace(s, camera_hidden=True) if s.identifier in shapes else s for s in data.shapes]


def hide_from_rays(data: SceneData, findings: Findings) -> None:
    """Let rays pass the shapes that are hidden from them; what glows is named, for lights are sampled for all."""
    for number, shape in enumerate(data.shapes):
        if not shape.hidden.rays:
            continue
        material, rays = data.materials[shape.bsdf], set(shape.hidden.rays)
        if shape in data.emitting:
            note_hidden(shape.hidden, findings)
            continue
        looks = {kind: NOTHING if hides <= rays else shape.bsdf for kind, hides in HIDDEN.items()}
        looks |= dict.fromkeys(("camera", "shadow"), shape.bsdf)
        identifier = "_".join((shape.bsdf, "without", *shape.hidden.rays))
        data.materials |= {NOTHING: Material(NOTHING, "null"), identifier: _by_ray(material, looks, findings)}
        data.shapes[number] = replace(shape, bsdf=identifier)


def note_hidden(hidden: Hidden, findings: Findings) -> None:
    """Name an object that rays find in the fit and not in Cycles."""
    if hidden.rays:
        findings.note(f"Object '{hidden.owner}' is hidden from {', '.join(hidden.rays)} rays; in the fit it is not.")


def _by_ray(material: Material, looks: Mapping[str, str], findings: Findings) -> Material:
    """A material of several looks that glows as `material` does."""
    if material.scattering:
        findings.note(
            f"Material '{material.name}' is another to some rays: its Subsurface is shown as diffuse, no light travels "
            "below the surface."
        )
    emission = {name: socket for name, socket in material.sockets.items() if name in EMISSION}
    return Material(
        material.name, "by_ray", emission, emission_is_dimmed=material.emission_is_dimmed, by_ray=dict(looks)
    )
