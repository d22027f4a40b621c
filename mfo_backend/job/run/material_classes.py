# SPDX-License-Identifier: Apache-2.0
"""Kinds of material that one fit does not reach from another, as starts of further fits.

Recorded paths hold opaque materials only, and from an opaque start no slope leads to glass. So where the user lets all
values be fitted and the result does not look the same, the fit begins again from the material of another class.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...fit.tolerances import DETERMINED_BELOW, WEAK_BELOW
from ...material.principled.blender_selection import AMOUNT_OF, PLAIN
from ...material.principled.principled_dict import socket_value
from ...material.principled.principled_parameters import BLENDER_PRINCIPLED, PARAMETER_OF_SOCKET, SOCKET_OF_PARAMETER
from ...metrics.display.tone_mapping import View
from ...types.certainty import Certainty, Level
from ...types.image import Encoding, Image
from ...types.parameter import Parameter, ParameterTable, Value
from ...types.result import FitResult
from ...types.verdict import Cause, Judgement, Verdict

# Socket values that a class begins with; all others stay as in the scene
GLASS = {"Transmission Weight": 1.0, "Metallic": 0.0, "Alpha": 1.0, "Roughness": 0.1, "Base Color": [0.9, 0.9, 0.9]}
CUT_OUT = {"Alpha": 0.5, "Transmission Weight": 0.0}
OPAQUE = {"Transmission Weight": 0.0, "Alpha": 1.0}
TINTED = OPAQUE | {"Coat Weight": 0.5, "Coat Tint": [0.5, 0.5, 0.5]}
FILMED = OPAQUE | {"Thin Film Thickness": 400.0}  # nanometres, where the first colours are
BRUSHED = OPAQUE | {"Anisotropic": 0.7}
CLAY = OPAQUE | {"Diffuse Roughness": 0.5}
GLOWING = OPAQUE | {"Emission Color": [0.5, 0.5, 0.5]}
_OF_GLASS = ("transmission_weight", "ior")
# A glow adds to every pixel, so none is darker but by noise; of the median of the target, which may be clipped
MOST_GLOW = 2.0
_AROUND = (Cause.LIGHT, Cause.SURROUNDINGS, Cause.PICTURE)  # where the surroundings differ
# Layers over a plain dielectric, and how much of one counts. A ball of strength 0.4 in a light probe looked the same as
# a metal with a coat and a sheen
LAYERS, LAYER = ("metallic", "specular_tint", "coat_weight", "sheen_weight"), 0.05
MANY_LAYERS = 3
# IOR of a glass that hardly bends light, and may stand for a surface that is cut out. One of 1.01 (the least) is 0.07
# FLIP from a ball with an Alpha of 0.5, *close*, and most likely was *same* once (docs/bench/README.md)
STRAIGHT = 1.05
POLISH = "polish"  # a stage that only fits on whole light paths have
PLAINER = "A plainer material looks the same as one with further layers, so it is the result."
PLAINER_GLOW = "A plainer material that glows looks the same as one of many layers, so it is the result."
CLEARLY_BETTER = 0.5  # times the difference of the first result, and less than that by so much FLIP
LEAST_GAIN = 0.01


@dataclass(frozen=True)
class MaterialClass:
    """A class with the values it begins with, and what a user is told.

    A fit of it changes what `all` stands for, or with `also` that, but never what is named so. A class that `glows` is
    believed only where its light is found on the surroundings, too. One with `further` lobes is of the
    scene's kind, so that values inside nodes are fitted, too; else they are those of the scene's material.
    """

    name: str
    sockets: Mapping[str, Any]
    also: tuple[str, ...] = ()
    never: tuple[str, ...] = ()
    glows: bool = False
    further: bool = False

    def may_explain(self, judgement: Judgement | None) -> bool:
        """Whether it may be what a result lacks: further lobes cast no other shadow, and no light."""
        return not self.further or judgement is None or judgement.cause not in _AROUND

    @property
    def note(self) -> str:
        """For the notes of a result."""
        return f"The material of the scene did not match, so the fit began again from one that is {self.name}."


def tried_notes(
    no_nearer: Sequence[MaterialClass], refused: Sequence[MaterialClass], failed: Sequence[MaterialClass]
) -> tuple[str, ...]:
    """Notes of a result that no other class took the place of: what was tried, what no fit holds, what has failed."""
    said = ["The material of the scene did not match."] if no_nearer or refused or failed else []
    if no_nearer:
        said.append(f"Fits that began again from one that is {_or(no_nearer)} came not clearly nearer.")
    if refused:
        said.append(f"No fit holds one that is {_or(refused)}.")
    if failed:
        said.append(f"Fits that began again from one that is {_or(failed)} failed: the log holds the details.")
    return (" ".join(said),) if said else ()


def _or(classes: Sequence[MaterialClass]) -> str:
    return " or ".join(other.name for other in classes)


# What an opaque material may have more of, by the value that is without effect in the scene
_FURTHER = {
    "anisotropic": MaterialClass("brushed", BRUSHED, ("anisotropic", "anisotropic_rotation"), _OF_GLASS, further=True),
    "coat_tint": MaterialClass("under a tinted coat", TINTED, ("coat_tint",), _OF_GLASS, further=True),
    "thin_film_thickness": MaterialClass(
        "under a thin film", FILMED, ("thin_film_thickness", "thin_film_ior"), _OF_GLASS, further=True
    ),
    "diffuse_roughness": MaterialClass("as rough as clay", CLAY, ("diffuse_roughness",), _OF_GLASS, further=True),
}
_CLASSES = (
    MaterialClass("of glass", GLASS),
    MaterialClass("cut out", CUT_OUT, ("alpha",), _OF_GLASS),
    MaterialClass("opaque", OPAQUE),
)


def _glowing(material: Mapping[str, Any], glow: float) -> MaterialClass:
    """Where nodes give the emission's colour, a class of its strength alone, which the mean of the colour begins at."""
    color = material["sockets"].get("Emission Color", {})
    if not color.get("linked"):
        sockets = GLOWING | {"Emission Strength": glow}
        return MaterialClass("glowing", sockets, ("emission_color",), _OF_GLASS, glows=True)
    mean = float(np.max(color.get("value") or 0.0))
    sockets = OPAQUE | {"Emission Strength": glow / mean if mean > 0.0 else 0.0}
    return MaterialClass("glowing", sockets, ("emission_strength",), _OF_GLASS, glows=True)


def brightest_glow(reference: Image, view: View, target: NDArray[np.bool_]) -> float:
    """The radiance that the emission of a target, True (height, width), is sought below; 0 for a black one."""
    pixels = reference.pixels if reference.encoding is Encoding.LINEAR else view.linear(reference.pixels)
    return MOST_GLOW * max(float(np.median(pixels[target], axis=0).max()), 0.0)


def other_classes(material: Mapping[str, Any], glow: float) -> list[MaterialClass]:
    """The classes that a material, as in request.json, may be changed to; none where links decide, or of a mix of
    shaders.

    Its own comes first if that changes more than a fit of `all` does. Then comes the one that glows, for its fit is the
    quickest; its emission is at most of the radiance `glow`. An opaque one may lack a lobe.
    """
    sockets = material["sockets"]
    if material.get("leaves"):
        return []
    own = _class_of(sockets)
    quick = [_glowing(material, glow)] if glow > 0.0 else []
    if own == "opaque":
        lacks = [name for name in _FURTHER if value_of(material, name) == PLAIN.get(name, 0.0)]
        quick += [_FURTHER[name] for name in lacks if name != "anisotropic" or _has_tangents(sockets)]
    classes = sorted((*quick, *_CLASSES), key=lambda other: other.name != own)
    return [
        other for other in classes
        if (other.name != own or other.also)
        and not any(sockets.get(name, {}).get("linked") for name in other.sockets)
    ]  # fmt: skip


def values_of_classes(material: Mapping[str, Any] | None) -> frozenset[str]:
    """Names of the values that fits from other classes have, and a fit of `all` from a material has not."""
    classes = [] if material is None else other_classes(material, 0.0)
    return frozenset(name for other in classes for name in other.also)


def _has_tangents(sockets: Mapping[str, Any]) -> bool:
    """Whether the meshes hold tangents, along which nothing is stretched yet."""
    tangent = sockets.get("Tangent", {})
    return bool(tangent.get("mesh")) and not tangent.get("linked")


def _class_of(sockets: Mapping[str, Any]) -> str:
    def value(name: str, default: float) -> float:
        found = sockets.get(name, {}).get("value")
        return default if found is None else float(found)

    if value("Alpha", 1.0) < 1.0:
        return "cut out"
    if value("Transmission Weight", 0.0) == 0.0:
        return "opaque"
    return "of glass" if value("Metallic", 0.0) == 0.0 else "glass under metal"


def changed(material: Mapping[str, Any], to: MaterialClass) -> dict[str, Any]:
    """The material with what the class begins with."""
    other = copy.deepcopy(dict(material))
    for name, value in to.sockets.items():
        other["sockets"].setdefault(name, {})["value"] = value
    if "Anisotropic" in to.sockets:
        other["sockets"]["Tangent"]["linked"] = True
    return other


def parameters_of(other: MaterialClass, names: Sequence[str]) -> str | list[str]:
    """What a fit of the class changes, of values that a fit of `all` changes otherwise."""
    if not other.also:
        return "all"
    return [*(name for name in names if name not in other.never), *other.also]


def value_of(material: Mapping[str, Any], name: str) -> Value:
    """A value of a material by the name of its parameter; Blender's own where the material has none."""
    socket = SOCKET_OF_PARAMETER[name]
    found = material["sockets"].get(socket, {}).get("value")
    return BLENDER_PRINCIPLED[name].default if found is None else socket_value(socket, found)


def is_worth_another(result: FitResult, selection: str | Sequence[str]) -> bool:
    """Whether a result may be of the wrong class and the user lets the fit change that."""
    judgement = result.judgement
    if judgement is None or selection != "all" or result.model != "blender_principled":
        return False
    if judgement.verdict is Verdict.SAME:
        return _is_straight_glass(result)
    # another class has another shadow, too, so light may seem to be the cause
    return judgement.cause not in (Cause.PICTURE, Cause.NOISE)


def _is_straight_glass(result: FitResult) -> bool:
    values = {name: float(np.ravel(result.recovered.get(name, 0.0))[0]) for name in _OF_GLASS}
    return values["transmission_weight"] > LAYER and 0.0 < values["ior"] < STRAIGHT


def with_values_of(other: MaterialClass, result: FitResult, material: Mapping[str, Any]) -> FitResult:
    """The result of a class with the values that the class has and the material lacks, which no fit has changed.

    The emission's colour is as bright as can be and its strength has the rest, as an artist would set them.
    """
    values = dict(result.recovered)
    for socket, value in other.sockets.items():
        name = PARAMETER_OF_SOCKET[socket]
        held = socket_value(socket, value)
        if name not in values and not np.allclose(held, value_of(material, name)):
            values[name] = held
    certainty = dict(result.certainty)
    if "emission_color" in other.also:
        color, strength = np.asarray(values["emission_color"]), float(other.sockets["Emission Strength"])
        peak = max(float(color.max()), 1e-6)
        values |= {"emission_color": tuple(float(c) for c in color / peak), "emission_strength": strength * peak}
        if (sure := certainty.get("emission_color")) is not None:
            certainty["emission_color"] = _brighter(sure, peak)
            certainty["emission_strength"] = replace(sure, sd=(strength * max(sure.sd),))
    own = [BLENDER_PRINCIPLED[name] for name in values if name in SOCKET_OF_PARAMETER]
    bounds = {p.name: (p.lower, p.upper) for p in own}
    return replace(result, recovered=values, certainty=certainty, bounds=bounds | dict(result.bounds))


def _brighter(sure: Certainty, peak: float) -> Certainty:
    """How sure the colour of a glow is that was `peak` at its brightest, and is 1: next to none has no sure colour."""
    sd = tuple(deviation / peak for deviation in sure.sd)
    if max(sd) >= WEAK_BELOW:
        return replace(sure, sd=sd, level=Level.NOT_TOLD_APART)
    is_less = max(sd) >= DETERMINED_BELOW and sure.level is not Level.NOT_TOLD_APART
    return replace(sure, sd=sd, level=Level.WEAK if is_less else sure.level)


def doubted(result: FitResult, other: FitResult, material: Mapping[str, Any]) -> FitResult:
    """A result as unsure as it is far from another one that explains the picture nearly as well or as well.

    What the other fit has not changed is as in the scene's material. An unsure value that has another value there was
    changed, so it is not told apart.
    """
    from ...fit.certainty.covariance import certainties_away  # which needs Mitsuba's variant to be set

    if not result.certainty:
        return result
    table = ParameterTable(_parameter(name, result) for name in result.certainty)
    near = {name: either({**other.initial, **other.recovered}, material, name) for name in table.names}
    away = table.pack(result.recovered) - table.pack(near)
    found = certainties_away(result.certainty, away, table)
    for name, certainty in found.items():
        if certainty.level is Level.NOT_VISIBLE and np.any(away[table.slice_of(name)]):
            found[name] = replace(certainty, level=Level.NOT_TOLD_APART)
    return replace(result, certainty=found)


def _parameter(name: str, result: FitResult) -> Parameter:
    if name in SOCKET_OF_PARAMETER:
        return BLENDER_PRINCIPLED[name]
    value = result.recovered[name]  # inside nodes
    return Parameter(name, np.size(value), *result.bounds[name], default=value)


def either(values: Mapping[str, Value], material: Mapping[str, Any], name: str) -> Value:
    """A value where `values` have it, else as the material has it."""
    return values[name] if name in values else value_of(material, name)


def look_alike(first: Judgement, second: Judgement) -> bool:
    """Whether no eye sees which of two results is nearer to the reference."""
    return abs(first.target.visible - second.target.visible) < LEAST_GAIN


def is_rich(result: FitResult, selection: str | Sequence[str]) -> bool:
    """Whether a result that looks the same has so many layers that a plain material which glows may be the truth."""
    judgement = result.judgement
    if judgement is None or selection != "all" or result.model != "blender_principled":
        return False
    return judgement.verdict is Verdict.SAME and _layers(result.recovered, result.initial) >= MANY_LAYERS


def new_layers(result: FitResult, selection: str | Sequence[str]) -> list[str]:
    """The layers of a result from whole light paths that looks the same, which the scene's material lacks.

    There no other solution is looked for that explains the picture as well; recorded light has the plainest of them.
    """
    judgement, values = result.judgement, result.recovered
    if judgement is None or selection != "all" or judgement.verdict is not Verdict.SAME:
        return []
    if result.model != "blender_principled" or not any(stage.name == POLISH for stage in result.stages):
        return []
    return [name for name in LAYERS if _has(name, values) and not _has(name, result.initial)]


def without_layers(names: Sequence[str], layers: Sequence[str]) -> list[str]:
    """What is left of the values without these layers and their details."""
    return [name for name in names if name not in layers and AMOUNT_OF.get(name) not in layers]


def is_plainer(glowing: FitResult, than: FitResult, material: Mapping[str, Any]) -> bool:
    """Whether a result has fewer layers that the scene's material lacks, its glow being one."""
    own = {name: value_of(material, name) for name in LAYERS}
    return _layers(glowing.recovered, own) + 1 < _layers(than.recovered, own)


def _layers(values: Mapping[str, Value], own: Mapping[str, Value]) -> int:
    """How many of the layers `values` have and a material of its `own` lacks; of a tint what is not white."""
    return sum(_has(name, values) and not _has(name, own) for name in LAYERS)


def _has(layer: str, values: Mapping[str, Value]) -> bool:
    plain = 1.0 if layer.endswith("_tint") else 0.0
    return bool(np.max(np.abs(np.subtract(values.get(layer, plain), plain))) > LAYER)


def is_better(judgement: Judgement | None, than: Judgement, other: MaterialClass) -> bool:
    """Whether the result of another class is clearly nearer to the reference."""
    if judgement is None or (other.glows and judgement.cause in _AROUND):
        return False
    before, after = than.target.visible, judgement.target.visible
    return after < min(CLEARLY_BETTER * before, before - LEAST_GAIN)
