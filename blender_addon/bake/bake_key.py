# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake hangs on as one hash, made by the Blender that bakes from the very data that it bakes.

Whatever cannot be told surely has no key, and is baked again: animation, other objects, the view, image sequences.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Set
from functools import cache
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..export.audit.scene_table import BY_SIMPLIFY
from ..export.meshes.read_mesh import material_of_slot, slot_count
from ..export.nodes.dependence import OF_SURROUNDINGS, OF_VIEW, asked_for, turns_with_camera
from ..export.nodes.displacement import moves_faces
from ..probe.graph_copy import nodes_of
from ..versions import node_tree_of
from .stage import PLACE, mesh_of

SHOWN_ONLY = {  # of a node or a socket: how it looks in the editor
    "bl_description", "bl_height_default", "bl_height_max", "bl_height_min", "bl_icon", "bl_label",
    "bl_static_type", "bl_subtype_label", "bl_width_default", "bl_width_max", "bl_width_min", "color", "color_tag",
    "description", "dimensions", "display_shape", "height", "hide", "hide_value", "internal_links", "is_inactive",
    "is_icon_visible", "label", "link_limit", "links", "location", "location_absolute", "name", "node", "parent",
    "pin_gizmo", "rna_type", "select", "show_expanded", "show_options", "show_preview", "show_texture",
    "use_custom_color", "warning_propagation", "width",
}  # fmt: skip
# read files of their own, ask for more of an object than its mesh and place, or are as wide as a pixel of the picture
NO_KEY = (
    *("ShaderNodeScript", "ShaderNodeTexPointDensity", "ShaderNodeWireframe"),
    *("ShaderNodeObjectInfo", "ShaderNodeParticleInfo", "ShaderNodeHairInfo", "ShaderNodePointInfo"),
)
OF_IMAGE = ("alpha_mode", "use_view_as_render", "use_half_precision", "generated_type", "generated_color", "size",
            "generated_width", "generated_height", "use_generated_float", "channels", "is_float")  # fmt: skip
ATTRIBUTE_VALUES = ("value", "vector", "color")  # names of what an attribute's items hold, by type


OF_ANY_DATA = frozenset(prop.identifier for prop in bpy.types.ID.bl_rna.properties)  # its name, its users ...
# of a lamp: as `lamp_table` sets them
BRIGHTNESS = frozenset(("color", "energy", "use_shadow", "use_temperature", "temperature", "temperature_color"))


class _NoKeyError(Exception):
    """Something that a bake may hang on cannot be hashed; nobody is told, as the bake is only made again."""


def world_key(scene: bpy.types.Scene, width: int) -> str | None:
    """The key of a panorama of the world of `scene`, so many pixels around."""
    world = scene.world
    key = _Key("world", scene, width)
    return key.of(lambda: key.owner(world, node_tree_of(world)))


def surface_key(
    scene: bpy.types.Scene, instance: Any, depsgraph: bpy.types.Depsgraph, slot: int, size: int, rays: str
) -> str | None:
    """The key of a bake of the material in `slot` of a depsgraph's instance, `size` texels along each side, for `rays`
    of a kind."""
    shown = material_of_slot(instance.object, slot)
    assert shown is not None
    material, item = shown.original, instance.object
    key = _Key("surface", scene, (size, slot, slot_count(item), rays))

    def put() -> None:
        tree = node_tree_of(material)
        key.owner(material, tree)
        if item.original.vertex_groups and any(node.bl_idname == "ShaderNodeAttribute" for node in nodes_of(tree)):
            raise _NoKeyError
        key.put(material.displacement_method, [list(row) for row in instance.matrix_world])
        for number in range(slot_count(item)):  # what moves its neighbours moves and turns its own edges
            other = material_of_slot(item, number)
            if number != slot and other is not None and moves_faces(other.original):
                key.owner(other.original, node_tree_of(other.original))
                key.put(number, other.original.displacement_method)
        key.put([list(getattr(item, name)) for name in PLACE])
        data = item.original.data
        if hasattr(data, "texspace_location"):
            key.put(list(data.texspace_location), list(data.texspace_size))
        mesh = mesh_of(instance, depsgraph)
        try:
            key.mesh(mesh)
        finally:
            bpy.data.meshes.remove(mesh)

    return key.of(put)


def lamp_key(scene: bpy.types.Scene, instance: Any, asked: Mapping[str, Any]) -> str | None:
    """The key of what the nodes of the lamp of a depsgraph's instance make of its light, by what is `asked` of them.

    How bright it is and of what colour is taken out of that. Where the camera is does not matter: nodes that ask for
    its view have no table.
    """
    data, matrix = instance.object.original.data, instance.matrix_world
    key = _Key("lamp", scene, sorted(asked.items()))

    def put() -> None:
        tree = node_tree_of(data)
        if data.animation_data is not None or asked_for(tree, OF_SURROUNDINGS) or turns_with_camera(tree):
            raise _NoKeyError
        key.put([list(row) for row in (matrix if asked["placed"] else matrix.to_3x3())])
        key.struct(data, without=OF_ANY_DATA | BRIGHTNESS)

    return key.of(put)


class _Key:
    """A hash that is fed."""

    def __init__(self, kind: str, scene: bpy.types.Scene, asked: Any) -> None:
        self._digest, self._trees = hashlib.sha256(), list[int]()
        space = getattr(getattr(bpy.data, "colorspace", None), "working_space", "")
        self.put(kind, asked, bpy.app.version_string, bpy.app.build_hash, _code(), space, os.environ.get("OCIO", ""))
        self.put(scene.cycles.shading_system)
        if scene.render.use_simplify:  # Cycles then reads textures smaller
            self.put([getattr(scene.cycles, name, None) for name in sorted(BY_SIMPLIFY)])

    def of(self, put: Any) -> str | None:
        """The key once `put` has fed it, None where that is not possible."""
        try:
            put()
        except (_NoKeyError, OSError):
            return None
        return self._digest.hexdigest()

    def put(self, *values: Any) -> None:
        for value in values:
            self._digest.update(value if isinstance(value, bytes) else repr(value).encode() + b"\0")

    def owner(self, owner: Any, tree: bpy.types.NodeTree) -> None:
        """A material or a world with its nodes."""
        if owner.animation_data is not None:
            raise _NoKeyError
        if asked_for(tree, OF_VIEW) or asked_for(tree, OF_SURROUNDINGS) or turns_with_camera(tree):
            raise _NoKeyError
        self.struct(owner.cycles)
        self.tree(tree)

    def tree(self, tree: bpy.types.NodeTree) -> None:
        if tree.animation_data is not None:
            raise _NoKeyError
        pointer = tree.as_pointer()
        if pointer in self._trees:
            self.put("tree", self._trees.index(pointer))
            return
        self._trees.append(pointer)
        numbers = {node.name: number for number, node in enumerate(tree.nodes)}
        for node in tree.nodes:
            if node.bl_idname in NO_KEY or getattr(node, "attribute_type", "GEOMETRY") != "GEOMETRY":
                raise _NoKeyError
            self.put("node", node.bl_idname, node.mute)
            if node.bl_idname == "ShaderNodeTexIES" and node.mode == "EXTERNAL":
                self._file(node.filepath, tree.library)
            self.struct(node, numbers)
        for link in tree.links:
            self.put(numbers[link.from_node.name], link.from_socket.identifier)
            self.put(numbers[link.to_node.name], link.to_socket.identifier, link.is_muted, link.is_valid)

    def struct(self, struct: Any, numbers: dict[str, int] | None = None, without: Set[str] = frozenset()) -> None:
        """All properties of a piece of data, but those `without`, and of what belongs to it."""
        is_shown = isinstance(struct, bpy.types.Node | bpy.types.NodeSocket)
        for prop in struct.bl_rna.properties:
            name = prop.identifier
            if name == "rna_type" or name in without or (is_shown and name in SHOWN_ONLY):
                continue
            value = getattr(struct, name)
            self.put(name)
            if prop.type == "COLLECTION":
                self.put(len(value))
                for item in value:
                    self.struct(item, numbers)
            elif prop.type != "POINTER":
                self.put(list(value) if getattr(prop, "is_array", False) else value)
            else:
                self._pointer(value, numbers)

    def _pointer(self, value: Any, numbers: dict[str, int] | None) -> None:
        if isinstance(value, bpy.types.Image):
            self._image(value)
        elif isinstance(value, bpy.types.NodeTree):
            self.tree(value)
        elif isinstance(value, bpy.types.Text):
            self.put("text", value.as_string())
        elif isinstance(value, bpy.types.ID):
            raise _NoKeyError
        elif isinstance(value, bpy.types.Node):
            self.put((numbers or {}).get(value.name))
        elif value is None:
            self.put(None)
        else:
            self.struct(value, numbers)

    def _image(self, image: bpy.types.Image) -> None:
        if image.source not in ("FILE", "GENERATED") or image.type not in ("IMAGE", "UV_TEST"):
            raise _NoKeyError
        self.put("image", image.source, image.colorspace_settings.name, image.colorspace_settings.is_data)
        for name in OF_IMAGE:
            value: Any = getattr(image, name, None)
            self.put(name, value if value is None or isinstance(value, str | float | int) else list(value))
        if image.is_dirty or image.source == "GENERATED":
            pixels = np.empty(len(image.pixels), dtype=np.float32)
            image.pixels.foreach_get(pixels)
            self.put(pixels.tobytes())
        elif image.packed_file is not None:
            self.put(bytes(image.packed_file.data))
        else:
            self._file(image.filepath_raw, image.library)

    def _file(self, given: str, library: bpy.types.Library | None) -> None:
        path = Path(bpy.path.abspath(given, library=library))
        self.put(path.read_bytes() if path.is_file() else "missing")

    def mesh(self, mesh: bpy.types.Mesh) -> None:
        """All attributes of a mesh, UV maps and colours among them, and its normals."""
        for attribute in mesh.attributes:
            items = attribute.data
            self.put(attribute.name, attribute.domain, attribute.data_type, len(items))
            if not len(items):
                continue
            name = next((each for each in ATTRIBUTE_VALUES if hasattr(items[0], each)), None)
            first = getattr(items[0], name) if name is not None else ""
            if name is None or isinstance(first, str | bytes):
                raise _NoKeyError
            width = int(np.size(np.array(first)))
            whole = isinstance(first, int) or attribute.data_type.startswith("INT")
            values = np.empty(len(items) * width, dtype=np.int32 if whole else np.float32)
            items.foreach_get(name, values)
            self.put(values.tobytes())
        for items, name, kind, width in (
            (mesh.polygons, "loop_total", np.int32, 1),
            (mesh.polygons, "material_index", np.int32, 1),
            (mesh.loops, "vertex_index", np.int32, 1),
            (mesh.corner_normals, "vector", np.float32, 3),
        ):
            values = np.empty(len(items) * width, dtype=kind)
            items.foreach_get(name, values)
            self.put(values.tobytes())
        self.put([(layer.name, layer.active_render, layer.active) for layer in mesh.uv_layers])
        self.put(mesh.color_attributes.render_color_index, mesh.attributes.default_color_name)


@cache
def _code() -> str:
    """A hash of this add-on's own code: another version may bake otherwise."""
    found = hashlib.sha256()
    for path in sorted(Path(__file__).resolve().parent.parent.rglob("*.py")):
        if "sentences" not in path.parts:
            found.update(path.read_bytes())
    return found.hexdigest()
