# SPDX-License-Identifier: Apache-2.0
"""Finer pictures of what a graph gives the target, for the textures of a scene.

One takes as long to render as several of those that a solve looks at. So where values have hardly changed since one was
rendered, it is changed as those are.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...types.parameter import Vector

Picture = NDArray[np.float32]  # (height, width, 1 or 3)
Flat = Mapping[str, NDArray[np.float32]]  # by parameter, (subpixels + 1, 1 or 3), whose last row is the mean

# Finer pictures that are kept, and as many rendered ones that others are told from; fits of three materials render at
# most two (docs/notebook/graph_values.md). Fewer: the ends of a fit are rendered again. More: memory
KEPT_FINER = 6
# A rendered picture is changed where what the camera sees changes by no more than this, root mean square, and no value
# by more than this part of its range: the far side, and what other rays find, stay as they are. They are seen in
# mirrors and by light that bounces alone, and may show what the camera does not. Larger: bounced light of another
# material. Smaller: a rendering more for each end. With it three materials end within 0.0002 of the FLIP that they had
# with every picture rendered (docs/notebook/graph_values.md)
LITTLE = 0.02


@dataclass(frozen=True, eq=False)
class Shown:
    """What a texture shows: the picture that the camera sees, that for other rays where it hangs on the ray, and the
    mean of a parameter, for points that the camera does not see."""

    picture: Picture
    elsewhere: Picture | None = None
    outside: NDArray[np.float32] | None = None

    def changed(self, by: NDArray[np.float32], rows: int) -> Shown | None:
        """The same with what a flat picture of so many rows, as fine or coarser, changes by; None where it is finer."""
        change, outside = by[:-1].reshape(rows, -1, by.shape[1]), self.outside
        times, rest = divmod(self.picture.shape[1], change.shape[1])
        if rest:
            return None
        picture = self.picture.copy()  # below the rows that change is the far side
        picture[: rows * times] += change.repeat(times, axis=0).repeat(times, axis=1)
        return Shown(picture, self.elsewhere, None if outside is None else outside + by[-1])


@dataclass
class _Rendered:
    """A vector, its finer pictures, and the flat ones of a solve where these were asked for."""

    vector: Vector
    shown: Mapping[str, Shown]
    flat: Flat | None = None


class FinerPictures:
    """The finer pictures of a graph's values, by parameter.

    Parameters
    ----------
    render
        The pictures at a vector, rendered.
    flat
        Those that a solve looks at.
    seen
        Which of their subpixels see the target, True (height, width), known when `flat` was asked.
    width
        Of the ranges of the values.
    """

    def __init__(
        self,
        render: Callable[[Vector], Mapping[str, Shown]],
        flat: Callable[[Vector], Flat],
        seen: Callable[[], NDArray[np.bool_]],
        width: Vector,
    ) -> None:
        self._render, self._flat, self._seen, self._width = render, flat, seen, width
        self._known: OrderedDict[bytes, Mapping[str, Shown]] = OrderedDict()
        self._rendered: list[_Rendered] = []  # the newest last

    def at(self, vector: Vector) -> Mapping[str, Shown]:
        """The pictures at a vector: rendered ones that change as the flat ones do where that is little, else new."""
        key = vector.tobytes()
        if key not in self._known:
            found = self._changed(vector)
            if found is None:
                found = self._render(vector)
                self._take(vector, found)
            self._keep(key, found)
        self._known.move_to_end(key)
        return self._known[key]

    def note(self, vector: Vector, shown: Mapping[str, Shown]) -> None:
        """Take over pictures that were rendered already."""
        self._take(vector, shown)
        self._keep(vector.tobytes(), shown)

    def _take(self, vector: Vector, shown: Mapping[str, Shown]) -> None:
        self._rendered = [*self._rendered[1 - KEPT_FINER :], _Rendered(vector.copy(), shown)]

    def _keep(self, key: bytes, shown: Mapping[str, Shown]) -> None:
        self._known[key] = shown
        if len(self._known) > KEPT_FINER:
            self._known.popitem(last=False)

    def _changed(self, vector: Vector) -> Mapping[str, Shown] | None:
        """Those of the nearest rendered vector, changed; None where that is too far."""
        nearest, change = None, LITTLE
        for each in self._rendered:
            if np.max(np.abs(vector - each.vector) / self._width) > LITTLE:
                continue
            here, each.flat = self._flat(vector), each.flat or self._flat(each.vector)
            apart = max(_apart(here[name], each.flat[name], self._seen()) for name in here)
            if apart <= change:
                nearest, change = (each.shown, here, each.flat), apart
        if nearest is None:
            return None
        shown, here, there = nearest
        rows = len(self._seen())
        found = {name: known.changed(here[name] - there[name], rows) for name, known in shown.items()}
        return {name: each for name, each in found.items() if each is not None} if all(found.values()) else None


def _apart(a: NDArray[np.float32], b: NDArray[np.float32], seen: NDArray[np.bool_]) -> float:
    """The root mean square difference of two flat pictures where the target is seen."""
    return float(np.sqrt(np.mean(np.square(a[:-1] - b[:-1])[seen.ravel()])))
