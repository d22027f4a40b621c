# SPDX-License-Identifier: Apache-2.0
"""`picture`, `cameras` and `lights` of request.json: what of a .blend a picture shows, and what a further one could."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...fit.candidates import MOST_CAMERAS, MOST_LIGHTS, Candidates, OtherCamera, SceneLight
from ...types.errors import BadInputError
from .checked_object import CheckedObject, is_number, shown


@dataclass(frozen=True)
class Picture:
    """Where a picture of several comes from: its number, counted from 1, its file, and what of the .blend it shows."""

    number: int = 1
    name: str = ""
    frame: int | None = None
    camera: str = ""
    scene: str = ""
    view_layer: str = ""


def picture_from_json(data: Any, where: str) -> Picture:
    """The object `picture`; one of a single picture without it."""
    if data is None:
        return Picture()
    picture = CheckedObject(data, f"{where}: picture", ("number", "name", "frame", "camera", "scene", "view_layer"))
    return Picture(
        number=picture.integer("number", 1, 10_000, 1),
        name=picture.text("name", ""),
        frame=picture.integer("frame", -(2**20), 2**20) if picture.raw("frame", None) is not None else None,
        camera=picture.text("camera", ""),
        scene=picture.text("scene", ""),
        view_layer=picture.text("view_layer", ""),
    )


def candidates_from_json(cameras: Any, lights: Any, where: str) -> Candidates:
    """The lists `cameras` and `lights`."""
    return Candidates(
        tuple(
            _camera(each, f"{where}: cameras[{n}]")
            for n, each in enumerate(_listed(cameras, "cameras", MOST_CAMERAS, where))
        ),
        tuple(
            _light(each, f"{where}: lights[{n}]")
            for n, each in enumerate(_listed(lights, "lights", MOST_LIGHTS, where))
        ),
    )


def candidates_to_json(candidates: Candidates) -> dict[str, Any]:
    """Those of the lists that hold something."""
    return {name: [asdict(each) for each in found] for name, found in vars(candidates).items() if found}


def _listed(data: Any, key: str, most: int, where: str) -> Sequence[Any]:
    if not isinstance(data, (list, tuple)) or len(data) > most:
        raise BadInputError(f"{where}: {key} is {shown(data)}: it must be a list of at most {most}.")
    return data


def _camera(data: Any, where: str) -> OtherCamera:
    camera = CheckedObject(data, where, ("name", "to_world", "fov"))
    matrix = camera.raw("to_world")
    if not isinstance(matrix, (list, tuple)) or len(matrix) != 16 or not all(map(is_number, matrix)):
        raise camera.wrong("to_world", "16 finite numbers")
    turn = np.array(matrix, np.float64).reshape(4, 4)[:3, :3]
    if not np.allclose(turn.T @ turn, np.eye(3), atol=1e-3):
        raise camera.wrong("to_world", "a place and a turn, without a scale")
    return OtherCamera(camera.text("name"), tuple(map(float, matrix)), camera.number("fov", 0.01, 179.0))


def _light(data: Any, where: str) -> SceneLight:
    light = CheckedObject(data, where, ("name", "emitter"))
    return SceneLight(light.text("name"), light.text("emitter"))
