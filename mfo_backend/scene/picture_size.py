# SPDX-License-Identifier: Apache-2.0
"""How large a picture may say it is, asked before memory is taken for its pixels."""

from __future__ import annotations

from ..types.errors import BadInputError

MAX_PIXELS = 2**28  # a header may declare any size; this one (16384 x 16384) takes 3 GiB of float32
Size = tuple[int, int]  # width, height


def check_declared_size(name: str, declared: Size, needed: Size | None = None) -> None:
    """Refuse a picture whose header declares an empty or too large size, or another one than is `needed`.

    Raises
    ------
    BadInputError
        If so.
    """
    width, height = declared
    if width < 1 or height < 1 or width * height > MAX_PIXELS:
        raise BadInputError(
            f"Image {name!r} declares a size of {width}x{height}: between 1 and {MAX_PIXELS} pixels are read."
        )
    if needed is not None and declared != needed:
        raise BadInputError(
            f"Reference is {width}x{height} but the scene renders {needed[0]}x{needed[1]}: "
            "render the reference at that size or change the resolution of the scene."
        )
