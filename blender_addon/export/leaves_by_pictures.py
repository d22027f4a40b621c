# SPDX-License-Identifier: GPL-3.0-or-later
"""Which shader of a mix is fitted, where several materials are fitted to several pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import bpy

from .camera.render_region import pictured_region
from .fitted_slot import FittedSlot
from .materials.node_graph import asks_leaf, largest_leaf, probe_for
from .reference.picture_setup import PictureSetup, named, shown, size_of


def leaves_by_pictures(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    pictures: Sequence[PictureSetup],
    fit: dict[str, Any],
    targets: Sequence[FittedSlot],
) -> list[str | None]:
    """Of each target's mix the shader that covers most in the first picture which shows it, or None.

    Raises
    ------
    ExportError
        If a picture cannot be shown, or Cycles cannot evaluate a mix.
    """
    leaves = [each.leaf for each in targets]
    asked = [number for number, each in enumerate(targets) if asks_leaf(each)]
    for setup in pictures if isinstance(fit.get("parameters", "all"), str) else ():
        if not asked:
            break
        with (
            named(setup, len(pictures)),
            shown(context, setup, obj, own_size=True) as there,
            probe_for(targets, always=True) as probe,
        ):
            assert probe is not None
            here = [number for number in asked if targets[number].object.name in there.view_layer.objects]
            region = pictured_region(there.scene.render, size_of(setup.reference))
            for number in here:
                leaves[number] = largest_leaf(probe, there, targets[number], may_miss=True, region=region)
        asked = [number for number in asked if leaves[number] is None]
    return leaves
