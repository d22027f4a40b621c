# SPDX-License-Identifier: Apache-2.0
"""The files a scene names: none outside of a job folder, or all copied into one."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

from ...scene.exr_file import check_exr
from ...scene.ply_file import check_ply
from ...scene.scene_xml import Element, is_file, read_scene, to_text
from ...types.errors import BadInputError
from .job_folder import JobFolder

_MESHES = (".ply", ".obj", ".serialized")
_CHECKED = {".ply": check_ply, ".exr": check_exr}  # all that the add-on's export writes


def check_scene_files(folder: JobFolder, scene: str, *, trusted: bool = False) -> None:
    """Check that a job's scene names existing files of the job folder only, and that they hold what they say.

    Files of kinds that are not checked here, which Mitsuba's own readers take as they are, are for `trusted` jobs only.

    Raises
    ------
    BadInputError
        If the scene cannot be read, names a file that is missing, outside, of another kind or damaged.
    """
    path = folder.root / scene
    for element, key in _named_files(read_scene(path), scene):
        # the reader has made names of existing files absolute, links resolved
        file = _resolved(path.parent / element.get(key, ""))
        if not file.is_relative_to(folder.root):
            raise BadInputError(
                f"{scene} names the file {element.get(key)!r} outside the job folder: put it inside and name it "
                "relative to the scene."
            )
        if not is_file(file):
            raise BadInputError(f"{scene} names the file {element.get(key)!r}, which is not there: put it there.")
        check = _CHECKED.get(file.suffix.lower())
        if check is not None:
            check(file)
        elif not trusted:
            raise BadInputError(
                f"{scene} names {element.get(key)!r}, which Mitsuba would read unchecked: make it "
                f"{' or '.join(kind[1:].upper() for kind in _CHECKED)}, or run the job with --trust if it is your own."
            )


def pack_scene(source: Path, destination: Path) -> Element:
    """Copy a Mitsuba scene to `destination`/scene.xml, and the files it names into folders beside it.

    Raises
    ------
    BadInputError
        If the scene cannot be read, or names a file that is missing.
    OSError
        If the destination cannot be written.
    """
    scene = read_scene(source)
    copied: dict[Path, str] = {}
    for element, key in _named_files(scene, source.name):
        file = _resolved(source.parent / element.get(key, ""))
        if not is_file(file):
            raise BadInputError(f"{source.name} names the file {element.get(key)!r}, which is not there: put it there.")
        if file not in copied:
            folder = "meshes" if file.suffix.lower() in _MESHES else "textures"
            copied[file] = f"{folder}/{len(copied) + 1:03d}_{file.name}"  # equal names may come from several folders
            (destination / folder).mkdir(exist_ok=True)
            shutil.copyfile(file, destination / copied[file])
        element.set(key, copied[file])
    (destination / "scene.xml").write_text(to_text(scene), "utf-8")
    return scene


def film_size(scene: Element) -> tuple[int, int]:
    """Width and height in pixels that a scene renders; its film's crop window if it has one.

    Raises
    ------
    BadInputError
        If the scene has no sensor, or a size is not a whole number.
    """
    sensor = scene.find("sensor")
    if sensor is None:
        raise BadInputError("The scene has no camera: add a sensor.")
    sizes = {"width": 768, "height": 576}  # Mitsuba's defaults (src/render/film.cpp, 3.9.1)
    for element in sensor.findall("film/integer"):
        try:
            sizes[element.get("name", "")] = int(element.get("value", ""))
        except ValueError:
            raise BadInputError(f"Film {element.get('name')} is {element.get('value')!r}: give pixels.") from None
    return sizes.get("crop_width", sizes["width"]), sizes.get("crop_height", sizes["height"])


def _named_files(scene: Element, name: str) -> Iterator[tuple[Element, str]]:
    """Elements that name a file, with the attribute that does."""
    for element in scene.iter():
        if element.tag in ("include", "path"):
            raise BadInputError(
                f"{name} has <{element.tag}>, which is not followed: put everything into one scene file with paths "
                "relative to it."
            )
        if element.tag == "string" and element.get("name") == "filename":
            yield element, "value"
        elif element.tag == "spectrum" and element.get("filename"):
            yield element, "filename"


def _resolved(path: Path) -> Path:
    """The path with links followed, or as it is where they form a circle."""
    try:
        return path.resolve()
    except (OSError, RuntimeError, ValueError):  # a circle is a RuntimeError until Python 3.12
        return path
