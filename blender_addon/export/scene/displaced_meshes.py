# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that their materials displace: asked for while the scene is read, put into it when Cycles has told."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...bake.baker import BakeError, Baker
from ...bake.requests import name_of
from ..findings import Findings
from ..meshes.mesh_arrays import CornerMesh, Piece, joined
from .scene_data import SceneData, Shape, Terminator

OTHER_FACES = "Its object has other faces in the second Blender."


class DisplacedMeshes:
    """What is asked of `baker`, which other things may be asked of meanwhile."""

    def __init__(self, baker: Baker) -> None:
        self._baker = baker
        self._asked: dict[CornerMesh, tuple[str, int | BakeError]] = {}  # with the object's name
        self._pieces: dict[str, list[Piece]] = {}
        self._moved: dict[CornerMesh, CornerMesh] = {}
        self._rounded: dict[CornerMesh, NDArray[np.bool_]] = {}  # triangles that are flat and have smooth normals

    def ask(self, instance: bpy.types.DepsgraphObjectInstance, mesh: CornerMesh) -> None:
        """Have the mesh of an instance displaced."""
        number: int | BakeError
        try:
            number = self._baker.ask("displaced", instance=name_of(instance))
        except BakeError as problem:
            number = problem
        self._asked[mesh] = instance.object.name, number

    def place(self, shape: str, piece: Piece) -> None:
        """Say that a piece of a mesh is a shape of the scene or a further piece of one."""
        if piece.mesh in self._asked:
            self._pieces.setdefault(shape, []).append(piece)

    def finish(self, data: SceneData, findings: Findings) -> None:
        """Wait, and move the shapes; a mesh that Cycles cannot tell of stays as it is, with a note."""
        for mesh, (owner, number) in self._asked.items():
            try:
                if not isinstance(number, int):
                    raise number
                answer, folder = self._baker.wait(number)
                positions, normals, rounded = (np.load(folder / answer[k]) for k in ("positions", "normals", "rounded"))
                if positions.shape != mesh.positions.shape:
                    raise BakeError(OTHER_FACES)
                self._moved[mesh] = replace(mesh, positions=positions, normals=normals)
                self._rounded[mesh] = rounded
            except BakeError as problem:
                findings.note(f"The displacement of '{owner}' is left out: {problem}")
        for number, shape in enumerate(data.shapes):
            if shape.identifier in self._pieces:
                pieces = [replace(p, mesh=self.of(p.mesh)).placed() for p in self._pieces[shape.identifier]]
                data.shapes[number] = replace(shape, mesh=joined(pieces), terminator=self._terminator(shape))

    def _terminator(self, shape: Shape) -> Terminator:
        """A shape's own; shadow rays start on flat faces, whatever normals they have."""
        pieces = self._pieces[shape.identifier]
        flat = all(piece.mesh in self._rounded and self._rounded[piece.mesh][piece.faces].all() for piece in pieces)
        return replace(shape.terminator, geometry_offset=0.0) if flat else shape.terminator

    def of(self, mesh: CornerMesh) -> CornerMesh:
        """The mesh where its displacement puts it, once all is finished."""
        return self._moved.get(mesh, mesh)
