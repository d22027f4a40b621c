# SPDX-License-Identifier: Apache-2.0
"""What an export wrote of a baked shape, read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from mfo_backend.scene.image_file import read_image


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Position and UV of the vertices."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    mesh = mi.traverse(mi.load_dict({"type": "ply", "filename": str(path)}))
    return np.array(mesh["vertex_positions"]).reshape(-1, 3), np.array(mesh["vertex_texcoords"]).reshape(-1, 2)


def at_vertices(picture: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """The texel that each vertex lies in; uv counts rows from the top."""
    height, width = picture.shape[:2]
    column, row = (np.clip((uv * (width, height)).astype(int), 0, (width - 1, height - 1))).T
    return picture[row, column]


def shape_of(report: Any) -> tuple[str, np.ndarray, np.ndarray]:
    """The BSDF of the one shape that is baked, its vertices and their UV."""
    scene = ElementTree.parse(report.folder / "scene.xml").getroot()
    shape = next(shape for shape in scene.iterfind("shape") if attribute(shape, "ref", "id").startswith("baked"))
    return attribute(shape, "ref", "id"), *read_ply(report.folder / attribute(shape, "string", "value"))


def attribute(element: ElementTree.Element, path: str, name: str) -> str:
    """What an element below this one gives under a name."""
    found = element.find(path)
    assert found is not None
    return found.attrib[name]


def texture(report: Any, bsdf: str, socket: str) -> np.ndarray:
    path = report.request["materials"][bsdf]["sockets"][socket]["texture"]
    return np.asarray(read_image(report.folder / path).pixels)
