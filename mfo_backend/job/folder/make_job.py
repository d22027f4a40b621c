# SPDX-License-Identifier: Apache-2.0
"""A job folder made from a plain Mitsuba scene and a reference picture."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

from ... import __version__
from ...fit.settings import FitSettings
from ...metrics.display.tone_mapping import DisplayView
from ...scene.image_file import check_reference, read_image
from ...scene.scene_xml import find_target, read_scene
from ...types.errors import BadInputError
from .job_folder import JobFolder, unwritable
from .picture_part import PicturePart, with_part
from .request import Request, Target, request_to_json
from .scene_files import film_size, pack_scene


def make_job(
    scene: Path,
    shape_id: str,
    reference: Path,
    settings: FitSettings,
    folder: Path,
    *,
    view: DisplayView | None = None,
    part: PicturePart | None = None,
) -> Request:
    """Write a job into `folder`, which must be new or empty; on an error it is as it was before.

    The mask of the `part` of the reference that counts is a file of the user's, which is copied.

    Raises
    ------
    BadInputError
        If scene, target or reference cannot be used, or the folder holds something or cannot be written.
    """
    image = read_image(reference)
    root = read_scene(scene)
    target = find_target(root, shape_id)
    width, height = film_size(root)
    check_reference(image, width, height)
    settings.stage_names(image.encoding)
    part = part or PicturePart()
    copied = replace(part, mask=f"mask{Path(part.mask).suffix.lower()}") if part.mask else part
    with_part(image, replace(part, mask=""), JobFolder(folder))
    if part.mask:
        read_image(part.mask)
    request = Request(
        scene="scene.xml",
        target=Target(shape_id=shape_id, bsdf_id=target.bsdf_id),
        width=width,
        height=height,
        reference=f"reference{reference.suffix.lower()}",
        encoding=image.encoding,
        part=copied,
        view=view,
        fit=settings,
        generator={"name": "mfo fit", "version": __version__},
    )
    is_new = _is_new(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        pack_scene(scene, folder)
        shutil.copyfile(reference, folder / request.reference)
        if part.mask:
            shutil.copyfile(part.mask, folder / copied.mask)
        (folder / "request.json").write_text(json.dumps(request_to_json(request), indent=1), "utf-8")
    except OSError as error:
        _clear(folder, is_new)
        raise unwritable(folder, error) from error
    except BadInputError:
        _clear(folder, is_new)
        raise
    return request


def _is_new(folder: Path) -> bool:
    """Whether the folder is still to be made; refused if something is there that is not an empty folder."""
    try:
        if not folder.exists():
            return True
        if any(folder.iterdir()):
            raise BadInputError(f"The folder {folder} is not empty: choose another for the job, or remove it.")
    except OSError as error:  # a file, or a folder that cannot be read
        raise unwritable(folder, error) from error
    return False


def _clear(folder: Path, is_new: bool) -> None:
    """Undo a job in a folder that was new or empty before."""
    if is_new:
        shutil.rmtree(folder, ignore_errors=True)
        return
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
