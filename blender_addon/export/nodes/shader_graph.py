# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading shader node trees: what a socket is linked to, constants, and pictures with simple operations on them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...versions import active_output
from ..images.color_space import to_rec709
from ..images.image_filter import filtered_pixels
from ..images.image_pixels import MAGENTA, UnreadableImageError, is_missing
from ..material_model import Socket, Texture
from .merged_nodes import is_alpha_read

MOST_NODES = 32  # between a picture and a socket, on all ways; Cycles evaluates what is larger
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], dtype=np.float32)
WRAPS = {"REPEAT": "repeat", "EXTEND": "clamp", "MIRROR": "mirror"}
FILTERS = {"Linear": "bilinear", "Cubic": "bilinear", "Smart": "bilinear", "Closest": "nearest"}
MATH = {
    "ADD": np.add,
    "SUBTRACT": np.subtract,
    "MULTIPLY": np.multiply,
    "DIVIDE": lambda a, b: np.divide(a, b, out=np.zeros_like(a + b), where=np.asarray(b) != 0.0),
    "POWER": lambda a, b: np.power(np.maximum(a, 0.0), b),
    "MAXIMUM": np.maximum,
    "MINIMUM": np.minimum,
}


# those that bend a picture's numbers, which Cycles interpolates before them
BENDING = ("POWER", "MAXIMUM", "MINIMUM")
NOT_IN_CYCLES = ("ShaderNodeShaderToRGB", "NodeUndefined")  # what they feed has no link there


@dataclass(frozen=True)
class _Way:
    """From a socket towards a picture: each node takes one of `left`; `bends` says that one was no straight line."""

    left: Iterator[int]
    bends: bool = False


class UnsupportedNodeError(Exception):
    """A node tree holds something that is not exported; the message names it, as part of a sentence."""


class Links:
    """The links of node trees by where they end, for one walk: `socket.links` looks through all of a tree each time."""

    def __init__(self) -> None:
        self._of: dict[int, dict[int, bpy.types.NodeLink]] = {}
        self._from: dict[int, Counter[int]] = {}

    def into(self, socket: bpy.types.NodeSocket) -> bpy.types.NodeLink:
        """The link into a linked input."""
        found = self.any_into(socket)
        assert found is not None
        return found

    def any_into(self, socket: bpy.types.NodeSocket) -> bpy.types.NodeLink | None:
        """The link into an input, be it valid or not; None where there is none."""
        tree = socket.id_data
        known = self._of.get(tree.as_pointer())
        if known is None:
            known = {link.to_socket.as_pointer(): link for link in tree.links}
            self._of[tree.as_pointer()] = known
        return known.get(socket.as_pointer())

    def count_from(self, output: bpy.types.NodeSocket) -> int:
        """How many links begin at an output."""
        tree = output.id_data
        known = self._from.get(tree.as_pointer())
        if known is None:
            known = self._from[tree.as_pointer()] = Counter(link.from_socket.as_pointer() for link in tree.links)
        return known[output.as_pointer()]


def source_of(socket: bpy.types.NodeSocket, links: Links | None = None) -> bpy.types.NodeSocket | None:
    """Return the output socket that feeds `socket`, or None if nothing does; `links` are those of a longer walk.

    Reroutes are skipped, and so are muted nodes: what they let through is an input of theirs, or nothing.
    """
    while socket.is_linked:
        link = socket.links[0] if links is None else links.into(socket)
        if link.is_muted or not link.is_valid:
            return None
        node, output = link.from_node, link.from_socket
        if node.bl_idname == "NodeReroute":
            socket, links = node.inputs[0], links or Links()
            continue
        if not node.mute:
            return None if node.bl_idname in NOT_IN_CYCLES else output
        through = next((inner.from_socket for inner in node.internal_links if inner.to_socket == output), None)
        if through is None:
            return None
        if not through.is_linked:
            return output  # of a muted node, which is refused
        socket = through
    return None


def surface_of(tree: bpy.types.NodeTree | None) -> bpy.types.Node | None:
    """Return the shader node linked to Surface of the output that Cycles uses."""
    output = active_output(tree)
    if output is None:
        return None
    source = source_of(output.inputs["Surface"])
    return None if source is None else source.node


def group_of_output(tree: bpy.types.NodeTree | None) -> str | None:
    """The group node, of a tree without an output of its own, that has one with a surface, which Cycles shows then."""
    if tree is None or active_output(tree) is not None:
        return None
    groups = (node for node in tree.nodes if node.bl_idname == "ShaderNodeGroup" and not node.mute and node.node_tree)
    inside = (node.name for node in groups if surface_of(node.node_tree) or group_of_output(node.node_tree))
    return next(inside, None)


def plain_value(socket: bpy.types.NodeSocket) -> Any:
    """Return a socket's own value: float, bool, or a list of three (colours as linear Rec.709)."""
    value = socket.default_value
    if socket.type == "RGBA":
        return [float(component) for component in to_rec709(list(value)[:3])]
    if socket.type == "VECTOR":
        return [float(component) for component in list(value)[:3]]
    return bool(value) if socket.type == "BOOLEAN" else float(value)


def emission_of(tree: bpy.types.NodeTree) -> NDArray[np.float64] | None:
    """Return colour times strength of a lone Emission or Background shader with plain values, else None."""
    node = surface_of(tree)
    if node is None:
        return np.zeros(3)
    if node.bl_idname not in ("ShaderNodeEmission", "ShaderNodeBackground"):
        return None
    try:
        color, strength = read_socket(node.inputs["Color"]), read_socket(node.inputs["Strength"])
    except UnsupportedNodeError:
        return None
    if color.texture is not None or strength.texture is not None:
        return None
    return np.asarray(color.value, dtype=np.float64) * float(strength.value)


def read_socket(socket: bpy.types.NodeSocket) -> Socket:
    """Return value and picture of `socket`.

    Raises
    ------
    UnsupportedNodeError
        If it is linked to something that is neither a constant nor a picture with simple operations.
    """
    source = source_of(socket)
    if source is None:
        return Socket(plain_value(socket))
    found = _evaluate(source, _Way(iter(range(MOST_NODES))))
    is_color = socket.type == "RGBA"
    if isinstance(found, Texture):
        pixels = found.pixels
        if not is_color and pixels.shape[2] == 3:
            pixels = (pixels @ LUMINANCE)[:, :, None]
        elif is_color and pixels.shape[2] == 1:
            pixels = np.repeat(pixels, 3, axis=2)
        mean = pixels.mean(axis=(0, 1), dtype=np.float64)
        value = [float(component) for component in mean] if is_color else float(mean[0])
        return Socket(value, True, replace(found, pixels=np.ascontiguousarray(pixels, dtype=np.float32)))
    if is_color:
        return Socket([float(component) for component in np.broadcast_to(found, 3)], True)
    value = float(found[0] if found.size == 1 else found @ LUMINANCE)
    return Socket(value, True)


def _evaluate(output: bpy.types.NodeSocket, way: _Way) -> Texture | NDArray[np.float64]:
    """Return a picture, or a constant of one or three numbers, for an output socket."""
    node = output.node
    if next(way.left, None) is None:
        raise UnsupportedNodeError(f"the node '{node.name}' among more than {MOST_NODES}")
    kind = node.bl_idname
    if node.mute:
        raise UnsupportedNodeError(f"the muted node '{node.name}'")
    if kind == "ShaderNodeValue":
        return np.array([output.default_value], dtype=np.float64)
    if kind == "ShaderNodeRGB":
        return to_rec709(list(output.default_value)[:3])
    if kind == "ShaderNodeTexImage" and is_missing(node.image) and node.extension in WRAPS:
        return np.ones(1) if output.name == "Alpha" else to_rec709(list(MAGENTA))
    if kind == "ShaderNodeTexImage":
        return _image(node, output.name, bends=way.bends)
    if kind == "ShaderNodeGamma":
        gamma, way = _constant(node.inputs["Gamma"], way), replace(way, bends=True)
        return _apply(_input(node.inputs["Color"], way), lambda a: np.where(a > 0.0, np.maximum(a, 0.0) ** gamma, a))
    if kind == "ShaderNodeInvert":
        factor = _constant(node.inputs[0], way)
        return _apply(_input(node.inputs[1], way), lambda a: a + factor * (1.0 - 2.0 * a))
    if kind == "ShaderNodeRGBToBW":
        return _apply(_input(node.inputs[0], way), lambda a: (a @ LUMINANCE)[..., None] if a.shape[-1] == 3 else a)
    if kind in ("ShaderNodeSeparateColor", "ShaderNodeSeparateRGB"):
        if getattr(node, "mode", "RGB") != "RGB":
            raise UnsupportedNodeError(f"the node '{node.name}' in mode {node.mode}")
        channel = list(node.outputs).index(output)
        return _apply(_input(node.inputs[0], way), lambda a: a[..., min(channel, a.shape[-1] - 1)][..., None])
    if kind == "ShaderNodeMath" and node.operation in MATH:
        return _math(node, way)
    raise UnsupportedNodeError(f"the node '{node.name}' ({node.bl_label})")


def _input(socket: bpy.types.NodeSocket, way: _Way) -> Texture | NDArray[np.float64]:
    source = source_of(socket)
    if source is None:
        return np.atleast_1d(np.asarray(plain_value(socket), dtype=np.float64))
    return _evaluate(source, way)


def _constant(socket: bpy.types.NodeSocket, way: _Way) -> float:
    value = _input(socket, way)
    if isinstance(value, Texture):
        raise UnsupportedNodeError(f"a picture on '{socket.name}' of the node '{socket.node.name}'")
    return float(value[0])


def _apply(value: Texture | NDArray[np.float64], function: Any) -> Texture | NDArray[np.float64]:
    if isinstance(value, Texture):
        return replace(value, pixels=function(value.pixels).astype(np.float32))
    return function(value)


def _math(node: bpy.types.Node, way: _Way) -> Texture | NDArray[np.float64]:
    by_picture = node.operation == "DIVIDE" and node.inputs[1].is_linked
    way = replace(way, bends=way.bends or node.use_clamp or node.operation in BENDING or by_picture)
    first, second = _input(node.inputs[0], way), _input(node.inputs[1], way)
    if isinstance(first, Texture) and isinstance(second, Texture):
        raise UnsupportedNodeError(f"the node '{node.name}' with two pictures")
    picture = first if isinstance(first, Texture) else second if isinstance(second, Texture) else None

    def grey(value: Texture | NDArray[np.float64]) -> NDArray[np.float64]:
        numbers = np.asarray(value.pixels if isinstance(value, Texture) else value, dtype=np.float64)
        return (numbers @ LUMINANCE)[..., None] if numbers.shape[-1] == 3 else numbers

    result = MATH[node.operation](grey(first), grey(second))
    if node.use_clamp:
        result = np.clip(result, 0.0, 1.0)
    return result if picture is None else replace(picture, pixels=result.astype(np.float32))


def _image(node: bpy.types.Node, output: str, *, bends: bool) -> Texture:
    if node.image is None:
        raise UnsupportedNodeError(f"the node '{node.name}' without an image")
    if node.projection != "FLAT":
        raise UnsupportedNodeError(f"the node '{node.name}' with {node.projection.title()} projection")
    if node.extension not in WRAPS:
        raise UnsupportedNodeError(f"the node '{node.name}' with extension Clip")
    wrap = WRAPS[node.extension]
    if wrap == "clamp" and node.interpolation in ("Cubic", "Smart"):  # beyond the edge its curve goes on for two pixels
        raise UnsupportedNodeError(
            f"the node '{node.name}' with extension Extend and {node.interpolation} interpolation"
        )
    try:
        alpha_read = is_alpha_read(node, source_of)
        pixels = filtered_pixels(node.image, node.interpolation, wrap, alpha_read=alpha_read, bends=bends)
    except UnreadableImageError as problem:
        raise UnsupportedNodeError(f"the image '{node.image.name}' that {problem}") from None
    chosen = pixels[:, :, 3:4] if output == "Alpha" else pixels[:, :, :3]
    return Texture(chosen, _uv_matrix(node), wrap, FILTERS[node.interpolation])


def has_texture_mapping(node: bpy.types.Node) -> bool:
    """Whether the mapping inside a texture node changes the coordinate; Blender shows it nowhere, old files have it."""
    mapping = node.texture_mapping
    moved = any(mapping.translation) or any(mapping.rotation) or tuple(mapping.scale) != (1.0, 1.0, 1.0)
    turned = (mapping.mapping_x, mapping.mapping_y, mapping.mapping_z) != ("X", "Y", "Z")
    return moved or turned or mapping.use_min or mapping.use_max


def _uv_matrix(node: bpy.types.Node) -> NDArray[np.float64]:
    """Return the (3, 3) matrix from the mesh's UV to the picture's, for UV links with or without a Mapping node."""
    if has_texture_mapping(node):
        raise UnsupportedNodeError(f"the texture mapping inside the node '{node.name}'")
    source = source_of(node.inputs["Vector"])
    matrix = np.eye(3)
    if source is not None and source.node.bl_idname == "ShaderNodeMapping":
        matrix = _flat(mapping_matrix(source.node), source.node)
        source = source_of(source.node.inputs["Vector"])
        if source is None:
            raise UnsupportedNodeError(f"the Mapping before '{node.name}' without a texture coordinate")
    if source is None:
        return matrix
    if getattr(source.node, "from_instancer", False):
        raise UnsupportedNodeError(f"the coordinate of the instancer of the node '{source.node.name}'")
    if source.node.bl_idname == "ShaderNodeTexCoord" and source.name == "UV":
        return matrix
    if source.node.bl_idname == "ShaderNodeUVMap" and not source.node.uv_map:
        return matrix
    raise UnsupportedNodeError(f"the coordinate '{source.name}' of the node '{source.node.name}'")


def mapping_matrix(node: bpy.types.Node) -> NDArray[np.float64]:
    """Return the (4, 4) matrix a Mapping node applies (svm_mapping in Cycles).

    Raises
    ------
    UnsupportedNodeError
        If one of its inputs is linked to more than a constant, or its type is Normal.
    """
    from mathutils import Euler  # pyright: ignore[reportMissingImports]

    def value(name: str) -> NDArray[np.float64]:
        return np.array(read_socket(node.inputs[name]).value)

    turn, scale = np.array(Euler(value("Rotation")).to_matrix(), dtype=np.float64), value("Scale")
    matrix = np.eye(4)
    if node.vector_type in ("POINT", "VECTOR"):
        matrix[:3, :3] = turn @ np.diag(scale)
        if node.vector_type == "POINT":
            matrix[:3, 3] = value("Location")
    elif node.vector_type == "TEXTURE":
        matrix[:3, :3] = np.diag(np.divide(1.0, scale, out=np.zeros(3), where=scale != 0.0)) @ turn.T
        matrix[:3, 3] = -matrix[:3, :3] @ value("Location")
    else:
        raise UnsupportedNodeError(f"the Mapping node '{node.name}' of type Normal")
    return matrix


def _flat(matrix: NDArray[np.float64], node: bpy.types.Node) -> NDArray[np.float64]:
    if abs(matrix[0, 2]) + abs(matrix[1, 2]) > 1e-6:
        raise UnsupportedNodeError(f"the Mapping node '{node.name}' with a rotation about X or Y")
    return np.array([[*matrix[0, :2], matrix[0, 3]], [*matrix[1, :2], matrix[1, 3]], [0.0, 0.0, 1.0]])
