# SPDX-License-Identifier: GPL-3.0-or-later
"""Export: an object, its active material slot and the scene camera become a job folder for the backend."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from .files.job_folder import MORE_PICTURES, new_job_folder, share_files
from .findings import ExportError, Findings, NotShownError
from .fitted_slot import FittedSlot, check_slots
from .leaves_by_pictures import leaves_by_pictures
from .materials.wanted_values import fits_of_each, wanted_values
from .meshes.known_meshes import KnownMeshes
from .partial_export import MITSUBA, PartialExport, partial_export
from .reference.picture_setup import PictureSetup, check_setups, named, shown
from .reference.reference import Picture
from .reference.reference_view import SCENE
from .scene.read_scene import finish_scene, read_scene
from .scene.scene_file import scene_files
from .steps import Steps, drained, held

NOWHERE = "Material '{material}' of '{obj}' is in none of the pictures: leave it out, or add a picture that shows it."
MOVING_VALUES = (
    "Picture {label}: the material has other values at its frame; the fit looks for one set for all pictures."
)
READING = "Picture {} of {}"
LEFT_OUT = "A picture was left out, for it shows nothing of what is fitted. {why}"

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
    EXIF data say. Pictures that show nothing of what is fitted are left out, as long as another one does. `tell` gets
    the share that is done, of work that a million triangles make some seconds long.

    Raises
    ------
    ExportError
        If the scene, the reference or the folder cannot be used. Then `folder` is as it was.
    """
    return drained(export_steps(context, obj, folder, reference, fit, reference_view, upright, tell, targets))


def export_steps(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    folder: Path,
    reference: Picture | Sequence[PictureSetup] | None,
    fit: dict[str, Any],
    reference_view: str,
    upright: bool,
    tell: Callable[[float], None] = lambda _share: None,
    targets: Sequence[FittedSlot] = (),
    known: KnownMeshes | None = None,
) -> Steps[ExportReport]:
    """`export_job` in steps, which need the same context each: it pauses while a second Blender works.

    Of one picture the scene has been read when a pause does not hold it. Closing the steps ends the second Blender and
    leaves `folder` as it was. `known` has the meshes of earlier exports of the file.
    """
    known = known or KnownMeshes()
    if isinstance(reference, Sequence):
        return (
            yield from _several(context, obj, folder, reference, fit, reference_view, upright, tell, targets, known)
        )
    with new_job_folder(Path(folder)) as partial:
        part = yield from partial_export(
            context, obj, partial, reference, fit, reference_view, upright, tell, targets=targets, known=known
        )
        part.write_request(partial)
    return ExportReport(Path(folder), part.request, tuple(part.findings.notes))


def _several(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    folder: Path,
    pictures: Sequence[PictureSetup],
    fit: dict[str, Any],
    reference_view: str,
    upright: bool,
    tell: Callable[[float], None],
    targets: Sequence[FittedSlot],
    known: KnownMeshes,
) -> Steps[ExportReport]:
    """One picture after the other; while it pauses the file shows what it did before."""
    check_setups(pictures)
    count = len(pictures)
    if count > 1:  # what is named wrongly is so in all of them
        check_slots(targets)
        _check_names(obj, fit, targets)
    exported: list[PartialExport] = []
    notes: list[str] = []
    left_out: list[NotShownError] = []
    unseen = set(range(len(targets)))
    leaves: Sequence[str | None] | None = None
    if count > 1 and targets:
        leaves = yield from leaves_by_pictures(context, obj, pictures, fit, targets)
    with new_job_folder(Path(folder)) as partial:
        paths: list[str] = []  # of all but the first
        for done, setup in enumerate(pictures):
            path = f"{MORE_PICTURES}/{setup.number}" if exported else ""
            here = partial / path
            here.mkdir(parents=True, exist_ok=True)
            steps = _one_of_several(
                context,
                obj,
                here,
                setup,
                fit,
                reference_view,
                upright,
                several=count > 1,
                is_first=not exported,
                leaves=leaves,
                targets=targets,
                known=known,
            )
            show = functools.partial(shown, context, setup, obj, own_size=count > 1)
            try:
                with named(setup, count):
                    part = yield from held(steps, show, READING.format(done + 1, count), done / count)
            except NotShownError as error:
                left_out.append(error)
                if path:
                    here.rmdir()
                continue
            leaves, unseen = part.leaves, unseen & part.unseen
            if not exported:
                notes = list(part.findings.notes)
            else:
                paths.append(path)
                notes += [f"Picture {setup.label}: {note}" for note in part.findings.notes if note not in notes]
                if _moves(exported[0].values, part.values):
                    notes.append(MOVING_VALUES.format(label=setup.label))
                    part.request["notes"].append(MOVING_VALUES.format(label=setup.label))
                part.write_request(here)
                share_files(partial, here)
            exported.append(part)
            tell((done + 1) / count)
        if not exported:
            raise left_out[0]
        for number in sorted(unseen):
            each = targets[number]
            assert each.material is not None  # it was read
            raise ExportError(NOWHERE.format(material=each.material.name, obj=each.object.name))
        first = exported[0]
        said = [LEFT_OUT.format(why=error) for error in left_out]
        first.request["notes"] += said
        first.request["more_pictures"] = paths
        first.write_request(partial)
        notes += said
    return ExportReport(Path(folder), first.request, tuple(notes))


def _one_of_several(
    context: bpy.types.Context,
    obj: bpy.types.Object,
    folder: Path,
    setup: PictureSetup,
    fit: dict[str, Any],
    reference_view: str,
    upright: bool,
    **how: Any,
) -> Steps[PartialExport]:
    """What the picture needs, with what its request says of it, as the context shows it."""
    part = yield from partial_export(context, obj, folder, setup.reference, fit, reference_view, upright, **how)
    part.request["picture"] = setup.request(context)
    return part


def _check_names(obj: bpy.types.Object, fit: dict[str, Any], targets: Sequence[FittedSlot]) -> None:
    """Raise `ExportError` where `fit` names a value that there is not, or that cannot be fitted."""
    fitted = targets or [FittedSlot.active(obj)]
    for each, own in zip(fitted, fits_of_each(fitted, fit, several=bool(targets)), strict=True):
        wanted_values(each, own, Findings())


def _moves(first: Mapping[Any, Any], other: Mapping[Any, Any]) -> bool:
    """Whether a value that two pictures have is not the same in both."""
    return any(first[name] != other[name] for name in first.keys() & other.keys())


def check_export(context: bpy.types.Context, obj: bpy.types.Object) -> tuple[list[str], list[str]]:
    """Return the errors and the notes an export would give, without writing anything."""
    findings = export_findings(context, obj)
    return findings.errors, findings.notes


def export_findings(
    context: bpy.types.Context, obj: bpy.types.Object, model: str = "", targets: Sequence[FittedSlot] = ()
) -> Findings:
    """Return what an export for a fit with this model would say, with what could be done about it, writing nothing.

    With `targets` of a fit of the materials of those slots instead of the object's active one.
    """
    findings = Findings(of_mitsuba=model == MITSUBA)
    try:
        check_slots(targets)
    except ExportError as problem:
        findings.error(str(problem))
        return findings
    data = drained(read_scene(context, obj, findings, targets=targets))
    if data is not None:
        finish_scene(data, findings)
        scene_files(data, findings)
    return findings
