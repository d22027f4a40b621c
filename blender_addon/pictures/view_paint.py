# SPDX-License-Identifier: GPL-3.0-or-later
"""What is painted over a view so that a picture is compared with it in place. No bpy here.

Blender lays paint p of opacity a over a view in the light of a display of gamma 2.2: (a p + (1 - a) view^2.2)^(1/2.2),
where p is what the paint's sRGB colours decode to. Measured in windows of 4.3 and 5.2, under Standard and AgX, in EEVEE
and Cycles; the curve of sRGB in its place is four levels off where it is dark.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..export.images.color_space import linear_to_srgb

Display = NDArray[np.float32]  # display values and alpha (height, width, 4), bottom row first as Blender keeps them
Paint = NDArray[np.float32]  # the same, of an image with the colour space sRGB

GAMMA = 2.2
# Display value where view and picture are alike. Lower: less is seen of differences where the picture is bright,
# higher: where it is dark. With this one a grey that is off by 0.05 shows as 0.014 to 0.044 off, from 0.15 to 0.95.
NEUTRAL = 0.35


def whole(picture: Display) -> Paint:
    """The picture itself."""
    return _painted(picture[..., :3] ** GAMMA, picture[..., 3:])


def split(paint: Paint, share: float) -> Paint:
    """Paint in the left `share` of its width, and none in the rest, with a white line between them."""
    painted, column = paint.copy(), round(share * paint.shape[1])
    painted[:, column:, 3] = 0.0
    if 0 < column < paint.shape[1]:
        painted[:, column] = 1.0
    return painted


def difference(picture: Display) -> Paint:
    """The least paint that makes a view `NEUTRAL` wherever it equals the picture, lighter where it is brighter.

    With r the picture's light and k that of `NEUTRAL`, paint p of opacity a gives a p + (1 - a) r = k in each channel;
    the least a for which all three p lie between 0 and 1 leaves most of a difference to be seen, 1 - a of its light.
    """
    r, k = picture[..., :3] ** GAMMA, NEUTRAL**GAMMA
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.where(r > k, 1.0 - k / r, (k - r) / (1.0 - r))
    a = np.max(least, axis=-1, keepdims=True)
    p = np.clip((k - (1.0 - a) * r) / np.maximum(a, 1e-6), 0.0, 1.0)
    return _painted(p, a * picture[..., 3:])


def _painted(p: NDArray[np.floating], a: NDArray[np.floating]) -> Paint:
    return np.concatenate([linear_to_srgb(p.astype(np.float32)), a], axis=-1).astype(np.float32)
