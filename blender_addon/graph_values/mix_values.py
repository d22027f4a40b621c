# SPDX-License-Identifier: GPL-3.0-or-later
"""What may be fitted of a mix of shaders beside the chosen leaf: values of the other leaves, and factors of Mix Shaders
without a link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from ..export.nodes.closure_leaves import ClosureLeaf, Factor
from ..export.nodes.leaf_kinds import (
    CLEAR_SHADERS,
    EMISSION,
    TRANSPARENT,
    UNUSED_SOCKETS,
    inputs_of,
    is_fitted_in_mix,
    kind_of,
    shines,
)
from ..export.nodes.shader_graph import plain_value
from ..export.nodes.target_shader import DIRECTIONS, TargetShader, leaf_name
from ..versions import PRINCIPLED
from .place import INPUT, Place
from .ranges import BY_DEFAULT
from .table import WEIGHT, GraphValue, graph_values, named_apart, one_word, without_glow

# what a leaf has to have so that it scatters all light
OPAQUE = {"Alpha": 1.0, "Transmission Weight": 0.0}
NOT_FITTED = (*("Weight", "Alpha", "Transmission Weight", "Subsurface Weight"), *DIRECTIONS, *UNUSED_SOCKETS)
# of a Principled BSDF those that *All* takes: one picture tells little more of several, but for lobes that are there
OF_PRINCIPLED = ("Base Color", "Metallic", "Roughness", "Specular IOR Level")
WITH = {
    "Coat Weight": ("Coat Weight", "Coat Roughness"),
    "Sheen Weight": ("Sheen Weight", "Sheen Roughness", "Sheen Tint"),
    "Anisotropic": ("Anisotropic", "Anisotropic Rotation"),
    "Thin Film Thickness": ("Thin Film Thickness", "Thin Film IOR"),
    "Diffuse Roughness": ("Diffuse Roughness",),
    "Subsurface Weight": ("Subsurface Radius",),
}


@dataclass(frozen=True)
class MixValue:
    """A value of a mix: its name, the label of its node, where it is, and whether *All* takes it.

    It belongs to the number `leaf` of the target's other leaves, and is their `socket` by the Principled BSDF's name;
    or it is the `factor` of a Mix Shader.
    """

    name: str
    label: str
    place: Place
    by_default: bool
    leaf: int = -1
    socket: str = ""
    factor: Factor | None = None


def inside_values(target: TargetShader) -> Sequence[GraphValue | MixValue]:
    """The values beside the sockets of the target that a fit may change: of a mix the others', and of its nodes."""
    if not target.is_mixed:
        return graph_values(target)
    if why_no_mix_values(target) is not None and not all(_is_hole(leaf.node) for leaf in target.others):
        return []
    has_holes = any(_is_hole(leaf.node) for leaf in target.others)  # which stay as they are, and so do all weights
    of_nodes = [value for value in graph_values(target) if not (has_holes and _is_weight(value))]
    return named_apart([*mix_values(target), *of_nodes])


def _is_hole(node: bpy.types.Node) -> bool:
    """Whether a leaf is Transparent of one grey."""
    if node.bl_idname != TRANSPARENT:
        return False
    color = node.inputs["Color"]
    return not color.is_linked and len(set(plain_value(color)[:3])) == 1


def _is_weight(value: GraphValue) -> bool:
    """Whether it reaches the weight of a shader."""
    return any(name.rpartition("/")[2] == WEIGHT for name in value.sockets)


def default_values(target: TargetShader, *, all_leaves: bool) -> list[GraphValue | MixValue]:
    """Those of them that *All* takes, of all shaders of a mix or of the fitted one alone.

    What nodes make of a weight is named by the user: colours and weights show as products.
    """
    return [value for value in inside_values(target) if _is_default(value, target, all_leaves=all_leaves)]


def _is_default(value: GraphValue | MixValue, target: TargetShader, *, all_leaves: bool) -> bool:
    if isinstance(value, MixValue):
        return all_leaves and value.by_default
    of_one = not any("/" in name for name in value.sockets)
    is_weight = _is_weight(value) and target.is_mixed
    return value.range.group in BY_DEFAULT and not is_weight and (all_leaves or of_one)


def why_no_mix_values(target: TargetShader) -> str | None:
    """What keeps values of a mix from being fitted beside the chosen leaf, as the end of a sentence."""
    for leaf in (target.leaf, *target.others):
        if shines(leaf.node) or _is_hole(leaf.node):
            continue
        kind = kind_of(leaf.node)
        if kind is None:
            return f"'{leaf_name(leaf)}' has no model in the fit"
        if kind.shader in CLEAR_SHADERS:
            return f"'{leaf_name(leaf)}' lets light through"
    if target.volume is not None:
        return "light goes through it into a volume"
    for leaf in (target.leaf, *target.others):
        problem = _not_plain(leaf)
        if problem is not None:
            return f"{problem} of '{leaf_name(leaf)}'"
    return None


def mix_values(target: TargetShader) -> list[MixValue]:
    """The values of a target's mix: factors first, then leaf by leaf."""
    if why_no_mix_values(target) is not None:
        return []
    found = []
    for factor in _factors(target):
        node = factor.socket.node
        place = Place((*(group.name for group in factor.groups), node.name), INPUT, factor.socket.identifier)
        found.append(_value(node, factor.socket.name, place, not _is_in_colors(target, factor), factor=factor))
    for number, leaf in enumerate(target.others):
        if not is_fitted_in_mix(leaf.node):
            continue
        shader = TargetShader(leaf)
        default, held = _default_names(shader), {*NOT_FITTED, *without_glow(shader)}
        for name, at in shader.places.items():
            if name in held or at.socket.is_linked or not hasattr(at.socket, "default_value"):
                continue
            path = (*(group.name for group in at.groups), at.socket.node.name)
            place = Place(path, INPUT, at.socket.identifier, size=3 if at.socket.type in ("RGBA", "VECTOR") else 1)
            found.append(_value(leaf.node, shader.own_name(name), place, name in default, leaf=number, socket=name))
    return named_apart(found)


def ways_of(leaf: ClosureLeaf, factors: Sequence[Factor]) -> list[dict[str, object]]:
    """The ways to a leaf with the numbers of these factors on them; shares are of the weight that it has now."""
    numbers = {_place(factor): number for number, factor in enumerate(factors)}
    found = []
    for way in leaf.ways:
        free = [(numbers[_place(factor)], factor) for factor in way if _place(factor) in numbers]
        share = ClosureLeaf(leaf.node, leaf.groups, (tuple(f for f in way if _place(f) not in numbers),)).share
        found.append({
            "share": share / leaf.share,
            "first": [number for number, factor in free if not factor.second],
            "second": [number for number, factor in free if factor.second],
        })  # fmt: skip
    return found if any(way["first"] or way["second"] for way in found) else []


def _value(node, inside: str, place: Place, by_default: bool, **rest) -> MixValue:  # type: ignore[no-untyped-def]
    label = one_word(node.label or node.name)
    return MixValue(f"{label}/{one_word(inside)}", label, place, by_default, **rest)


def _place(factor: Factor) -> tuple[int, ...]:
    """Both sides of a Mix Shader have one."""
    return (*(group.as_pointer() for group in factor.groups), factor.socket.as_pointer())


def _factors(target: TargetShader) -> list[Factor]:
    """Factors without a link, of whose sides neither is away, where what hangs on them is known."""
    leaves = (target.leaf, *target.others)
    # of pictures of weights one factor is taken out by a division, of their sums none
    held = {
        _place(factor)
        for leaf in leaves
        if _is_hole(leaf.node) or (leaf.is_linked and len(leaf.ways) > 1)
        for way in leaf.ways
        for factor in way
    }
    found: dict[tuple[int, ...], Factor] = {}
    for leaf in leaves:
        for way in leaf.ways:
            for factor in way:
                if _place(factor) not in held and factor.value is not None and 0.0 < factor.value < 1.0:
                    found.setdefault(_place(factor), factor)
    return list(found.values())


def _is_in_colors(target: TargetShader, factor: Factor) -> bool:
    """Whether each leaf that a factor leads to shows its share and a free colour as their product alone.

    Then the colours, up to white, make up for the factor, and no picture tells them apart.
    """
    leaves = [
        leaf
        for leaf in (target.leaf, *target.others)
        if any(_place(factor) == _place(each) for way in leaf.ways for each in way)
    ]
    return all(leaf.node.bl_idname != PRINCIPLED and _has_free_color(leaf) for leaf in leaves)


def _has_free_color(leaf: ClosureLeaf) -> bool:
    if not is_fitted_in_mix(leaf.node):
        return False
    names = ("Base Color", "Sheen Tint", "Emission Color")
    return any(not socket.is_linked for name, socket in inputs_of(leaf.node).items() if name in names)


def _not_plain(leaf: ClosureLeaf) -> str | None:
    """What of a leaf is more than reflection."""
    node = leaf.node
    if node.bl_idname == PRINCIPLED:
        for name, opaque in OPAQUE.items():
            socket = inputs_of(node).get(name)
            if socket is not None and (socket.is_linked or plain_value(socket) != opaque):
                return f"a fit of them takes no {name} {'that is linked' if socket.is_linked else 'that is set'}"
    return None


def _default_names(shader: TargetShader) -> list[str]:
    if shader.node.bl_idname == EMISSION:  # of a product one factor
        return ["Emission Color"] if not shader.sockets["Emission Color"].is_linked else ["Emission Strength"]
    if shader.node.bl_idname != PRINCIPLED:
        return [name for name in shader.places if not _is_absent(shader, name)]
    present = [extra for name, extras in WITH.items() if not _is_absent(shader, name) for extra in extras]
    return [*OF_PRINCIPLED, *present]


def _is_absent(shader: TargetShader, name: str) -> bool:
    """Whether a lobe's amount is 0, so that its values have no effect."""
    amount = next((amount for amount, names in WITH.items() if name in names), None)
    if amount is None or (amount == name == "Diffuse Roughness" and shader.node.bl_idname != PRINCIPLED):
        return False
    socket = shader.sockets.get(amount)
    if socket is None:  # a node whose lobe this is has no amount of it
        return shader.node.bl_idname == PRINCIPLED
    return not socket.is_linked and plain_value(socket) == 0.0
