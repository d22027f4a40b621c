# SPDX-License-Identifier: GPL-3.0-or-later
"""What lies behind what the camera sees first: outputs for each time that a ray meets the target, in one render."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import bpy
import numpy as np
from numpy.typing import NDArray

from ..versions import active_output
from .aov_render import Frame
from .graph_copy import nodes_of

Key = TypeVar("Key")
FAR_SIDE = 1  # the depth at which the camera would see the far side of a target
# Subpixels along a pixel there, which mirrors and bounces show, of large pictures: with four a graph took 1.7 times as
# long at 512 x 512. Small ones are as fine as the near side, since a mirror may show the rim as broad as the middle;
# with twice as many subpixels that would be 0.4 seconds more
FAR_SCALE = 2
MOST_FINE_SUBPIXELS = 100_000  # of the near side
LIGHT_PATH, DEPTH = "ShaderNodeLightPath", "Transparent Depth"


def at_depth(name: str, depth: int) -> str:
    """The name of an output at a depth; the first keeps its own."""
    return f"{name} depth {depth}" if depth else name


def peeled(tree: bpy.types.NodeTree, outputs: Sequence[tuple[str, bool]], depths: int) -> list[tuple[str, bool]]:
    """Let the outputs of a copied tree, and of its groups, tell so many depths apart; returns all of them.

    Until the last the surface lets the ray pass. Outputs of surfaces that do so add up, hence each counts at its own
    depth alone.
    """
    if depths == 1:
        return list(outputs)
    for node in list(nodes_of(tree)):
        if node.bl_idname == "ShaderNodeOutputAOV":
            for depth in range(depths):
                _put_output(node, depth)
            node.id_data.nodes.remove(node)
    output, path = active_output(tree), tree.nodes.new(LIGHT_PATH)
    assert output is not None  # the surface is linked to it
    surface = output.inputs["Surface"].links[0].from_socket
    mix, is_last = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeMath")
    is_last.operation = "GREATER_THAN"
    is_last.inputs[1].default_value = depths - 1.5
    tree.links.new(path.outputs[DEPTH], is_last.inputs[0])
    tree.links.new(is_last.outputs[0], mix.inputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeBsdfTransparent").outputs[0], mix.inputs[1])
    tree.links.new(surface, mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return [(at_depth(name, depth), is_color) for name, is_color in outputs for depth in range(depths)]


def joined_depths(
    found: Mapping[str, NDArray[np.float32]], outputs: Sequence[tuple[str, bool]], depths: Sequence[int]
) -> dict[str, NDArray[np.float32]]:
    """The pictures of these depths, one below the other, by the outputs' own names."""
    return {name: np.concatenate([found[at_depth(name, depth)] for depth in depths]) for name, _ in outputs}


def scale_of_far_side(near: Frame) -> int:
    """The subpixels along a pixel of a picture of the far side, beside one of the near side."""
    subpixels = (near.right - near.left) * (near.bottom - near.top)
    return near.scale if subpixels <= MOST_FINE_SUBPIXELS else FAR_SCALE


def with_far_side(
    near: Mapping[Key, NDArray[np.float32]], far: Mapping[Key, NDArray[np.float32]]
) -> dict[Key, NDArray[np.float32]]:
    """Pictures (height, width, 1 or 3) with ones of the far side, as fine or coarser, below them."""
    return {name: np.concatenate([picture, _finer(far[name], picture.shape)]) for name, picture in near.items()}


def _finer(picture: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """A picture of this height and width, with bilinear interpolation."""
    for axis in (0, 1):
        size, coarse = shape[axis], picture.shape[axis]
        place = np.clip((np.arange(size) + 0.5) * coarse / size - 0.5, 0.0, coarse - 1.0)
        before = np.minimum(place.astype(int), max(coarse - 2, 0))
        after = np.minimum(before + 1, coarse - 1)
        part = (place - before).astype(np.float32).reshape((-1, 1, 1) if axis == 0 else (-1, 1))
        picture = (1.0 - part) * picture.take(before, axis) + part * picture.take(after, axis)
    return picture


def _put_output(node: bpy.types.Node, depth: int) -> None:
    """An output like `node` that is 0 at all depths but one."""
    tree = node.id_data
    is_color = node.inputs["Color"].is_linked
    source = node.inputs["Color" if is_color else "Value"].links[0].from_socket
    path, is_here = tree.nodes.new(LIGHT_PATH), tree.nodes.new("ShaderNodeMath")
    is_here.operation = "COMPARE"
    is_here.inputs[1].default_value, is_here.inputs[2].default_value = depth, 0.5
    tree.links.new(path.outputs[DEPTH], is_here.inputs[0])
    scaled = tree.nodes.new("ShaderNodeVectorMath" if is_color else "ShaderNodeMath")
    scaled.operation = "SCALE" if is_color else "MULTIPLY"
    tree.links.new(source, scaled.inputs[0])
    tree.links.new(is_here.outputs[0], scaled.inputs["Scale"] if is_color else scaled.inputs[1])
    made = tree.nodes.new("ShaderNodeOutputAOV")
    made.aov_name = at_depth(node.aov_name, depth)
    tree.links.new(scaled.outputs[0], made.inputs["Color" if is_color else "Value"])
