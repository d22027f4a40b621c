# SPDX-License-Identifier: GPL-3.0-or-later
"""What a material's Displacement does in Cycles: it bends the normals that shaders see, moves the faces, or both."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import bpy

from ...versions import active_output, node_tree_of
from .shader_graph import source_of


def displacement_of(material: bpy.types.Material | None) -> bpy.types.NodeSocket | None:
    """The input that what displaces a material is linked to, None where nothing is."""
    return displacement_in(node_tree_of(material))


def displacement_in(tree: bpy.types.NodeTree | None) -> bpy.types.NodeSocket | None:
    """The same of a material's nodes."""
    output = active_output(tree)
    socket = None if output is None else output.inputs["Displacement"]
    return None if socket is None or source_of(socket) is None else socket


def bends_normals(material: bpy.types.Material | None) -> bool:
    """Whether a material has a displacement that Cycles takes, with all of it or the rest, for a bump."""
    return _method(material) in ("BUMP", "BOTH")


def moves_faces(material: bpy.types.Material | None) -> bool:
    """Whether a material has a displacement that moves the vertices of a mesh."""
    return _method(material) in ("DISPLACEMENT", "BOTH")


def _method(material: bpy.types.Material | None) -> str:
    return "" if material is None or displacement_of(material) is None else material.displacement_method


@contextmanager
def unbent(material: bpy.types.Material) -> Iterator[None]:
    """A material of one's own with what its displacement moves, and without what it bends."""
    socket, method, tree = displacement_of(material), material.displacement_method, material.node_tree
    if socket is None or tree is None:
        yield
        return
    source = socket.links[0].from_socket
    if method == "BUMP":
        tree.links.remove(socket.links[0])
    else:
        material.displacement_method = "DISPLACEMENT"
    try:
        yield
    finally:
        material.displacement_method = method
        if not socket.is_linked:
            tree.links.new(source, socket)
