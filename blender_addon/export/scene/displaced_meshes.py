# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes that their materials displace: asked for while the scene is read, put into it when Cycles has told."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np

from ...bake.baker import BakeError, Baker
from ...bake.requests import name_of
from ..findings import Findings
from ..meshes.mesh_arrays import CornerMesh, Piece, joined
from .scene_data import SceneData

OTHER_FACES = "Its object has other faces in the second Blender."


class DisplacedMeshes:
    """What is asked of `baker`, which other things may be asked of meanwhile."""

    def __init__(self, baker: Baker) -> None:
        self._baker = baker
        self._asked: dict[CornerMesh, tuple[str, int | BakeError]] = {}  # with the object's name
        self._pieces: dict[str, list[Piece]] = {}
        self._moved: dict[CornerMesh, CornerMesh] = {}

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
                positions, normals = (np.load(folder / answer[key]) for key in ("positions", "normals"))
                if positions.shape != mesh.positions.shape:
                    raise BakeError(OTHER_FACES)
                self._moved[mesh] = replace(mesh, positions=positions, normals=normals)
            except BakeError as problem:
                findings.note(f"The displacement of '{owner}' is left out: {problem}")
        for number, shape in enumerate(data.shapes):
            if shape.identifier in self._pieces:
                pieces = [replace(p, mesh=self.of(p.mesh)).placed() for p in self._pieces[shape.identifier]]
                data.shapes[number] = replace(shape, mesh=joined(pieces))

    def of(self, mesh: CornerMesh) -> CornerMesh:
        """The mesh where its displacement puts it, once all is finished."""
        return self._moved.get(mesh, mesh)
