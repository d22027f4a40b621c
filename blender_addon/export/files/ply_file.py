# SPDX-License-Identifier: GPL-3.0-or-later
"""Triangle meshes as binary PLY, the form Mitsuba's `ply` shape reads."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class TriangleMesh:
    """Positions, unit normals (vertices, 3) and UV (vertices, 2) as float32, triangles (faces, 3) as int32.

    `tangents` (vertices, 3), where there are any, are between vertices as their mean, and not in the surface yet.
    """

    positions: NDArray[np.float32]
    normals: NDArray[np.float32]
    uvs: NDArray[np.float32]
    triangles: NDArray[np.int32]
    tangents: NDArray[np.float32] | None = None


def write_ply(path: Path, mesh: TriangleMesh) -> None:
    """Write `mesh` to `path`, little endian; its tangents are Mitsuba's mesh attribute `vertex_tangent`.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    names = ["x", "y", "z", "nx", "ny", "nz", "u", "v"]
    columns = [mesh.positions, mesh.normals, mesh.uvs]
    if mesh.tangents is not None:
        names += ["tangent_x", "tangent_y", "tangent_z"]
        columns.append(mesh.tangents)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.positions)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    vertices = np.concatenate(columns, axis=1).astype("<f4")
    faces = np.empty(len(mesh.triangles), dtype=[("count", "u1"), ("indices", "<i4", (3,))])
    faces["count"] = 3
    faces["indices"] = mesh.triangles
    with path.open("wb") as file:
        file.write("\n".join(header).encode("ascii"))
        file.write(vertices.tobytes())
        file.write(faces.tobytes())
