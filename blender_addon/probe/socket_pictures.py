# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `sockets`: what a material's linked sockets hold at every subpixel of the target that the camera sees.

Cycles evaluates the nodes itself: a copy of the material writes each socket's value into an output (AOV).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .target import SEEN, NotSeenError, Target
from .variant_pictures import Picture, Variant, VariantPictures, write_surface


def answer(request: Mapping[str, Any]) -> dict[str, Any]:
    """Write one .npy file, float32 (height, width, 1 or 3), for each socket, and the positions, NaN beside the target.

    Requested are `scene`, `layer`, `object`, `slot`, for each of the `leaves` of its shaders the `node` (a path of
    names), its `sockets` and whether its `weight` is asked for, the `scale` in subpixels along a pixel, `samples`
    of each subpixel, the `folder` for the files, and how many `depths`: the first is what the camera sees, the
    second what it would see were that away, and so on; files have one below the other, and `far_side` asks for a
    second one, coarser where pictures are large; how many `depths` there are is answered, too. `region` is the left,
    top, right and bottom of what the picture shows alone, in pixels of the frame, None for all; places count from
    `origin`, zero if it is absent. Answered are for each of the `leaves` the `sockets` by name and the `weight`,
    each a `file` and its `mean` over what the camera sees; the file `positions`, and `camera`, the (3, 4) matrix
    from the world to columns and rows of the files. Colours are linear Rec.709, directions unit vectors of the
    world or zero.

    Where `elsewhere` is requested and nodes ask for the ray, sockets and weights have a file of that name, too: one
    below the other what rays from elsewhere find at the angles of `other_views.cosines_of`, a place a pixel.

    Where `may_miss` is requested and the camera does not see the target, `seen` is answered alone, as false.

    Raises
    ------
    ProbeRequestError
        If the camera does not see the target and may not miss it, its nodes are too many, or Blender cannot render.
    """
    try:
        return _answer(request)
    except NotSeenError:
        if request.get("may_miss"):
            return {"seen": False}
        raise


def _answer(request: Mapping[str, Any]) -> dict[str, Any]:
    target, folder = Target.of(request), Path(request["folder"])
    depths = range(int(request.get("depths", 1)))
    asked = {
        f"{number} {socket}": (number, socket)
        for number, leaf in enumerate(request["leaves"])
        for socket in [*leaf["sockets"], *([""] if leaf["weight"] else [])]
    }
    paths = {name: [*request["leaves"][number]["node"], socket] for name, (number, socket) in asked.items()}
    renders, variant = VariantPictures(target, paths, request["samples"]), Variant(tuple(paths))
    found: dict[str, Picture] = {}
    elsewhere: dict[str, Picture] = {}
    surface = renders.take(
        [variant],
        request["scale"],
        lambda _, name, values: found.__setitem__(name, values),
        depths=depths,
        far_side=bool(request.get("far_side")),
    )
    if request.get("elsewhere"):
        renders.take_elsewhere(variant, elsewhere.__setitem__, depths)
    seen = surface.mask[..., 0] > SEEN
    height = surface.frame.bottom - surface.frame.top
    first = seen & (np.arange(len(seen)) < height)[:, None]
    first = first if first.any() else seen  # all of it may be behind a pane
    leaves: list[dict[str, Any]] = [{"sockets": {}} for _ in request["leaves"]]
    for k, (name, values) in enumerate(found.items()):
        said: dict[str, Any] = {"file": f"socket_{k:02d}.npy"}
        said["mean"] = values[first].mean(axis=0, dtype=np.float64).tolist()
        np.save(folder / said["file"], values)
        if name in elsewhere:
            said["elsewhere"] = f"elsewhere_{k:02d}.npy"
            np.save(folder / said["elsewhere"], elsewhere[name])
        number, socket = asked[name]
        if socket:
            leaves[number]["sockets"][socket] = said
        else:
            leaves[number]["weight"] = said
    return {"leaves": leaves, **write_surface(target, surface, folder), "depths": len(seen) // height}
