# SPDX-License-Identifier: GPL-3.0-or-later
"""The command `values`: what the target's sockets hold for other values of its nodes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..graph_values.place import Place
from .held_pictures import take_values
from .target import Target
from .variant_pictures import Picture, Variant, VariantPictures, write_surface


def answer(request: Mapping[str, Any]) -> dict[str, Any]:
    """Write one .npy file, float32 (height, width, 1 or 3), for each socket of each variant.

    Requested are `scene`, `layer`, `object` and `slot` as of the command `sockets`, with the `view` of a picture,
    its `camera`, `frame`, `width`, `height`, `region` and `origin`, where it may be another one than the file's,
    the `sockets` by name, each a path of names to it, of which the last is empty for the weight of a shader in a
    mix, the `places` of the values (entries of request.json), `variants`, each with a number or colour for every
    place in `values` and with the names of its `sockets`, the `scale` in subpixels along a pixel, `samples` of each
    subpixel and the `folder` for the files; `elsewhere` where the files of that name are asked for, too, for the
    first variant, and `depths` and `far_side` as there. Answered are `files`, by socket for each variant, `elsewhere`,
    by socket as of the command `sockets`, and of the target the file `positions`, NaN beside it, and the `camera` of
    that command.

    Raises
    ------
    ProbeRequestError
        If the camera does not see the target, a value's node is gone, or Blender cannot render.
    """
    target = Target.of(request)
    places = [Place.of_request(entry) for entry in request["places"]]
    renders = VariantPictures(target, request["sockets"], request["samples"], places)
    variants = [Variant(variant["sockets"], variant["values"]) for variant in request["variants"]]
    folder = Path(request["folder"])
    files: list[dict[str, str]] = [{} for _ in variants]
    elsewhere: dict[str, str] = {}

    def take(k: int, name: str, values: Picture) -> None:
        files[k][name] = f"value_{k:02d}_{len(files[k]):02d}.npy"
        np.save(folder / files[k][name], values)

    def take_elsewhere(name: str, values: Picture) -> None:
        elsewhere[name] = f"elsewhere_{len(elsewhere):02d}.npy"
        np.save(folder / elsewhere[name], values)

    depths = range(int(request.get("depths", 1)))
    key = json.dumps({name: value for name, value in request.items() if name not in ("variants", "folder")})
    far_side = bool(request.get("far_side"))
    surface = take_values(renders, variants, request["scale"], take, key=key, depths=depths, far_side=far_side)
    if request.get("elsewhere"):
        renders.take_elsewhere(variants[0], take_elsewhere, depths)
    return {"files": files, "elsewhere": elsewhere, **write_surface(target, surface, folder)}
