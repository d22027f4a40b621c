# SPDX-License-Identifier: Apache-2.0
"""The files of a node graph's values: plain arrays of one size inside the job folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from ...types.errors import BadInputError
from .graph_request import FINEST, LARGEST_SIDE, NodeGraph
from .job_folder import JobFolder

MOST_SUBPIXELS = FINEST * LARGEST_SIDE  # along a side
_VALUES = np.dtype("<f4")


def check_graph_files(
    folder: JobFolder, graph: NodeGraph | None, sockets: Sequence[tuple[str, str, str | None]]
) -> None:
    """Check the files of positions and of values: a socket, what the camera sees of it, and what other rays find.

    Raises
    ------
    BadInputError
        If one is missing, outside the folder, no array of float32 (height, width, 1 or 3), cut off, or of another size
        than the positions; or there are values without positions.
    """
    if graph is None:
        if sockets:
            name = sockets[0][0]
            raise BadInputError(f"request.json: socket {name!r} has a graph, but there is no entry 'graph': add it.")
        return
    positions, depths = graph.positions, graph.depths
    size = _size(folder.file(positions, what="request.json: graph.positions"))
    if size[2] != 3:
        raise BadInputError(f"{positions} has {size[2]} numbers for a position: it must have 3.")
    if size[0] % depths:
        raise BadInputError(f"{positions} has {size[0]} rows, which are no {depths} pictures of one height.")
    for name, file, elsewhere in sockets:
        found = _size(folder.file(file, what=f"request.json: graph of {name}"))
        if found[:2] != size[:2]:
            raise BadInputError(f"{file} is {found[1]} x {found[0]}, but {positions} {size[1]} x {size[0]}.")
        if elsewhere is not None:
            coarse = _size(folder.file(elsewhere, what=f"request.json: elsewhere of {name}"))
            scale = max(size[1] // coarse[1], 1)
            if coarse[1] * scale != size[1] or (coarse[0] * scale) % size[0] or coarse[2] != found[2]:
                raise BadInputError(f"{elsewhere} is {coarse[1]} x {coarse[0]}, which no pixels of {positions} are.")


def locate_files(folder: JobFolder, graph: NodeGraph | None, name: str, socket: dict[str, Any]) -> None:
    """Give the files of a socket, as in request.json, by their absolute paths, and those of the `graph` with them."""
    if socket.get("texture"):
        socket["texture"] = str(folder.file(socket["texture"], what=f"request.json: texture of {name}"))
    if socket.get("graph") and graph is not None:
        socket["graph"] = str(folder.file(socket["graph"], what=f"request.json: graph of {name}"))
        if socket.get("elsewhere"):
            file = folder.file(socket["elsewhere"], what=f"request.json: elsewhere of {name}")
            socket["elsewhere"] = str(file)
        socket["positions"] = str(folder.file(graph.positions, what="request.json: graph.positions"))
        socket["camera"], socket["depths"] = graph.camera, graph.depths


def _size(path: Path) -> tuple[int, int, int]:
    """Height, width and numbers of each place; nothing of the content is read."""
    try:
        with path.open("rb") as file:
            read = npy.read_array_header_1_0 if npy.read_magic(file) == (1, 0) else npy.read_array_header_2_0
            shape, by_columns, kind = read(file)
            left = path.stat().st_size - file.tell()
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path.name} is no array that NumPy reads ({error}): export the job anew.") from None
    fits = len(shape) == 3 and shape[2] in (1, 3) and all(0 < side <= MOST_SUBPIXELS for side in shape[:2])
    if not fits or by_columns or kind != _VALUES or left != int(np.prod(shape)) * _VALUES.itemsize:
        raise BadInputError(f"{path.name} does not hold float32 (height, width, 1 or 3): export the job anew.")
    return shape
