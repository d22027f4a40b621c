# SPDX-License-Identifier: GPL-3.0-or-later
"""Export: an object, its active material slot and the scene camera become a job folder for the backend."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from .files.job_folder import MORE_PICTURES, new_job_folder, share_files
from .findings import ExportError, Findings
from .fitted_slot import FittedSlot, check_slots
from .leaves_by_pictures import leaves_by_pictures
from .materials.wanted_values import fits_of_each, wanted_values
from .partial_export import MITSUBA, Found, PartialExport, Steps, partial_export
from .reference.picture_setup import PictureSetup, check_setups, named, shown
from .reference.reference import Picture
from .reference.reference_view import SCENE
from .scene.read_scene import finish_scene, read_scene
from .scene.scene_file import scene_files

NOWHERE = "Material '{material}' of '{obj}' is in none of the pictures: leave it out, or add a picture that shows it."
MOVING_VALUES = (
    "Picture {label}: the material has other values at its frame; the fit looks for one set for all pictures."
)
_LOOK_SECONDS = 0.01  # between two looks at a second Blender that is waited for

__all__ = ["ExportError", "ExportReport", "check_export", "export_findings", "export_job", "export_steps"]


@dataclass(frozen=True)
class ExportReport:
    """What was written: the folder, the content of request.json, a sentence for each thing left out or approximated."""

    folder: Path
    request: dict[str, Any]
    notes: tuple[str, ...]


def export_job(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    folder: Path,
    *,
    reference: Picture | Sequence[PictureSetup] | None,
    fit: dict[str, Any],
    reference_view: str = SCENE,
    upright: bool = False,
    targets: Sequence[FittedSlot] = (),
    tell: Callable[[float], None] = lambda _share: None,
) -> ExportReport:
    """Write the job folder for fitting the active material slot of `obj`; nothing in the .blend changes.

    With `targets` the materials of those slots are fitted together instead. `reference` is one picture of the scene as
    it is, or pictures with what each of them shows. `reference_view` says how a display picture was made: "scene",
    rendered in this scene, or "standard", a photograph or a render under Standard. `upright` turns a picture as its
    EXIF data say. `tell` gets the share that is done, of work that a million triangles make some seconds long.

    Raises
    ------
    ExportError
        If the scene, the reference or the folder cannot be used. Then `folder` is as it was.
    """
    if not isinstance(reference, Sequence):
        return drained(export_steps(context, obj, folder, reference, fit, reference_view, upright, tell, targets))
    check_setups(reference)
    if len(reference) > 1:  # what is named wrongly is so in all of them
        check_slots(targets)
        _check_names(obj, fit, targets)
    first: PartialExport | None = None
    notes: list[str] = []
    unseen = set(range(len(targets)))
    leaves = leaves_by_pictures(context, obj, reference, fit, targets) if len(reference) > 1 and targets else None
    with new_job_folder(Path(folder)) as partial:
        paths = ["", *(f"{MORE_PICTURES}/{setup.number}" for setup in reference[1:])]
        for done, (setup, path) in enumerate(zip(reference, paths, strict=True)):
            here = partial / path
            here.mkdir(parents=True, exist_ok=True)
            with (
                named(setup, len(reference)),
                shown(context, setup, obj, own_size=len(reference) > 1) as there,
            ):
                steps = partial_export(
                    there,
                    obj,
                    here,
                    setup.reference,
                    fit,
                    reference_view,
                    upright,
                    several=len(reference) > 1,
                    is_first=first is None,
                    leaves=leaves,
                    targets=targets,
                )
                part = drained(steps)
                part.request["picture"] = setup.request(there)
            leaves, unseen = part.leaves, unseen & part.unseen
            if first is None:
                first, notes = part, list(part.findings.notes)
                first.request["more_pictures"] = paths[1:]
            else:
                notes += [f"Picture {setup.label}: {note}" for note in part.findings.notes if note not in notes]
                if _moves(first.values, part.values):
                    notes.append(MOVING_VALUES.format(label=setup.label))
                    part.request["notes"].append(MOVING_VALUES.format(label=setup.label))
                part.write_request(here)
                share_files(partial, here)
            tell((done + 1) / len(reference))
        for number in sorted(unseen):
            each = targets[number]
            assert each.material is not None  # it was read
            raise ExportError(NOWHERE.format(material=each.material.name, obj=each.object.name))
        assert first is not None
        first.write_request(partial)
    return ExportReport(Path(folder), first.request, tuple(notes))


def _check_names(obj: bpy.types.Object, fit: dict[str, Any], targets: Sequence[FittedSlot]) -> None:
    """Raise `ExportError` where `fit` names a value that there is not, or that cannot be fitted."""
    fitted = targets or [FittedSlot.active(obj)]
    for each, own in zip(fitted, fits_of_each(fitted, fit, several=bool(targets)), strict=True):
        wanted_values(each, own, Findings())


def _moves(first: Mapping[Any, Any], other: Mapping[Any, Any]) -> bool:
    """Whether a value that two pictures have is not the same in both."""
    return any(first[name] != other[name] for name in first.keys() & other.keys())


def export_steps(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    folder: Path,
    reference: Picture | None,
    fit: dict[str, Any],
    reference_view: str,
    upright: bool,
    tell: Callable[[float], None] = lambda _share: None,
    targets: Sequence[FittedSlot] = (),
) -> Steps[ExportReport]:
    """`export_job` of one picture in steps: it yields while a second Blender works, and needs the same context then.

    The scene has been read when it yields first. Closing it ends the second Blender and leaves `folder` as it was.
    """
    with new_job_folder(Path(folder)) as partial:
        part = yield from partial_export(
            context, obj, partial, reference, fit, reference_view, upright, tell, targets=targets
        )
        part.write_request(partial)
    return ExportReport(Path(folder), part.request, tuple(part.findings.notes))


def drained(steps: Steps[Found]) -> Found:
    """What steps return in the end, waited for."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value
        time.sleep(_LOOK_SECONDS)


def check_export(context: bpy.types.Context, obj: bpy.types.Object) -> tuple[list[str], list[str]]:
    """Return the errors and the notes an export would give, without writing anything."""
    findings = export_findings(context, obj)
    return findings.errors, findings.notes


def export_findings(context: bpy.types.Context, obj: bpy.types.Object, model: str = "") -> Findings:
    """Return what an export for a fit with this model would say, with what could be done about it, writing nothing."""
    findings = Findings(of_mitsuba=model == MITSUBA)
    data = read_scene(context, obj, findings)
    if data is not None:
        finish_scene(data, findings)
        scene_files(data, findings)
    return findings
