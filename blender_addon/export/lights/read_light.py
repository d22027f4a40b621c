# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender light objects as the numbers of `light_model`."""

from __future__ import annotations

import math
from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from ...bake.lamp_layout import Lookup
from ...versions import cycles_settings, light_color, light_is_normalized, light_strength, node_tree_of
from ..audit.object_table import LIGHT_CYCLES
from ..audit.rules import name_settings
from ..findings import Findings
from ..images.color_space import from_rec709, to_rec709
from ..nodes.graph_findings import note_missing_pictures
from ..nodes.shader_graph import emission_of
from .lamp_nodes import LampNodesError, lookup_of
from .light_model import Light

ROUNDING = 1e-6  # of a colour that is converted there and back
# cubic metres; a light thinner than any scene needs has no area that light could come from
LEAST_VOLUME = 1e-18
# Cosines of the angles between a light's axes. Cycles takes a sheared area light for a rectangle in one place and for a
# parallelogram in another: with a cosine of 0.02 a picture is 0.9 % off. Of a spot its light tree leaves out what lies
# beyond a straight cone: with 0.4 0.5 %, with strong shears a half
MOST_SHEAR = {"AREA": 0.002, "SPOT": 0.05}


def read_light(
    evaluated: bpy.types.Object,
    matrix: NDArray[np.float64],
    exposure: float,
    findings: Findings,
    *,
    camera: bool,
    hidden_from: Sequence[str],
) -> Light | None:
    """Return the light with its power scaled by `exposure`, or None if it gives no light.

    `camera` says whether the camera sees it, and `hidden_from` which rays do not: it and what shows it say that.
    """
    data = evaluated.data
    name = evaluated.name
    cycles = cycles_settings(data)
    if data.type == "AREA" and cycles is not None and cycles.is_portal:
        findings.note(f"Light '{name}' is a portal, which gives no light of its own; it is left out.")
        return None
    color = to_rec709(light_color(data))
    tree, nodes = node_tree_of(data), None
    if tree is not None:
        emission = emission_of(tree)
        if emission is None:
            nodes = _lookup(evaluated, tree, findings)
            if nodes is None:
                return None
        else:
            color = color * emission
    power = light_strength(data) * exposure
    if power < 0.0 or from_rec709(color).min() < -ROUNDING:
        findings.error(f"Light '{name}' takes light away (negative power or colour): make it positive.")
        return None
    if color.min() < -ROUNDING:
        findings.note(f"Light '{name}' has a colour beyond linear Rec.709, in which the fit counts: it is at its edge.")
    color = color.clip(0.0)
    if power == 0.0 or color.max() == 0.0:
        return None
    name_settings(LIGHT_CYCLES, cycles, name, findings)
    if linked_light(evaluated):
        note_linking(name, findings)
    _note_rays(evaluated, hidden_from, findings)
    light = Light(
        kind=data.type,
        name=name,
        world=matrix,
        color=color,
        power=power,
        normalize=light_is_normalized(data),
        radius=getattr(data, "shadow_soft_size", 0.0) if data.type in ("POINT", "SPOT") else 0.0,
        soft_falloff=getattr(data, "use_soft_falloff", True),
        spot_size=getattr(data, "spot_size", 0.0),
        spot_blend=getattr(data, "spot_blend", 0.0),
        sun_angle=getattr(data, "angle", 0.0) if data.type == "SUN" else 0.0,
        shape=getattr(data, "shape", "SQUARE") if data.type == "AREA" else "SQUARE",
        size_x=getattr(data, "size", 1.0),
        size_y=getattr(data, "size_y", 1.0),
        spread=getattr(data, "spread", np.pi) if data.type == "AREA" else np.pi,
        camera=camera,
        shadow=data.use_shadow,
        nodes=nodes,
    )
    if light.kind in ("AREA", "SPOT") and abs(np.linalg.det(matrix[:3, :3])) * min(light.sizes) < LEAST_VOLUME:
        findings.error(f"Light '{name}' is scaled or sized to nothing: give it a size and a scale above 0.")
        return None
    if _shear(matrix) > MOST_SHEAR.get(light.kind, math.inf):
        findings.error(f"Light '{name}' is sheared by its parents: clear the parent's non-uniform scale.")
        return None
    return light


def _shear(matrix: NDArray[np.float64]) -> float:
    """The largest cosine between two axes of a matrix."""
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    axes = matrix[:3, :3] / np.where(lengths > 0.0, lengths, 1.0)
    return float(np.abs(axes.T @ axes - np.diag(np.diag(axes.T @ axes))).max())


def _lookup(evaluated: bpy.types.Object, tree: bpy.types.NodeTree, findings: Findings) -> Lookup | None:
    """By what Cycles is to measure a lamp's nodes; None, with an error, where no table holds them."""
    data, name = evaluated.data, evaluated.name
    has_radius = getattr(data, "shadow_soft_size", 0.0) > 0.0
    is_sphere = not getattr(data, "use_soft_falloff", True)
    try:
        found = lookup_of(tree, data.type, has_radius=has_radius, is_sphere=is_sphere)
    except LampNodesError as problem:
        findings.error(f"Light '{name}' has nodes that ask for {problem}, which no table holds: simplify them.")
        return None
    note_missing_pictures(f"Light '{name}'", tree, findings)
    if found.deep:
        findings.note(
            f"Light '{name}' asks Light Path for the depth of rays: in the fit it is on all surfaces as on the first."
        )
    return found


def _note_rays(evaluated: bpy.types.Object, hidden_from: Sequence[str], findings: Findings) -> None:
    if hidden_from:
        findings.note(f"Light '{evaluated.name}' is hidden from {', '.join(hidden_from)} rays; in the fit it is not.")
    cycles = cycles_settings(evaluated.data)
    if cycles is not None and not cycles.use_multiple_importance_sampling:
        findings.note(
            f"Light '{evaluated.name}' is without Multiple Importance Sampling: mirrors do not show it in Cycles, but "
            "in the fit they do."
        )


def linked_light(item: bpy.types.Object) -> str:
    """The name of an object, if light that it gives is for some objects alone, or is shadowed by some alone."""
    linking = getattr(item, "light_linking", None)
    return item.name if linking is not None and (linking.receiver_collection or linking.blocker_collection) else ""


def note_linking(name: str, findings: Findings) -> None:
    """Name the `linked_light` of the object of this name."""
    findings.note(f"Light linking of '{name}' is left out: it lights and shadows everything.")
