# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said of faces once all meshes are placed. Knows nothing of bpy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..camera.camera_model import Camera
from ..files.ply_file import TriangleMesh
from ..findings import Findings
from ..steps import Pause, Steps
from .coincident import COPLANAR, most_parallel, normals_around
from .known_meshes import KnownMeshes

MANY = 100_000  # triangles that windows are drawn before: what is computed with them takes a tenth of a second
APART = Pause(holds_scene=True, is_apart=True)


def note_coincident_faces(
    places: Sequence[tuple[str, TriangleMesh]], known: KnownMeshes, findings: Findings
) -> Steps[None]:
    """Report objects whose faces lie in the same place."""
    if sum(len(mesh.triangles) for _, mesh in places) >= MANY:
        yield APART
    for first, second in known.shared_faces(places):
        if first == second:
            findings.note(_twice(first))
            continue
        findings.note(_same_place(first, second))


def note_coplanar_faces(
    seen: Mapping[str, NDArray[np.float64]],
    places: Sequence[tuple[str, TriangleMesh]],
    camera: Camera,
    findings: Findings,
) -> Steps[None]:
    """Report faces in the plane of faces of an object that the camera sees, of which `seen` has points (n, 3)."""
    if sum(len(mesh.triangles) for _, mesh in places) >= MANY:
        yield APART
    bounds = [(mesh.positions.min(axis=0), mesh.positions.max(axis=0)) for _, mesh in places if len(mesh.positions)]
    filled = [place for place in places if len(place[1].positions)]
    for own, points in seen.items():
        if not len(points):
            continue
        reach = COPLANAR * (camera.project(points)[1] + np.abs(points).max(axis=1))
        low, high = points.min(axis=0) - reach.max(), points.max(axis=0) + reach.max()
        near = [place for place, (least, most) in zip(filled, bounds, strict=True) if _meet(low, high, least, most)]
        around = [(name, normals_around(points, reach, mesh)) for name, mesh in near]
        there = [(name, normals) for name, normals in around if any(map(len, normals))]
        planes = [np.concatenate([*each]) for each in zip(*(n for name, n in there if name == own), strict=True)]
        if not planes and any(name == own for name, _ in near):
            continue  # no point lies in a face of its own object, so none lies in one of another's beside it
        found = [name for name, normals in there if most_parallel(planes or normals, normals) > (name == own)]
        for other in dict.fromkeys(found):
            if other == own:
                findings.note(_twice(own))
            elif not {_same_place(own, other), _same_place(other, own)} & set(findings.notes):
                findings.note(_same_place(own, other))


def _meet(*ends: NDArray[np.floating]) -> bool:
    """Whether two boxes, each with its lowest and highest corner, have a place in common."""
    low, high, least, most = ends
    return bool((least <= high).all() and (most >= low).all())


def _twice(name: str) -> str:
    return (
        f"'{name}' has faces twice in the same place, which shadow each other in Cycles and not in the fit: merge them "
        "(Merge by Distance), or look for a modifier that copies them."
    )


def _same_place(first: str, second: str) -> str:
    return (
        f"'{first}' and '{second}' have faces in the same place: which of them is seen is left to chance, in "
        "Cycles and in the fit, and in Cycles they shadow each other."
    )
