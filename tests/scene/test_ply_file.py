# SPDX-License-Identifier: Apache-2.0
"""Meshes of a stranger: Mitsuba's reader would trust the counts and the indices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from blender_addon.export.files.ply_file import TriangleMesh
from blender_addon.export.files.ply_file import write_ply as write_addon_ply
from mfo_backend.bench.scenes.bumpy_sphere import bumpy_sphere, write_ply
from mfo_backend.scene.ply_file import check_ply
from mfo_backend.types.errors import BadInputError

HEAD = """ply
format {order} 1.0
comment made by a test
element vertex {vertices}
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
end_header
"""


def ply(order: str = "binary_little_endian", *, vertices=3, faces=1, points=None, index=(0, 1, 2), corners=3) -> bytes:
    head = HEAD.format(order=order, vertices=vertices, faces=faces).encode()
    points = np.eye(3) if points is None else np.asarray(points)
    if order == "ascii":
        rows = [*(" ".join(map(str, p)) for p in points), " ".join(map(str, (corners, *index)))]
        return head + "\n".join(rows).encode() + b"\n"
    mark = "<" if "little" in order else ">"
    return head + points.astype(f"{mark}f4").tobytes() + bytes([corners]) + np.asarray(index, f"{mark}i4").tobytes()


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_mesh_is_fine(tmp_path: Path, order: str) -> None:
    (tmp_path / "a.ply").write_bytes(ply(order))
    check_ply(tmp_path / "a.ply")


def test_meshes_of_our_own_writers_are_fine(tmp_path: Path) -> None:
    vertices, triangles = bumpy_sphere(1)
    write_ply(tmp_path / "bench.ply", vertices, triangles)
    check_ply(tmp_path / "bench.ply")
    mesh = TriangleMesh(vertices, vertices, np.zeros((len(vertices), 2), np.float32), triangles)
    write_addon_ply(tmp_path / "addon.ply", mesh)
    check_ply(tmp_path / "addon.ply")


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"index": (0, 1, 3)}, "beyond its 3"),
        ({"index": (0, 1, 2**30)}, "beyond its 3"),
        ({"index": (0, -1, 2)}, "beyond its 3"),
        ({"corners": 4}, "three corners"),
        ({"points": [[0, 0, np.nan], [1, 0, 0], [0, 1, 0]]}, "NaN or infinite"),
        ({"points": [[0, 0, np.inf], [1, 0, 0], [0, 1, 0]]}, "NaN or infinite"),
        ({"vertices": 200_000_000}, "declares"),
        ({"faces": 2**31}, "declares"),
        ({"faces": 0}, "declares"),
        ({"faces": -1}, "declares"),
    ],
)
def test_refused_with_one_sentence(tmp_path: Path, order: str, wrong: dict, words: str) -> None:
    (tmp_path / "a.ply").write_bytes(ply(order, **wrong))
    with pytest.raises(BadInputError, match=words) as refusal:
        check_ply(tmp_path / "a.ply")
    assert "export it again as a PLY file of triangles" in str(refusal.value)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"ply",
        b"ply\nend_header",
        b"ply\nend_header\n",
        ply().replace(b"format", b"former"),
        ply().replace(b"binary_little_endian", b"binary"),
        ply().replace(b"property float y\n", b""),
        ply().replace(b"property float y", b"property list uchar int y"),
        ply().replace(b"property float y", b"property float x"),
        ply().replace(b"int vertex", b"float vertex"),
        ply().replace(b"element face", b"element edge"),
        ply().replace(b"vertex 3", b"vertex three"),
        ply()[:-1],
        ply("ascii").replace(b"0 1 2", b"0 1 b"),
        ply("ascii").replace(b"0 1 2", b"0 0.5 2"),
        ply("ascii")[:-4],
    ],
)
def test_damaged_files(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.ply").write_bytes(content)
    with pytest.raises(BadInputError):
        check_ply(tmp_path / "a.ply")


def test_further_elements_and_properties_are_fine(tmp_path: Path) -> None:
    head = HEAD.format(order="ascii", vertices=3, faces=1).replace(
        "uchar int vertex_indices", "uchar uint vertex_index"
    )
    head = head.replace("end_header", "property uchar red\nelement edge 1\nproperty int a\nend_header")
    (tmp_path / "a.ply").write_text(head + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255\n7\n")
    check_ply(tmp_path / "a.ply")
