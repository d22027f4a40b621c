# SPDX-License-Identifier: GPL-3.0-or-later
"""Formulas of Cycles' nodes (`kernel/svm`) whose outputs follow from the numbers at their inputs alone.

A formula is a function of the node and of `read`, which gives an input by its number or identifier: float32 (places, 1)
of a number, (places, 3) of a colour or vector. It returns the outputs in their order, or by identifier.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import bpy
import numpy as np

from .colors import BLENDS, Numbers, grey, hsv_to_rgb, mixed, quotient, rgb_to_hsv

Read = Callable[[int | str], Numbers]
OfOneSetting = Callable[[Numbers, Numbers, Numbers], Numbers]
Found = Sequence[Numbers] | Mapping[str, Numbers]
TABLE = np.arange(257) / 256  # where Cycles looks a ramp and a curve up for its table (RAMP_TABLE_SIZE)


class NoFormulaError(Exception):
    """A node, or this setting of it, is not among the formulas."""


def _power(a: Numbers, b: Numbers, _: Numbers) -> Numbers:
    with np.errstate(all="ignore"):
        found = np.power(a, b)
    whole = (a >= 0.0) | (b == np.trunc(b))
    return np.where(b == 0.0, 1.0, np.where(whole & (a != 0.0), found, 0.0))


def _logarithm(a: Numbers, b: Numbers, _: Numbers) -> Numbers:
    known = (a > 0.0) & (b > 0.0)
    return np.where(known, quotient(np.log(np.where(known, a, 1.0)), np.log(np.where(known, b, 1.0))), 0.0)


def _wrapped(a: Numbers, most: Numbers, least: Numbers) -> Numbers:
    return np.where(most != least, a - (most - least) * np.floor(quotient(a - least, most - least)), least)


def _smooth_least(a: Numbers, b: Numbers, k: Numbers) -> Numbers:
    h = quotient(np.maximum(k - np.abs(a - b), 0.0), k)
    return np.minimum(a, b) - h**3 * k / 6.0


def _ping_pong(a: Numbers, b: Numbers, _: Numbers) -> Numbers:
    turn = quotient(a - b, 2.0 * b)
    return np.abs((turn - np.floor(turn)) * 2.0 * b - b)


_MATH: Mapping[str, Callable[[Numbers, Numbers, Numbers], Numbers]] = {
    "ADD": lambda a, b, _: a + b,
    "SUBTRACT": lambda a, b, _: a - b,
    "MULTIPLY": lambda a, b, _: a * b,
    "DIVIDE": lambda a, b, _: quotient(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": _power,
    "LOGARITHM": _logarithm,
    "SQRT": lambda a, b, _: np.sqrt(np.maximum(a, 0.0)),
    "INVERSE_SQRT": lambda a, b, _: np.where(a > 0.0, 1.0 / np.sqrt(np.where(a > 0.0, a, 1.0)), 0.0),
    "ABSOLUTE": lambda a, b, _: np.abs(a),
    "EXPONENT": lambda a, b, _: np.exp(a),
    "MINIMUM": lambda a, b, _: np.minimum(a, b),
    "MAXIMUM": lambda a, b, _: np.maximum(a, b),
    "LESS_THAN": lambda a, b, _: (a < b).astype(np.float32),
    "GREATER_THAN": lambda a, b, _: (a > b).astype(np.float32),
    "SIGN": lambda a, b, _: np.sign(a),
    "COMPARE": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, np.finfo(np.float32).eps)).astype(np.float32),
    "SMOOTH_MIN": _smooth_least,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_least(-a, -b, c),
    "ROUND": lambda a, b, _: np.floor(a + 0.5),
    "FLOOR": lambda a, b, _: np.floor(a),
    "CEIL": lambda a, b, _: np.ceil(a),
    "TRUNC": lambda a, b, _: np.trunc(a),
    "FRACT": lambda a, b, _: a - np.floor(a),
    "MODULO": lambda a, b, _: np.where(b != 0.0, np.fmod(a, np.where(b != 0.0, b, 1.0)), 0.0),
    "WRAP": _wrapped,
    "SNAP": lambda a, b, _: np.floor(quotient(a, b)) * b,
    "PINGPONG": _ping_pong,
    "SINE": lambda a, b, _: np.sin(a),
    "COSINE": lambda a, b, _: np.cos(a),
    "TANGENT": lambda a, b, _: np.tan(a),
    "ARCSINE": lambda a, b, _: np.arcsin(np.clip(a, -1.0, 1.0)),
    "ARCCOSINE": lambda a, b, _: np.arccos(np.clip(a, -1.0, 1.0)),
    "ARCTANGENT": lambda a, b, _: np.arctan(a),
    "ARCTAN2": lambda a, b, _: np.arctan2(a, b),
    "RADIANS": lambda a, b, _: np.radians(a),
    "DEGREES": lambda a, b, _: np.degrees(a),
}
# the same by each component, where vectors know the operation
_OF_VECTORS = (
    "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "ABSOLUTE", "MINIMUM", "MAXIMUM", "FLOOR", "CEIL",
    "MODULO", "WRAP", "SNAP", "SINE", "COSINE", "TANGENT",
)  # fmt: skip


def _math(node: bpy.types.Node, read: Read) -> Found:
    if node.operation not in _MATH:
        raise NoFormulaError(node.operation)
    found = _MATH[node.operation](read(0), read(1), read(2))
    return [np.clip(found, 0.0, 1.0) if node.use_clamp else found]


def _vector_math(node: bpy.types.Node, read: Read) -> Found:
    a, b = read(0), read(1)
    if node.operation in _OF_VECTORS:
        return {"Vector": _MATH[node.operation](a, b, read(2))}
    if node.operation == "FRACTION":
        return {"Vector": a - np.floor(a)}
    if node.operation == "SCALE":
        return {"Vector": a * read("Scale")}
    if node.operation == "DOT_PRODUCT":
        return {"Value": (a * b).sum(axis=1, keepdims=True)}
    if node.operation in ("LENGTH", "DISTANCE"):
        return {"Value": np.linalg.norm(a if node.operation == "LENGTH" else a - b, axis=1, keepdims=True)}
    if node.operation == "NORMALIZE":
        return {"Vector": quotient(a, np.linalg.norm(a, axis=1, keepdims=True))}
    raise NoFormulaError(node.operation)


def _looked_up(table: Numbers, at: Numbers, *, steps: bool = False, goes_on: bool = False) -> Numbers:
    """Rows (places, numbers) of a table of [0, 1]: those between two entries, or the one below where it has `steps`.

    Beyond the table its first and last rows hold, or its slope there where it `goes_on`.
    """
    last = len(table) - 1
    place = np.clip(at[:, 0], 0.0, 1.0) * last
    below = np.clip(place.astype(np.int32), 0, last)
    if steps:
        return table[below]
    found = mixed(table[below], table[np.minimum(below + 1, last)], (place - below)[:, None])
    if goes_on:
        low, high = np.minimum(at, 0.0) * last, np.maximum(at - 1.0, 0.0) * last
        found = found + low * (table[1] - table[0]) + high * (table[-1] - table[-2])
    return found


def _ramp(node: bpy.types.Node, read: Read) -> Found:
    ramp = node.color_ramp
    table = np.array([ramp.evaluate(x) for x in TABLE], np.float32)
    found = _looked_up(table, read(0), steps=ramp.interpolation == "CONSTANT")
    return [found[:, :3], found[:, 3:]]


def _curves(node: bpy.types.Node, read: Read) -> Found:
    """Of colours each channel by its own curve after the one for all; of a number by the only curve."""
    mapping = node.mapping
    mapping.initialize()
    own = [curve.points for curve in mapping.curves]
    first, last = min(points[0].location[0] for points in own), max(points[-1].location[0] for points in own)
    at = first + (last - first) * TABLE
    *channels, of_all = mapping.curves
    if channels:
        at = [mapping.evaluate(of_all, x) for x in at]
    tables = [np.array([[mapping.evaluate(curve, x)] for x in at], np.float32) for curve in channels or [of_all]]
    share, values = read(0), read(1)
    goes_on = mapping.extend == "EXTRAPOLATED"
    found = [
        _looked_up(table, (values[:, k : k + 1] - first) / (last - first), goes_on=goes_on)
        for k, table in enumerate(tables)
    ]
    return [mixed(values, np.concatenate(found, axis=1), share)]


def _hue_saturation(_: bpy.types.Node, read: Read) -> Found:
    hue, saturation, value, share, color = (read(k) for k in range(5))
    hsv = rgb_to_hsv(color)
    parts = [(hsv[:, :1] + hue + 0.5) % 1.0, np.clip(hsv[:, 1:2] * saturation, 0.0, 1.0), hsv[:, 2:] * value]
    changed = hsv_to_rgb(np.concatenate(np.broadcast_arrays(*parts), axis=1))
    return [np.maximum(mixed(color, changed, share), 0.0)]


def _bright_contrast(_: bpy.types.Node, read: Read) -> Found:
    color, bright, contrast = (read(k) for k in range(3))
    return [np.maximum((1.0 + contrast) * color + bright - 0.5 * contrast, 0.0)]


def _gamma(_: bpy.types.Node, read: Read) -> Found:
    color, gamma = read(0), read(1)
    bent = np.where(color > 0.0, np.where(color > 0.0, color, 1.0) ** gamma, color)
    return [np.where(gamma == 0.0, 1.0, bent)]


def _mix(node: bpy.types.Node, read: Read) -> Found:
    """`ShaderNodeMix`, whose inputs hang on what it mixes."""
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
    if kind is None:
        raise NoFormulaError(node.data_type)
    by_component = kind == "Vector" and node.factor_mode == "NON_UNIFORM"
    share = read("Factor_Vector" if by_component else "Factor_Float")
    share = np.clip(share, 0.0, 1.0) if node.clamp_factor else share
    a, b = read(f"A_{kind}"), read(f"B_{kind}")
    found = BLENDS[node.blend_type](share, a, b) if kind == "Color" else mixed(a, b, share)
    return {f"Result_{kind}": np.clip(found, 0.0, 1.0) if kind == "Color" and node.clamp_result else found}


def _mix_rgb(node: bpy.types.Node, read: Read) -> Found:
    """The Mix of before Blender 3.4, which old files hold."""
    found = BLENDS[node.blend_type](np.clip(read(0), 0.0, 1.0), read(1), read(2))
    return [np.clip(found, 0.0, 1.0) if node.use_clamp else found]


def _map_range(node: bpy.types.Node, read: Read) -> Found:
    if node.data_type != "FLOAT":
        raise NoFormulaError(node.data_type)
    value, from_min, from_max, to_min, to_max = (read(k) for k in range(5))
    t = quotient(value - from_min, from_max - from_min)
    kind = node.interpolation_type
    if kind == "STEPPED":
        t = quotient(np.floor(t * (read(5) + 1.0)), np.maximum(read(5), 0.0))
    elif kind != "LINEAR":
        t = np.clip(t, 0.0, 1.0)
        t = t * t * (3.0 - 2.0 * t) if kind == "SMOOTHSTEP" else t**3 * (t * (t * 6.0 - 15.0) + 10.0)
    found = to_min + t * (to_max - to_min)
    if node.clamp and kind in ("LINEAR", "STEPPED"):
        found = np.clip(found, np.minimum(to_min, to_max), np.maximum(to_min, to_max))
    return {"Result": np.where(from_max != from_min, found, 0.0)}


def _clamp(node: bpy.types.Node, read: Read) -> Found:
    value, least, most = (read(k) for k in range(3))
    if node.clamp_type == "RANGE":
        least, most = np.minimum(least, most), np.maximum(least, most)
    return [np.minimum(np.maximum(value, least), most)]


def _separate_color(node: bpy.types.Node, read: Read) -> Found:
    color = read(0)
    if node.mode not in ("RGB", "HSV"):
        raise NoFormulaError(node.mode)
    return np.split(rgb_to_hsv(color) if node.mode == "HSV" else color, 3, axis=1)


def _combine_color(node: bpy.types.Node, read: Read) -> Found:
    if node.mode != "RGB":
        raise NoFormulaError(node.mode)
    return _joined(node, read)


def _joined(_: bpy.types.Node, read: Read) -> Found:
    return [np.concatenate(np.broadcast_arrays(read(0), read(1), read(2)), axis=1)]


FORMULAS: Mapping[str, Callable[[bpy.types.Node, Read], Found]] = {
    "ShaderNodeValue": lambda node, _: [np.full((1, 1), node.outputs[0].default_value, np.float32)],
    "ShaderNodeRGB": lambda node, _: [np.array([node.outputs[0].default_value[:3]], np.float32)],
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeRGBCurve": _curves,
    "ShaderNodeFloatCurve": _curves,
    "ShaderNodeHueSaturation": _hue_saturation,
    "ShaderNodeBrightContrast": _bright_contrast,
    "ShaderNodeGamma": _gamma,
    "ShaderNodeInvert": lambda _, read: [mixed(read(1), 1.0 - read(1), read(0))],
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeRGBToBW": lambda _, read: [grey(read(0))],
    "ShaderNodeSeparateColor": _separate_color,
    "ShaderNodeCombineColor": _combine_color,
    "ShaderNodeSeparateXYZ": lambda _, read: np.split(read(0), 3, axis=1),
    "ShaderNodeCombineXYZ": _joined,
}


def _bumped(strength: Numbers, at_1: Numbers, normal: Numbers) -> Numbers:
    return mixed(normal, at_1, np.maximum(strength, 0.0))  # `svm_node_set_bump`


def _facing(blend: Numbers, at_half: Numbers, _: Numbers) -> Numbers:
    blend = np.clip(blend, 0.0, 1.0 - 1e-5)  # `svm_node_layer_weight`
    return 1.0 - (1.0 - at_half) ** np.where(blend < 0.5, 2.0 * blend, 0.5 / (1.0 - blend))


# Outputs that one input changes in a known way, by node and name: that input, a value of it at which the output is
# known, and the output by the input, what it is there, and the surface's own normal
OF_ONE_SETTING: Mapping[tuple[str, str], tuple[str, float, OfOneSetting]] = {
    ("ShaderNodeBump", "Normal"): ("Strength", 1.0, _bumped),
    ("ShaderNodeLayerWeight", "Facing"): ("Blend", 0.5, _facing),
}
