# SPDX-License-Identifier: GPL-3.0-or-later
"""The slot of an object whose nodes are looked at, and what is put into a copy of its material to look at them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ..export.camera.camera_model import Region
from ..export.images.color_space import to_rec709
from ..export.material_model import SHADING_NORMAL
from ..export.nodes.closure_leaves import OUTPUT
from ..export.nodes.dependence import OF_FACING, asked_for
from ..export.nodes.displacement import bends_normals, moves_faces
from ..export.nodes.leaf_kinds import TRANSPARENT
from ..export.nodes.shader_graph import source_of
from ..export.render_state import render_state, shown_object
from ..versions import active_output
from .aov_render import Bounds, Frame, bounds_of, frame_of, render_outputs, whole_frame
from .closure_tree import ClosureTree, Leaf, within_bounds
from .graph_copy import node_at, nodes_of, own_copy, remove_copy
from .server import ProbeRequestError

MASK, POSITION = "mfo mask", "mfo position"
BUMP = "ShaderNodeBump"
TANGENT, ALPHA = "Tangent", "Alpha"
DIRECTIONS = (SHADING_NORMAL, "Normal", "Coat Normal", TANGENT)
NOT_SEEN = "The camera does not see '{obj}': move it into the frame."
# Cycles says so on its stderr alone, and shows nothing
TOO_MANY = "The nodes of '{material}' are too many for Cycles to evaluate at once: leave nodes out."
SEEN = 0.05  # share of a subpixel's samples on the target from which on it has a value


class NotSeenError(ProbeRequestError):
    """The camera does not see the target."""


@dataclass(frozen=True)
class Target:
    """The slot of an object whose material is looked at."""

    scene: bpy.types.Scene
    layer: bpy.types.ViewLayer
    obj: bpy.types.Object
    slot: bpy.types.MaterialSlot
    region: Region | None = None
    origin: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))  # that positions are told from

    @staticmethod
    def of(request: Mapping[str, Any]) -> Target:
        """That of a request's `scene`, `layer`, `object` and `slot`, which are the window's from now on.

        So are the camera, frame and size of its `view`, where it has one. It or the view may have the `region` of the
        frame that the picture shows alone.
        """
        scene = bpy.data.scenes[request["scene"]]
        layer = scene.view_layers[request["layer"]]
        if bpy.context.window is not None:
            bpy.context.window.scene, bpy.context.window.view_layer = scene, layer
        if request.get("view"):
            _show(scene, request["view"])
        if (obj := shown_object(request["object"], scene, layer)) is None:
            raise KeyError(request["object"])
        shown = request.get("view") or request
        region = Region(*shown["region"]) if shown.get("region") else None
        origin = np.array(shown.get("origin") or (0.0, 0.0, 0.0))
        return Target(scene, layer, obj, obj.material_slots[request["slot"]], region, origin)

    @property
    def material(self) -> bpy.types.Material:
        """The material that is looked at."""
        return self.slot.material

    def frame(self, scale: int, outputs: int) -> Frame:
        """See `frame_of`; raises `NotSeenError` where there is none."""
        seen = self._seen if moves_faces(self.material) else None
        with render_state(self.layer, self.scene):  # modifiers and particles may be others in the viewport
            frame = frame_of(self.scene, self.obj, self.material, scale, outputs, self.region, seen)
        if frame is None:
            raise NotSeenError(NOT_SEEN.format(obj=self.obj.name))
        return frame

    @cached_property
    def _seen(self) -> Bounds | None:
        """What Cycles shows of the material, which its displacement may have moved beyond all bounds."""
        frame = whole_frame(self.scene, self.region)
        return bounds_of(self._mask(frame, 1)[..., 0] > SEEN, frame)

    def _mask(self, frame: Frame, samples: int) -> NDArray[np.float32]:
        """Where Cycles shows the material, whatever its nodes are."""
        copy = own_copy(self.material)
        try:
            make_opaque(copy)
            return self.outputs(copy, [(MASK, False), (POSITION, True)], frame, samples)[MASK]
        finally:
            remove_copy(copy)

    def why_nothing(self, frame: Frame, samples: int) -> ProbeRequestError:
        """Why Cycles has shown nothing of it: nothing is seen without its nodes either, or they are too many."""
        if (self._mask(frame, samples) > SEEN).any():
            return ProbeRequestError(TOO_MANY.format(material=self.material.name))
        return NotSeenError(NOT_SEEN.format(obj=self.obj.name))

    def outputs(
        self,
        copy: bpy.types.Material,
        wanted: list[tuple[str, bool]],
        frame: Frame,
        samples: int,
        *,
        by_pixels: bool = False,
    ) -> dict[str, NDArray[np.float32]]:
        """What Cycles writes into the outputs of `copy`, which stands in for the material meanwhile."""
        try:
            with self._standing_in(copy):
                return render_outputs(self.scene, self.layer, wanted, frame, samples, by_pixels=by_pixels).values
        except RuntimeError as error:
            raise ProbeRequestError(f"Cycles cannot evaluate the nodes of '{self.material.name}': {error}") from error

    @contextmanager
    def _standing_in(self, copy: bpy.types.Material) -> Iterator[None]:
        """Show `copy` for the material: in the object's slot, and wherever else it is, as on meshes of nodes.

        What another file holds keeps the material, but for the slot.
        """
        material, was_link = self.slot.material, self.slot.link
        try:
            self.slot.link = "OBJECT"
            self.slot.material = copy
            material.user_remap(copy)
            yield
        finally:
            copy.user_remap(material)
            self.slot.material = material
            self.slot.link = was_link


def from_origin(camera: NDArray[np.float64], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """A (3, 4) camera matrix for places that count from an origin."""
    return np.concatenate([camera[:, :3], camera[:, 3:] + camera[:, :3] @ origin[:, None]], axis=1)


def _show(scene: bpy.types.Scene, view: Mapping[str, Any]) -> None:
    """Let the scene show what a picture does: `camera`, `frame`, and `width` and `height` in pixels."""
    if scene.frame_current_final != view["frame"]:
        whole = math.floor(view["frame"])
        scene.frame_set(whole, subframe=view["frame"] - whole)
    camera, render = scene.objects.get(view["camera"]), scene.render
    if camera is None:
        raise ProbeRequestError(f"The copy of the file has no camera '{view['camera']}' any more.")
    scene.camera = camera
    render.resolution_percentage, render.resolution_x, render.resolution_y = 100, view["width"], view["height"]


def make_opaque(copy: bpy.types.Material, *, ours: bool = False) -> None:
    """Give a copied material a surface of its own, with outputs for mask and position.

    The user's outputs go, unless those that are there are `ours` already.
    """
    tree = copy.node_tree
    if not ours:
        remove_outputs(tree)
    one = tree.nodes.new("ShaderNodeValue")
    one.outputs[0].default_value = 1.0
    _output(tree, MASK, one.outputs[0], False)
    _output(tree, POSITION, tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], True)
    # opaque, and no shader that Cycles would fold away: outputs of a surface that is not there add up along the ray
    grey = tree.nodes.new("ShaderNodeBsdfDiffuse")
    output = active_output(tree)
    assert output is not None  # the shader is linked to it
    tree.links.new(grey.outputs[0], output.inputs["Surface"])
    for link in list(output.inputs["Volume"].links):
        tree.links.remove(link)


def remove_outputs(tree: bpy.types.NodeTree) -> None:
    """Remove the user's own outputs, perhaps of the same names, from a copied tree and its groups."""
    for node in list(nodes_of(tree)):
        if node.bl_idname == "ShaderNodeOutputAOV":
            node.id_data.nodes.remove(node)


def write_weight(tree: bpy.types.NodeTree, closures: ClosureTree, path: list[str], output: str) -> str:
    """Put an output node of the given name on the weight of a shader, the sum over all ways to it; returns its type."""
    ways = [each.weight for each in closures.leaves if _path(each) == path]
    total = tree.nodes.new("ShaderNodeValue").outputs[0]
    total.default_value = sum(way for way in ways if isinstance(way, float))
    for way in ways:
        if not isinstance(way, float):
            node = tree.nodes.new("ShaderNodeMath")  # an Add: not clamped
            tree.links.new(total, node.inputs[0])
            tree.links.new(way, node.inputs[1])
            total = node.outputs[0]
    _output(tree, output, total, False)
    return "VALUE"


def _path(leaf: Leaf) -> list[str]:
    return [node.name for node in (*leaf.path, leaf.node)]


def write_outputs(tree: bpy.types.NodeTree, path: list[str], outputs: Mapping[str, str]) -> dict[str, str]:
    """Put an output node of the given name on each of a shader's sockets; returns the sockets' types."""
    inner, shader = node_at(tree, path)
    kinds = {}
    for name, output in outputs.items():
        if name == SHADING_NORMAL:
            kinds[name] = "VECTOR"
            _output(inner, output, inner.nodes.new("ShaderNodeNewGeometry").outputs["Normal"], True)
            continue
        if name.startswith(OUTPUT):
            kinds[name] = "RGBA"
            given = next(s for s in shader.outputs if s.identifier == name.removeprefix(OUTPUT))
            _output(inner, output, given, True)
            continue
        socket = shader.inputs[name]
        source = source_of(socket)
        if source is None and name == TANGENT:  # Cycles' own: about the object's Z axis, as a new Tangent node has it
            source = inner.nodes.new("ShaderNodeTangent").outputs[0]
        if source is None:
            raise ProbeRequestError(f"{name} of '{shader.name}' has no link any more.")
        kinds[name] = "VALUE" if socket.type not in ("RGBA", "VECTOR") else socket.type
        _output(inner, output, within_bounds(inner, shader, socket, source), kinds[name] != "VALUE")
    return kinds


def hole_weight(closures: ClosureTree, path: list[str]) -> bpy.types.NodeSocket | None:
    """The weight of a shader that is mixed with nothing but Transparent; None where no nodes give it, or of another.

    It is an output of the top tree.
    """
    own = [leaf.weight for leaf in closures.leaves if _path(leaf) == path]
    others = [leaf.node.bl_idname for leaf in closures.leaves if _path(leaf) != path]
    if len(own) != 1 or isinstance(own[0], float) or any(kind != TRANSPARENT for kind in others):
        return None
    return own[0]


def weigh_outputs(
    tree: bpy.types.NodeTree,
    path: Sequence[str],
    names: Sequence[str],
    output: str,
    weight: bpy.types.NodeSocket | None,
) -> bool:
    """Multiply these outputs by the Alpha of their shader and its `weight`; False where neither has a link.

    They are in the shader's tree, as the weight is. One of the name `output` is put on what they are multiplied with.
    """
    inner, shader = node_at(tree, path)
    socket = shader.inputs.get(ALPHA)
    source = None if socket is None else source_of(socket)
    alpha = weight if source is None else within_bounds(inner, shader, socket, source)
    if alpha is None:
        return False
    if source is not None and weight is not None:
        both = inner.nodes.new("ShaderNodeMath")
        both.operation = "MULTIPLY"
        inner.links.new(alpha, both.inputs[0])
        inner.links.new(weight, both.inputs[1])
        alpha = both.outputs[0]
    for node in [node for node in inner.nodes if node.bl_idname == "ShaderNodeOutputAOV" and node.aov_name in names]:
        link = next(each for each in inner.links if each.to_node == node)
        is_color, value, end = link.to_socket.name == "Color", link.from_socket, link.to_socket
        scaled = inner.nodes.new("ShaderNodeVectorMath" if is_color else "ShaderNodeMath")
        scaled.operation = "SCALE" if is_color else "MULTIPLY"
        inner.links.new(value, scaled.inputs[0])
        inner.links.new(alpha, scaled.inputs["Scale"] if is_color else scaled.inputs[1])
        inner.links.new(scaled.outputs[0], end)
    _output(inner, output, alpha, False)
    return True


def _output(tree: bpy.types.NodeTree, name: str, source: bpy.types.NodeSocket, is_color: bool) -> None:
    node = tree.nodes.new("ShaderNodeOutputAOV")
    node.aov_name = name
    tree.links.new(source, node.inputs["Color" if is_color else "Value"])


def looks_by_pixels(material: bpy.types.Material, *, turned: bool) -> bool:
    """Whether a bump takes its differences over a width in pixels that nothing sets: one whose Filter Width has a link,
    any before Blender 4.4, and that of a displacement where directions are asked for (`turned`) or nodes ask for the
    normal."""
    tree = material.node_tree
    widths = [node.inputs.get("Filter Width") for node in nodes_of(tree) if node.bl_idname == BUMP]
    if any(width is None or width.is_linked for width in widths):
        return True
    return bends_normals(material) and (turned or bool(asked_for(tree, OF_FACING)))


def widen_bumps(tree: bpy.types.NodeTree, scale: int) -> None:
    """Let Bump nodes take their differences over the width of a pixel, which is `scale` subpixels."""
    for node in nodes_of(tree):
        if node.bl_idname == BUMP:
            node.inputs["Filter Width"].default_value *= scale


def cleaned(values: NDArray[np.float32], seen: NDArray[np.bool_], name: str, kind: str) -> NDArray[np.float32]:
    """Finite values; colours of the working space as linear Rec.709, directions at unit length."""
    finite = np.where(seen[..., None] & np.isfinite(values), values, 0.0).astype(np.float64)
    if kind == "RGBA":
        finite = to_rec709(finite)
    if name in DIRECTIONS:
        length = np.linalg.norm(finite, axis=-1, keepdims=True)
        finite = np.divide(finite, length, out=np.zeros_like(finite), where=length > 0.1)
    return np.ascontiguousarray(finite, dtype=np.float32)
