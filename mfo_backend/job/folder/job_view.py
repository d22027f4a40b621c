# SPDX-License-Identifier: Apache-2.0
"""The view a job's pictures are seen through."""

from __future__ import annotations

from ...metrics.display.baked_view import BakedView
from ...metrics.display.tone_mapping import DisplayView, View
from ...scene.image_file import read_image
from ...types.errors import BadInputError
from ...types.image import Encoding, Image
from .job_folder import JobFolder
from .request import Request
from .view_request import ViewTable


def view_of(folder: JobFolder, request: Request, reference: Image) -> View:
    """The request's table or view, else Standard as it is, for a linear reference with an exposure that suits it.

    Raises
    ------
    BadInputError
        If the table cannot be read or is not what the request says.
    """
    if request.view_table is not None:
        return _baked(folder, request.view_table)
    if request.view is not None:
        return request.view
    return DisplayView() if reference.encoding is Encoding.SRGB else DisplayView.for_scene(reference.pixels)


def _baked(folder: JobFolder, table: ViewTable) -> BakedView:
    pixels = read_image(folder.file(table.path, what="request.json: view.lut.path")).pixels
    size = table.size
    if pixels.shape != (size, size * size, 3):
        raise BadInputError(
            f"The view's table {table.path} is {pixels.shape[1]}x{pixels.shape[0]}, but request.json says {size} "
            f"nodes, which is {size * size}x{size}: export the job again."
        )
    return BakedView(pixels.reshape(size, size, size, 3), table.log2_min, table.log2_max)
