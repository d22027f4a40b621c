# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that an export has had before, of another picture or for another material. Knows nothing of bpy.

What is the same is not computed again: of a million triangles that takes seconds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..files.ply_file import TriangleMesh
from .coincident import shared_faces
from .mesh_arrays import CornerMesh, Piece, same_mesh

Places = Sequence[tuple[str, TriangleMesh]]  # names of objects and what is there
_Placed = dict[tuple[CornerMesh, bytes], list[tuple[NDArray[np.bool_], TriangleMesh]]]  # by mesh and matrix


class KnownMeshes:
    """What the last two readings of a scene had; `begin` starts the next one."""

    def __init__(self) -> None:
        self._meshes: dict[str, CornerMesh] = {}
        self._last_meshes: dict[str, CornerMesh] = {}
        self._placed: _Placed = {}
        self._last_placed: _Placed = {}
        self._places: Places = ()
        self._pairs: list[tuple[str, str]] = []

    def begin(self) -> None:
        """Forget what was not there in the last reading."""
        self._last_meshes, self._meshes = self._meshes, {}
        self._last_placed, self._placed = self._placed, {}

    def mesh(self, name: str, read: CornerMesh) -> CornerMesh:
        """The mesh that was read, or its equal of the last reading under that name."""
        known = self._last_meshes.get(name)
        self._meshes[name] = known if known is not None and same_mesh(known, read) else read
        return self._meshes[name]

    def place(self, piece: Piece) -> TriangleMesh:
        """The triangles of a piece in the world."""
        key = piece.mesh, piece.matrix.tobytes()
        same = (mesh for faces, mesh in self._last_placed.get(key, ()) if np.array_equal(faces, piece.faces))
        found = next(same, None) or piece.placed()
        self._placed.setdefault(key, []).append((piece.faces, found))
        return found

    def shared_faces(self, places: Places) -> list[tuple[str, str]]:
        """The function of that name, which is asked again only where something is not as it was."""
        is_same = len(places) == len(self._places) and all(
            name == other and mesh is known for (name, mesh), (other, known) in zip(places, self._places, strict=True)
        )
        if not is_same:
            self._places, self._pairs = tuple(places), shared_faces(places)
        return self._pairs
