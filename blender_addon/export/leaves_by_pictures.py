# SPDX-License-Identifier: GPL-3.0-or-later
"""Which shader of a mix is fitted, where several materials are fitted to several pictures."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import bpy

from .camera.render_region import pictured_region
from .fitted_slot import FittedSlot
from .materials.node_graph import asks_leaf, largest_leaf, probe_for
from .reference.picture_setup import PictureSetup, named, shown, size_of
from .steps import Steps, held

LOOKING = "Cycles looks at picture {}"


def leaves_by_pictures(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    pictures: Sequence[PictureSetup],
    fit: dict[str, Any],
    targets: Sequence[FittedSlot],
) -> Steps[list[str | None]]:
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
        show = partial(shown, context, setup, obj, own_size=True)
        with named(setup, len(pictures)):
            found = yield from held(_leaves(context, setup, asked, targets), show, LOOKING.format(setup.number), 0.0)
        for number, leaf in found.items():
            leaves[number] = leaf
        asked = [number for number in asked if leaves[number] is None]
    return leaves


def _leaves(
    context: bpy.types.Context, setup: PictureSetup, asked: Sequence[int], targets: Sequence[FittedSlot]
) -> Steps[dict[int, str | None]]:
    """Of the targets with these numbers that the picture may show the shader that covers most."""
    found = {}
    with probe_for(targets, always=True) as probe:
        assert probe is not None
        here = [number for number in asked if targets[number].object.name in context.view_layer.objects]
        region = pictured_region(context.scene.render, size_of(setup.reference))
        for number in here:
            found[number] = yield from largest_leaf(probe, context, targets[number], may_miss=True, region=region)
    return found
