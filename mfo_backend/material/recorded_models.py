# SPDX-License-Identifier: Apache-2.0
"""The material models that recorded paths can evaluate: reflecting ones, as plain functions of two directions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any, Protocol

from ..types.errors import UnrecordableError
from ..types.parameter import Parameter, ParameterTable, Value
from .arrays import dual as dr
from .arrays.grid_table import loaded_buffers
from .cycles_model import CyclesModel
from .mitsuba_principled import MitsubaPrincipled
from .principled.blender_principled import BLENDER_5_0, blender_principled, evaluate
from .principled.bumped_normals import BUMPED_NORMALS, LEAF_NORMALS, OWN_NORMALS, turned_to_leaf
from .principled.layers import layer_stack
from .principled.mix_values import MixValues, amount_of
from .principled.needed_lobes import needed_lobes
from .principled.principled_parameters import BLENDER_PRINCIPLED
from .principled.random_walk import WALK

# (values by name, wi, wo) -> BSDF times cosine; directions in the shading frame, a value of exactly 0.0 is a lobe left
# out
NO_WALK = NO_NORMALS = ParameterTable(())
Evaluate = Callable[[Mapping[str, Any], Any, Any], Any]


class RecordedModel(Protocol):
    """A reflecting material as a plain Dr.Jit function.

    Attributes
    ----------
    normals
        Directions that the functions take besides, if nodes give the surface normals.
    walks
        Numbers of walks below the surface that they take besides, if they take such lanes.
    scanned
        Values a global start scans: the main lobe's width first.
    two_sided
        Whether back faces reflect like front faces without a wrapper.
    limited_width
        Whether the larger width of an anisotropic lobe is at most 1, as in Cycles.
    widths
        Values that say how wide the main lobes are, of which the least shapes a recording.
    """

    name: str
    table: ParameterTable
    normals: ParameterTable
    walks: ParameterTable
    scanned: tuple[str, ...]
    two_sided: bool
    limited_width: bool
    widths: tuple[str, ...]

    def values(self, given: Mapping[str, Value | None], free: Collection[str]) -> dict[str, Value | None]:
        """Every value `bind` needs besides the free ones, from those of a material; None is one of a texture.

        Raises
        ------
        UnrecordableError
            If the material transmits light.
        """
        ...

    def bind(self, fixed: Mapping[str, Value | None], free: Collection[str]) -> Evaluate:
        """The function of all values, without the lobes that cannot contribute."""
        ...

    def buffers(self) -> list[Any]:
        """Evaluated Dr.Jit arrays that the bound functions read."""
        ...


class BlenderPrincipledModel:
    """Blender's Principled BSDF, without holes and glass."""

    name: str = "blender_principled"
    table: ParameterTable = BLENDER_PRINCIPLED
    normals: ParameterTable = NO_NORMALS
    walks: ParameterTable = NO_WALK
    scanned: tuple[str, ...] = ("roughness", "coat_roughness")
    two_sided: bool = True
    limited_width: bool = True
    widths: tuple[str, ...] = ("roughness",)

    def __init__(self, cycles: CyclesModel = BLENDER_5_0, *, normals: ParameterTable = NO_NORMALS) -> None:
        self._cycles = cycles
        self.normals = normals

    def values(self, given: Mapping[str, Value | None], free: Collection[str]) -> dict[str, Value | None]:
        """See `RecordedModel`."""
        given = dict(given) | {"alpha": 1.0}  # as many camera rays end on it as its alpha says
        for name, opaque in (("transmission_weight", 0.0), ("alpha", 1.0)):
            if name in free or given.get(name, opaque) != opaque:
                raise UnrecordableError(f"The material has {name!r}, which recorded paths do not hold.")
        return {p.name: given.get(p.name, p.default) for p in self.table if p.name not in free}

    def bind(self, fixed: Mapping[str, Value | None], free: Collection[str]) -> Evaluate:
        """See `RecordedModel`."""
        lobes = needed_lobes(fixed, free)
        return lambda parameters, wi, wo: blender_principled(parameters, wi, wo, lobes, self._cycles)

    def buffers(self) -> list[Any]:
        """See `RecordedModel`: the albedo tables."""
        return loaded_buffers()


class InnerLightModel(BlenderPrincipledModel):
    """Blender's Principled BSDF with light from inside, which it sends to the view without a `wo`: (0, 0, 0).

    That is its own where it `glows`, and where light `walks` below the surface, that of a lane whose walk has a length.
    """

    def __init__(self, cycles: CyclesModel = BLENDER_5_0, *, normals: ParameterTable, glows: bool, walks: bool) -> None:
        super().__init__(cycles, normals=normals)
        self._glows = glows
        self.walks = WALK if walks else NO_WALK

    def bind(self, fixed: Mapping[str, Value | None], free: Collection[str]) -> Evaluate:
        """See `RecordedModel`."""
        lobes = needed_lobes(fixed, free)

        def seen(parameters: Mapping[str, Any], wi: Any, wo: Any) -> Any:
            layers = layer_stack(parameters, wi, lobes, self._cycles)
            inside = layers.emission if self._glows else 0 * layers.emission
            if self.walks and layers.below is not None:
                inside = dr.select(parameters["walk_length"] > 0, layers.below.shown(wi, parameters), inside)
                layers = replace(layers, subsurface=None)
            return dr.select(dr.dot(wo, wo) > 0, evaluate(layers, layers.to_frame(wo)), inside)

        return seen


class MixedModel(BlenderPrincipledModel):
    """The leaves of a `closure_tree` that may change, opaque, with their weights; the fitted one is never left out.

    The values of the fitted leaf have the names of a plain material, free ones of others what a user calls them, and
    what else leaf k has is "leaf_k.base_color" and so on. A leaf's "weight" is what it has without the factors. Light
    may walk below one of them, and with `glows` they emit, as in `InnerLightModel`. Directions are in the frame of the
    fitted leaf's microfacets.
    """

    def __init__(self, tree: Any, mix: MixValues, *, glows: bool = False) -> None:
        super().__init__(tree.model, normals=normals_of(tree))
        self._tree, self._mix, self._glows = tree, mix, glows
        self._names = {
            k: {p.name: mix.leaves.get(k, {}).get(p.name, f"leaf_{k}.{p.name}") for p in BLENDER_PRINCIPLED}
            for k in tree.free_leaves
        }
        weights = ["weight", *(f"leaf_{k}.weight" for k in self._names)]
        held = (
            replace(BLENDER_PRINCIPLED[name], name=shown)
            for names in self._names.values()
            for name, shown in names.items()
            if shown.startswith("leaf_")
        )
        self.table = ParameterTable(
            [*BLENDER_PRINCIPLED, *mix.parameters, *held, *(Parameter(name, 1, 0.0, 1.0, 1.0) for name in weights)]
        )
        rough = [names["roughness"] for k, names in self._names.items() if not tree.held[k].only_glows]
        self.widths = ("roughness", *rough)
        # a fit of factors alone has no width to scan
        self.scanned = (*BlenderPrincipledModel.scanned, *rough)
        self.walks = WALK if tree.has_below and not tree.walks_are_held else NO_WALK
        self._turned = {
            k: {p.name: f"leaf_{k}.{p.name}" for p in LEAF_NORMALS}
            for k, leaf in tree.free_leaves.items()
            if leaf.material.bumped
        }
        of_leaves = (
            replace(LEAF_NORMALS[p], name=shown) for names in self._turned.values() for p, shown in names.items()
        )
        self.normals = ParameterTable([*self.normals, *of_leaves])

    def values(self, given: Mapping[str, Value | None], free: Collection[str]) -> dict[str, Value | None]:
        """See `RecordedModel`; what the other leaves hold is the plugin's to say."""
        values = super().values({n: v for n, v in given.items() if n in BLENDER_PRINCIPLED.names}, free)
        values["weight"] = _number(self._tree.fitted.weight)
        for k, names in self._names.items():
            leaf = self._tree.held[k]
            values |= {names[name]: value for name, value in leaf.material.fixed.items()}
            values[f"leaf_{k}.weight"] = _number(leaf.weight)
        return {name: value for name, value in values.items() if name not in free}

    def bind(self, fixed: Mapping[str, Value | None], free: Collection[str]) -> Evaluate:
        """See `RecordedModel`."""
        own = needed_lobes({n: v for n, v in fixed.items() if n in BLENDER_PRINCIPLED.names}, free)
        leaves: list[tuple[Any, Mapping[str, str], Mapping[str, str] | None, str, Any]]
        leaves = [(self._tree.fitted, {}, None, "weight", own)]
        mesh = {} if self._tree.bumped else None  # how a leaf without normals of its own is turned
        for k, names in self._names.items():
            known = {name: fixed[shown] for name, shown in names.items() if shown in fixed}
            lobes = needed_lobes(known, [name for name, shown in names.items() if shown in free])
            turned = self._turned.get(k, mesh)
            leaves.append((self._tree.held[k], names, turned, f"leaf_{k}.weight", lobes))

        def seen(parameters: Mapping[str, Any], wi: Any, wo: Any) -> Any:
            factors = [parameters[name] for name in self._mix.factors]
            smooth = parameters.get("smooth_normal", dr.kind_of(wi)(0, 0, 1))
            lit, glow, below = [], [], None
            for leaf, names, turned, weight, lobes in leaves:
                of_leaf, own_wi, own_wo = {name: parameters[shown] for name, shown in names.items()}, wi, wo
                if turned is not None:
                    given = {name: parameters[shown] for name, shown in turned.items()}
                    own_wi, own_wo, normals = turned_to_leaf(given, smooth, wi, wo)
                    of_leaf |= normals
                layers = layer_stack(of_leaf or parameters, own_wi, lobes, leaf.material.model)
                amount = parameters[weight] * amount_of(leaf.ways, factors)
                if self.walks and leaf is self._tree.walking and layers.below is not None:
                    below = layers.below.shown(wi, parameters) * amount
                    layers = replace(layers, subsurface=None)
                if self._glows:
                    glow.append(layers.emission * amount)
                if not leaf.only_glows:
                    lit.append(evaluate(layers, layers.to_frame(own_wo)) * amount)
            value = sum(lit[1:], lit[0])
            inside = sum(glow[1:], glow[0]) if glow else below
            if glow and below is not None:
                inside = dr.select(parameters["walk_length"] > 0, below, inside)
            return value if inside is None else dr.select(dr.dot(wo, wo) > 0, value, inside)

        return seen


def normals_of(bsdf: Any) -> ParameterTable:
    """The directions that lanes of a scene's material hold besides: what nodes give it, or the mesh."""
    if getattr(bsdf, "directions", ()):
        return BUMPED_NORMALS
    return OWN_NORMALS if getattr(bsdf, "bumped", False) else NO_NORMALS


def _number(weight: Any) -> float | None:
    """A weight of the plugin, None for a texture."""
    return None if hasattr(weight, "eval_1") else float(weight[0])


def recorded_model(
    name: str, bsdf: Any, mix: MixValues | None = None, *, glows: bool = False, walks: bool = False
) -> RecordedModel:
    """The recorded version of model `name`, with the switches of the scene's `bsdf`, of which `mix` is free besides.

    With `glows` it has its own light, too, and with `walks` that from below its surface.

    Raises
    ------
    UnrecordableError
        If there is none.
    """
    if name == "mitsuba_principled":
        return MitsubaPrincipled()
    if mix is not None:
        return MixedModel(bsdf, mix, glows=glows)
    if name == "blender_principled":
        cycles, normals = getattr(bsdf, "model", BLENDER_5_0), normals_of(bsdf)
        if glows or walks:
            return InnerLightModel(cycles, normals=normals, glows=glows, walks=walks)
        return BlenderPrincipledModel(cycles, normals=normals)
    raise UnrecordableError(f"Material model {name!r} has no recorded-path version.")
