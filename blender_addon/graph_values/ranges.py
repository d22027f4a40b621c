# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a value of a node may go in a fit, and the difference that its derivative is taken over."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import bpy

# Whose values join the set *All*: colours, what colour nodes do with them, and numbers that are what a socket gets.
# Positions, scales and coordinates, which may have many minima, and all other numbers are named by the user
COLOR, SETTING, NUMBER = "color", "setting", "number"
BY_DEFAULT = (COLOR, SETTING)

# Of the range; forward differences of a float32 picture, measured on graphs of noise, ramps and bumps
STEP, ROUGH_STEP, LOGARITHMIC_STEP = 0.002, 0.01, 0.004
FACTOR = 4.0  # a scale may be this many times smaller or larger than it is
CURVES = ("ShaderNodeRGBCurve", "ShaderNodeFloatCurve")
MIXES = ("ShaderNodeMix", "ShaderNodeMixRGB")


@dataclass(frozen=True)
class Range:
    """Bounds, the group that the value belongs to, whether it counts by factors, the share of the range that a
    difference takes, and whether it has many minima."""

    lower: float
    upper: float
    group: str = NUMBER
    logarithmic: bool = False
    step: float = STEP
    scanned: bool = False


GAIN, OFFSET = Range(0.0, 4.0), Range(-0.5, 0.5)  # of a picture
FROM_0_TO_1 = Range(0.0, 1.0, SETTING)
# by node and name of the input; what is not here goes by its value
SETTINGS = {
    ("ShaderNodeHueSaturation", "Hue"): FROM_0_TO_1,
    ("ShaderNodeHueSaturation", "Saturation"): Range(0.0, 2.0, SETTING),
    ("ShaderNodeHueSaturation", "Value"): Range(0.0, 2.0, SETTING),
    ("ShaderNodeBrightContrast", "Bright"): Range(-0.5, 0.5, SETTING),
    ("ShaderNodeBrightContrast", "Brightness"): Range(-0.5, 0.5, SETTING),
    ("ShaderNodeBrightContrast", "Contrast"): Range(-1.0, 1.0, SETTING),
    ("ShaderNodeGamma", "Gamma"): Range(0.2, 5.0, SETTING, logarithmic=True, step=LOGARITHMIC_STEP),
    ("ShaderNodeBump", "Strength"): Range(0.0, 1.0, SETTING, step=ROUGH_STEP, scanned=True),
    ("ShaderNodeNormalMap", "Strength"): Range(0.0, 2.0, SETTING, step=ROUGH_STEP, scanned=True),
    ("ShaderNodeTexNoise", "Detail"): Range(0.0, 15.0, step=ROUGH_STEP),
    ("ShaderNodeTexNoise", "Distortion"): Range(-2.0, 2.0, step=ROUGH_STEP),
}
# Inputs by which a node passes amounts on: what comes out is a sum or a multiple of them, and so is what a socket gets
# that nothing else lies before
AMOUNTS = {
    "ShaderNodeMapRange": ("To Min", "To Max"),
    "ShaderNodeMix": ("A", "B"),
    "ShaderNodeMixRGB": ("Color1", "Color2"),
    "ShaderNodeClamp": ("Value",),
    "ShaderNodeMath": ("Value",),
    "ShaderNodeVectorMath": ("Vector",),
    "ShaderNodeCombineColor": ("Red", "Green", "Blue"),
}
OF_SUMS, OF_PRODUCTS = ("ADD", "SUBTRACT", "MULTIPLY_ADD"), ("MULTIPLY", "DIVIDE")
# Nodes whose own numbers are dials. Those of Math are none: a picture with a factor stays one, and 1 - x an inverse
DIALS = ("ShaderNodeGroup", "ShaderNodeValue", "ShaderNodeMapRange", "ShaderNodeMix")
# A glow may be so many times as strong as it is, as by its own socket: nothing says that 1 is the most. No measurement
STRONGER = 5.0
LEFT_OUT = (("ShaderNodeBump", "Filter Width"),)  # how nodes are sampled, and not what they show
DIRECTION = ("ShaderNodeNormalMap", "Color")  # an input whose colour is a direction
SCALES = ("Scale", "Distance", "Lacunarity", "Brick Width", "Row Height", "Detail Scale")


def range_of_input(node: bpy.types.Node, socket: bpy.types.NodeSocket, value: float) -> Range:
    """The range of a number that an input holds, or of one component of a vector."""
    known = SETTINGS.get((node.bl_idname, socket.name))
    if known is not None:
        return _around(known, value)
    if node.bl_idname == "ShaderNodeMapping" and socket.name == "Rotation":
        return Range(value - math.pi / 4, value + math.pi / 4, step=ROUGH_STEP)
    if node.bl_idname == "ShaderNodeMapping" and socket.name == "Location":
        return Range(value - 1.0, value + 1.0)
    if socket.name in SCALES and value > 0.0:
        many = socket.name == "Scale" and node.bl_idname != "ShaderNodeBump"
        return Range(value / FACTOR, value * FACTOR, logarithmic=True, step=LOGARITHMIC_STEP, scanned=many)
    if socket.bl_idname == "NodeSocketFloatFactor":
        step = ROUGH_STEP if node.bl_idname in MIXES else STEP
        return _around(Range(0.0, 1.0, SETTING if node.bl_idname in MIXES else NUMBER, step=step), value)
    return plain_range(value)


def amounts_of(node: bpy.types.Node) -> tuple[str, ...]:
    """The names of a node's inputs that pass amounts on."""
    operation = getattr(node, "operation", None)
    if operation is not None and operation not in (*OF_SUMS, *OF_PRODUCTS):
        return ()
    return AMOUNTS.get(node.bl_idname, ())


def range_of_amount(fed: bpy.types.Node, value: float, *, of_strength: bool = False) -> Range:
    """The range of a number that a socket of the target gets, or a part of it; `fed` is the node that takes it.

    That `of_strength` is one of a glow's.
    """
    if of_strength and value > 0.0:
        return Range(0.0, STRONGER * value, SETTING)
    operation = getattr(fed, "operation", None)
    if operation in OF_PRODUCTS and 0.0 <= value <= 1.0:
        return Range(0.0, 2.0, SETTING)
    if operation in OF_SUMS and -1.0 <= value <= 1.0:
        return Range(-1.0, 1.0, SETTING)
    return replace(plain_range(value), group=SETTING)


def plain_range(value: float) -> Range:
    """The range of a number of which nothing is known but its value."""
    return Range(0.0, 1.0) if 0.0 <= value <= 1.0 else Range(value - abs(value), value + abs(value))


def range_of_stop(ramp: bpy.types.ColorRamp, number: int) -> Range:
    """The range of a stop's position: halfway to its neighbours, for stops that pass each other change their order."""
    places = [stop.position for stop in ramp.elements]
    lower = 0.5 * (places[number - 1] + places[number]) if number > 0 else 0.0
    upper = 0.5 * (places[number] + places[number + 1]) if number + 1 < len(places) else 1.0
    return Range(lower, upper, step=min(ROUGH_STEP / max(upper - lower, ROUGH_STEP), 0.2))


def _around(known: Range, value: float) -> Range:
    """The range, wider where the value is outside of it."""
    lower, upper = min(known.lower, value), max(known.upper, value)
    return Range(lower, upper, known.group, known.logarithmic and lower > 0.0, known.step, known.scanned)
