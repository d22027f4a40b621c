# SPDX-License-Identifier: Apache-2.0
"""PLY meshes checked before Mitsuba reads them: its reader trusts the counts and the indices that a file declares.

An index beyond the vertices ends the process inside the ray tracer (Mitsuba 3.9.1), and a count of 2**31 asks for all
memory. Layout: "The PLY Polygon File Format", G. Turk, 1994.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..types.errors import BadInputError

MOST_ELEMENTS = 2**28  # vertices or faces; more than any ray tracer here has memory for
_HEADER_LIMIT = 2**16  # bytes
_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}


@dataclass
class _Element:
    name: str
    count: int
    scalars: list[tuple[str, str]]  # name, numpy type without byte order; a list stands here as its three corners
    list_name: str = ""
    list_types: tuple[str, str] = ("", "")  # of the count, of the items

    def dtype(self, order: str) -> np.dtype:
        """One of these in a binary file, lists taken as triangles."""
        fields: list[tuple[Any, ...]] = []
        for name, kind in self.scalars:
            if name == self.list_name and not kind:
                fields += [("#count", order + self.list_types[0]), ("#index", order + self.list_types[1], 3)]
            else:
                fields.append((name, order + kind))
        return np.dtype(fields)

    def columns(self) -> list[str]:
        """One of these in a text file, number by number, lists taken as triangles."""
        names: list[str] = []
        for name, kind in self.scalars:
            names += [name] if kind else ["#count", "#0", "#1", "#2"]
        return names


def check_ply(path: Path) -> None:
    """Check that a triangle mesh holds what its header declares: sizes, finite positions, indices of its own vertices.

    Raises
    ------
    BadInputError
        If not, or if the file is no PLY, or has faces of other than three corners.
    """
    try:
        with path.open("rb") as file:
            head = file.read(_HEADER_LIMIT)
            order, elements, start = _header(head, path.name)
            file.seek(start)
            size = path.stat().st_size - start
            if order:
                _check_binary(file, order, elements, size, path.name)
            else:
                _check_text(file, elements, size, path.name)
    except OSError as error:
        raise BadInputError(f"Mesh {path.name!r} cannot be read ({error.strerror}): check the file.") from None


def _wrong(name: str, what: str) -> BadInputError:
    return BadInputError(f"Mesh {name!r} {what}: export it again as a PLY file of triangles.")


def _header(head: bytes, name: str) -> tuple[str, list[_Element], int]:
    end = head.find(b"end_header")
    line_end = head.find(b"\n", end)
    if not head.startswith(b"ply") or end < 0 or line_end < 0:
        raise _wrong(name, "is no PLY file")
    order: str | None = None
    elements: list[_Element] = []
    for line in head[:end].decode("latin-1").splitlines()[1:]:
        words = line.split()
        try:
            if not words or words[0] in ("comment", "obj_info"):
                continue
            if words[0] == "format":
                order = _ORDERS[words[1]]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), []))
            elif words[0] == "property" and words[1] == "list" and not elements[-1].list_name:
                elements[-1].list_name, elements[-1].list_types = words[4], (_TYPES[words[2]], _TYPES[words[3]])
                elements[-1].scalars.append((words[4], ""))
            elif words[0] == "property":
                elements[-1].scalars.append((words[2], _TYPES[words[1]]))
            else:
                raise ValueError
        except (IndexError, KeyError, ValueError):
            raise _wrong(name, f"has the header line {line[:60]!r}, which is not PLY") from None
    if order is None or [element.name for element in elements[:2]] != ["vertex", "face"]:
        raise _wrong(name, "does not hold vertices and then faces")
    vertices, faces, *others = elements
    for element in elements:
        names = [entry for entry, _ in element.scalars]
        if not 1 <= element.count <= MOST_ELEMENTS or not names or len(set(names)) != len(names):
            raise _wrong(name, f"declares {element.count} times {element.name!r} of {', '.join(names) or 'nothing'}")
    if not {"x", "y", "z"} <= {entry for entry, _ in vertices.scalars} or vertices.list_name:
        raise _wrong(name, "has vertices without x, y and z, or with a list")
    if faces.list_name not in ("vertex_indices", "vertex_index") or "f" in "".join(faces.list_types):
        raise _wrong(name, "has faces without a list of whole numbers called vertex_indices")
    if any(element.list_name for element in others):
        raise _wrong(name, "has more lists than those of its faces")
    return order, elements, line_end + 1


def _check_binary(file: BinaryIO, order: str, elements: list[_Element], size: int, name: str) -> None:
    declared = sum(element.count * element.dtype(order).itemsize for element in elements)
    if size < declared:
        raise _wrong(name, f"has {size} bytes of data and declares {declared} for triangles")
    vertices, faces = (np.fromfile(file, element.dtype(order), element.count) for element in elements[:2])
    _check_positions(np.stack([vertices[axis] for axis in "xyz"], axis=1), name)
    _check_faces(faces["#count"], faces["#index"], len(vertices), name)


def _check_text(file: BinaryIO, elements: list[_Element], size: int, name: str) -> None:
    numbers = [element.count * len(element.columns()) for element in elements]
    if size < 2 * sum(numbers) - 1:  # a digit and a space each
        raise _wrong(name, f"has {size} bytes of data and declares {sum(numbers)} numbers for triangles")
    try:
        values = np.array(file.read().split(), dtype=np.float64)
    except (ValueError, UnicodeDecodeError):
        raise _wrong(name, "has words where numbers belong") from None
    if len(values) < sum(numbers):
        raise _wrong(name, f"holds {len(values)} numbers and declares {sum(numbers)} for triangles")
    tables = []
    for element, before in zip(elements[:2], (0, numbers[0]), strict=True):
        rows = values[before : before + element.count * len(element.columns())].reshape(element.count, -1)
        tables.append((rows, element.columns()))
    (vertices, columns), (faces, corners) = tables
    _check_positions(vertices[:, [columns.index(axis) for axis in "xyz"]], name)
    first = corners.index("#count")
    indices = faces[:, first + 1 : first + 4]
    if (indices != np.floor(indices)).any():
        raise _wrong(name, "counts its vertices in fractions")
    _check_faces(faces[:, first], indices, len(vertices), name)


def _check_faces(counts: NDArray, indices: NDArray, vertices: int, name: str) -> None:
    if (counts != 3).any():
        raise _wrong(name, "has faces of other than three corners")
    if not (indices.min() >= 0 and indices.max() < vertices):
        raise _wrong(name, f"has faces that name vertices beyond its {vertices}")


def _check_positions(positions: NDArray, name: str) -> None:
    # float32 is what Mitsuba keeps
    with np.errstate(over="ignore"):
        if not np.isfinite(positions.astype(np.float32, copy=False)).all():
            raise _wrong(name, "has vertices at NaN or infinite positions")
