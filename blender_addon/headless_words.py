# SPDX-License-Identifier: GPL-3.0-or-later
"""What the options of `headless.py` name in the open file: slots, materials, pictures."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any


class HeadlessError(Exception):
    """The command cannot be done; the message is one sentence for the user."""


def fitted_slots(bpy: Any, chosen: argparse.Namespace) -> list[Any]:
    """The slots whose materials are fitted: that of --object, or those of each --target."""
    from .export.fitted_slot import FittedSlot

    if chosen.object is not None:
        obj = _object(bpy, chosen, chosen.object)
        return [FittedSlot.active(obj)]
    found = []
    for text in chosen.target:
        try:
            given = json.loads(text)
            name, slot, material = given["object"], given.get("slot"), given.get("material")
        except (ValueError, TypeError, KeyError, AttributeError) as error:
            raise HeadlessError(f"--target is no JSON object with object, slot or material ({error}).") from error
        obj = _object(bpy, chosen, name)
        names = [each.material.name if each.material is not None else "none" for each in obj.material_slots]
        if material is not None and material not in names:
            raise HeadlessError(f"Object {name!r} has no material {material!r}: it has {', '.join(names) or 'none'}.")
        if slot is not None and not 1 <= slot <= len(names):
            raise HeadlessError(f"Object {name!r} has no slot {slot}: it has {len(names)}.")
        active = obj.active_material_index if slot is None else slot - 1
        found.append(FittedSlot(obj, active if material is None else names.index(material)))
    return found


def _object(bpy: Any, chosen: argparse.Namespace, name: str) -> Any:
    from .export.render_state import shown_object

    obj = shown_object(name, bpy.context.scene, bpy.context.view_layer)
    if obj is None:
        names = ", ".join(o.name for o in bpy.context.scene.objects if o.type == "MESH") or "none"
        elsewhere = [scene.name for scene in bpy.data.scenes if name in scene.objects]
        where = f"it is in the scene {elsewhere[0]!r}, which is not the active one" if elsewhere else ""
        raise HeadlessError(
            f"{chosen.file} has no object {name!r} in its scene {bpy.context.scene.name!r}: "
            f"{where or f'its mesh objects are: {names}'}."
        )
    return obj


def pictures(chosen: argparse.Namespace) -> Any:
    """The reference, or the pictures of --picture."""
    from .export.reference.picture_setup import PictureSetup

    if chosen.reference is not None:
        return chosen.reference.absolute()
    try:
        given = [json.loads(text) for text in chosen.picture]
        parts = [_part(one["reference"], one.pop("part", {})) for one in given]
        return [PictureSetup(**one | {"reference": part}) for one, part in zip(given, parts, strict=True)]
    except (ValueError, TypeError, KeyError) as error:
        raise HeadlessError(f"--picture is no JSON object with the fields of a PictureSetup ({error}).") from error


def _part(reference: str | Path, part: dict[str, Any]) -> Any:
    """A picture, of which a part counts where one is given."""
    from .export.reference.counted_part import WHOLE, CountedPart

    path = Path(reference).absolute()
    if not part:
        return path
    mask = Path(part["mask"]).absolute() if part.get("mask") else None
    return CountedPart(path, tuple(part.get("crop", WHOLE)), mask, part.get("alpha", False))
