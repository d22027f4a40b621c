# SPDX-License-Identifier: Apache-2.0
"""A picture in the folder of a job: at full size as a PNG, and small beside it for a panel."""

from __future__ import annotations

from typing import NamedTuple

from ...report.picture import png_bytes, thumbnail_bytes
from ...types.image import Pixels
from ..folder.atomic_file import write_atomically
from ..folder.job_folder import JobFolder


class PictureFiles(NamedTuple):
    """The contents of both files."""

    png: bytes
    thumbnail: bytes


def picture_files(display: Pixels) -> PictureFiles:
    """Both files of display values (height, width, 3) in [0, 1]."""
    return PictureFiles(png_bytes(display), thumbnail_bytes(display))


def write_picture(folder: JobFolder, name: str, files: PictureFiles) -> None:
    """Write both by rename, the folders where there are none.

    Raises
    ------
    OSError
        If the folder cannot be written or the disk is full.
    """
    folder.thumbnails.mkdir(parents=True, exist_ok=True)
    write_atomically(folder.pictures / f"{name}.png", files.png)
    write_atomically(folder.thumbnails / f"{name}.ppm", files.thumbnail)
