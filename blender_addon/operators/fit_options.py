# SPDX-License-Identifier: GPL-3.0-or-later
"""What every operator that starts fits has: the settings a script may give, the export, the start."""

# pyright: reportInvalidTypeForm=false, reportArgumentType=false
# Blender reads properties from annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ..backend.preferences import chosen_python, new_job_folder
from ..export.fitted_slot import FittedSlot
from ..export.job import ExportError, export_steps
from ..export.meshes.known_meshes import KnownMeshes
from ..export.nodes.closure_leaves import ClosureError
from ..export.nodes.shader_graph import source_of
from ..export.nodes.target_shader import leaf_called, target_shader
from ..export.reference.chosen_file import absolute
from ..export.reference.counted_part import CountedPart
from ..export.reference.picture_setup import PictureSetup
from ..export.reference.reference import Picture
from ..export.reference.reference_view import REFERENCE_VIEWS
from ..export.render_state import shown_object
from ..export.steps import Steps
from ..graph_values.mix_values import inside_values
from ..process.backend_python import BackendPythonError
from ..properties import PARAMETER_ITEMS, SOCKET_ITEMS, crossed_limits, node_value_key
from ..result.local_copy import unwritable
from ..result.write_back import WriteBackError, fitted_shader
from ..running import fit_queue, running_job
from ..running.fit_queue import PreparedFit

# what a script gives; buttons start with the defaults every time and the redo panel does not show them
_SCRIPT = {"HIDDEN", "SKIP_SAVE"}


class FitError(Exception):
    """The fit cannot start; the message is one sentence for the user."""


class FitOptions:
    """Settings of a fit, empty for those of the scene, and what follows from them."""

    reference: StringProperty(
        name="Reference", description="Picture to reproduce; empty: the scene's setting", options=_SCRIPT
    )
    preset: StringProperty(name="Preset", description="How to search; empty: the scene's setting", options=_SCRIPT)
    parameters: StringProperty(
        name="Parameters",
        description='"all", "reduced" or names with commas; empty: the scene\'s setting',
        options=_SCRIPT,
    )
    shader: StringProperty(
        name="Shader", description="Of a mix of shaders the one to fit; empty: the material's setting", options=_SCRIPT
    )
    model: StringProperty(name="Model", description="Material model; empty: the scene's setting", options=_SCRIPT)
    range: StringProperty(
        name="Range", description='"hdr", "ldr" or "auto"; empty: the scene\'s setting', options=_SCRIPT
    )
    max_iterations: IntProperty(
        name="Iterations", description="Most iterations of a stage; 0: the scene's setting", min=0, options=_SCRIPT
    )
    reference_view: StringProperty(
        name="How It Was Made", description='"scene" or "standard"; empty: the scene\'s setting', options=_SCRIPT
    )
    wait: BoolProperty(
        name="Wait", description="Return when the fit has ended; always so by default in background", options=_SCRIPT
    )

    def blocks(self) -> bool:
        """Whether the operator returns only when the fit has ended."""
        return self.wait or (bpy.app.background and not self.properties.is_property_set("wait"))

    def is_given(self) -> bool:
        """Whether a script has said anything of what is fitted, or to which picture."""
        return bool(self.reference or self.parameters or self.shader or self.model or self.reference_view)

    def start(self, fit: PreparedFit) -> None:
        """Start the backend; raises `FitError`, and removes a new folder, where it cannot be started."""
        start_fit(fit, timer=not self.blocks() and not bpy.app.background)

    def steps(
        self,
        context: bpy.types.Context,
        obj: bpy.types.Object,
        job_folder: str,
        targets: Sequence[FittedSlot] = (),
        notes: Sequence[str] = (),
        known: KnownMeshes | None = None,
    ) -> Steps[PreparedFit]:
        """Export the job folder of the object's active material, in steps that pause while a second Blender works.

        What operator and settings say is read at once, so the operator need not outlive the call. With `targets` the
        materials of those slots are fitted together instead. `notes` go before those of the export, and `known`
        has the meshes of exports before this one. The call and the steps raise `FitError` where the job cannot be
        exported.
        """
        settings = context.scene.mfo
        materials = [each.material for each in targets if each.material is not None] or [_active_material(obj)]
        material = materials[0]
        for each in materials:
            if unwritable(each):  # before the fit, since its values could not be applied
                raise FitError(unwritable(each))
        if self.shader:
            choose_shader(material, self.shader)
        several = settings.pictures and not self.reference
        reference = _pictures(settings) if several else _reference(settings, self.reference)
        made = self.reference_view or settings.reference_view
        if made not in REFERENCE_VIEWS:
            raise FitError(f"reference_view is {made!r}: give 'scene' or 'standard'.")
        python, given = python_of(context), bpy.path.abspath(job_folder)
        name = f"{len(materials)} materials" if targets else material.name
        uids, chosen = tuple(each.session_uid for each in materials), self._fit(settings, obj, targets)
        if targets and settings.queue:
            chosen["queue"] = True

        def exported() -> Steps[PreparedFit]:
            folder = Path(given) if given else new_job_folder(context, material.name)
            is_new = not folder.exists()
            try:
                report = yield from export_steps(
                    context, obj, folder, reference, chosen, made, upright=False, targets=targets, known=known
                )
            except ExportError as error:
                raise FitError(str(error)) from error
            return PreparedFit(python, folder, name, uids, (*notes, *report.notes), is_new)

        return exported()

    def _fit(
        self, settings: bpy.types.PropertyGroup, obj: bpy.types.Object, targets: Sequence[FittedSlot]
    ) -> dict[str, Any]:
        model = self.model or settings.model
        parameters: object = self.parameters or settings.parameter_set
        if parameters == "chosen":
            fitted = targets or [FittedSlot.active(obj)]
            inside = _chosen_inside(fitted, settings, model, several=bool(targets))
            parameters = [*_chosen(fitted, settings, model), *inside]
            if not parameters:
                raise FitError("No parameter is chosen: choose at least one, or All.")
        elif parameters not in ("all", "reduced"):
            parameters = [name.strip() for name in str(parameters).split(",") if name.strip()]
            if not parameters:
                raise FitError(f"parameters is {self.parameters!r}: give 'all', 'reduced' or names with commas.")
        fit = {
            "model": model,
            "preset": self.preset or settings.preset,
            "parameters": parameters,
            "max_iterations": self.max_iterations or settings.max_iterations,
        }
        fitted_names = {name.rpartition("/")[2] for name in parameters}  # of several materials, each name after its own
        chosen = {bound.name: [bound.lower, bound.upper] for bound in settings.bounds if bound.name in fitted_names}
        if settings.parameter_set == "chosen" and not self.parameters and chosen:
            if crossed_limits(settings):
                name = crossed_limits(settings)[0]
                raise FitError(f"The limits of {name} leave nothing: the least must be below the most.")
            fit["bounds"] = chosen
        compared = self.range or settings.range
        if compared not in ("auto", "hdr", "ldr"):
            raise FitError(f"range is {compared!r}: give 'hdr', 'ldr' or 'auto'.")
        return fit if compared == "auto" else fit | {"range": compared}


def start_fit(fit: PreparedFit, *, timer: bool) -> None:
    """Start the backend; raises `FitError`, and removes a new folder, where it cannot be started."""
    fit_queue.begin()
    try:
        running_job.start(fit, timer=timer)
    except OSError as error:
        if fit.is_new:
            shutil.rmtree(fit.folder, ignore_errors=True)
        raise FitError(
            f"The backend could not be started with {fit.python} in {fit.folder} ({error.strerror or error})."
        ) from error


def start_or_queue(fit: PreparedFit) -> None:
    """Start a fit, or let it wait for the one that runs; errors are those of `start_fit`."""
    if running_job.current is None:
        start_fit(fit, timer=True)
    else:
        fit_queue.add(fit)
    running_job.redraw()


def python_of(context: bpy.types.Context) -> Path:
    """The interpreter of the backend; raises `FitError` where there is none."""
    try:
        return chosen_python(context)
    except BackendPythonError as error:
        raise FitError(str(error)) from error


def target_of(context: bpy.types.Context, name: str) -> bpy.types.Object:
    """The object of that name, or the active one; raises `FitError` where there is none."""
    if name:
        obj = shown_object(name, context.scene, context.view_layer)
        if obj is None:
            raise FitError(
                f"The scene {context.scene.name!r} has no object {name!r}: give the name of one of its objects."
            )
        return obj
    obj = context.view_layer.objects.active
    if obj is None:
        raise FitError("No object is active: select the object whose material is to be fitted, or give its name.")
    return obj


def selected_targets(context: bpy.types.Context, most: int = 1000) -> list[bpy.types.Object]:
    """One selected object for each active material with a shader that is fitted, at most `most`."""
    chosen: dict[int, bpy.types.Object] = {}
    for obj in context.selected_objects:
        material = obj.active_material
        if target_shader(material) is not None:
            chosen.setdefault(material.session_uid, obj)
        if len(chosen) == most:
            break
    return list(chosen.values())


def _active_material(obj: bpy.types.Object) -> bpy.types.Material:
    material = obj.active_material
    if material is None:
        raise FitError(f"Object {obj.name!r} has no material in its active slot: give it one with a Principled BSDF.")
    try:
        fitted_shader(material)
    except WriteBackError as error:
        raise FitError(str(error)) from error
    return material


def choose_shader(material: bpy.types.Material, wanted: str) -> None:
    """Let a shader of a mix be the one that is fitted; raises `FitError` where there is none of that name."""
    try:
        material.mfo.leaf = leaf_called(material, wanted)
    except ClosureError as error:
        raise FitError(str(error)) from error


def _reference(settings: bpy.types.PropertyGroup, given: str) -> Picture:
    """The picture that a script gives, or the scene's with what of it counts."""
    if not given and settings.reference_source == "IMAGE":
        if settings.reference_image is None:
            raise FitError("No reference is chosen: choose an image of this file, or a picture on disk.")
        return counted_part(settings.reference_image, settings.first_picture.part)
    path = given or settings.reference_path
    if not path:
        raise FitError("No reference is chosen: give the picture whose material is to be recovered.")
    picture = _absolute(path)
    return picture if given else counted_part(picture, settings.first_picture.part)


def _absolute(given: str, of: str = "") -> Path:
    try:
        return absolute(given)
    except ExportError as error:
        raise FitError(f"{of}{error}") from error


def counted_part(picture: Path | bpy.types.Image, part: bpy.types.PropertyGroup) -> Picture:
    """The picture, of which not all counts where that is set."""
    return picture if part.is_whole else CountedPart(picture, part.crop, part.mask, part.use_alpha)


def _chosen_inside(
    fitted: Sequence[FittedSlot], settings: bpy.types.PropertyGroup, model: str, *, several: bool
) -> list[str]:
    """The chosen values inside the nodes of these materials; of `several` with the material's name before."""
    found = []
    for material, target in ((each.material, target_shader(each.material)) for each in fitted):
        if model != "blender_principled" or material is None or target is None or not settings.node_values:
            continue
        keys = {value.name: node_value_key(settings, material, value.name) for value in inside_values(target)}
        found += [key if several else name for name, key in keys.items() if key in settings.node_values]
    return found


def _pictures(settings: bpy.types.PropertyGroup) -> list[PictureSetup]:
    """All pictures of the list that are used, with what each shows."""
    found = []
    for number, entry in enumerate((settings.first_picture, *settings.pictures), 1):
        if not entry.use:
            continue
        if number > 1 and not entry.path:
            raise FitError(f"Picture {number} has no file: choose it, or do not use this picture.")
        if number == 1:
            reference = _reference(settings, "")
        else:
            reference = counted_part(_absolute(entry.path, f"Picture {number}: "), entry.part)
        camera = entry.camera.name if entry.camera is not None else ""
        scene = entry.scene.name if entry.scene is not None else ""
        found.append(PictureSetup(reference, number, entry.frame, camera, scene, exposure=entry.exposure))
    if not found:
        raise FitError("No picture is used: tick one at least.")
    return found


def _chosen(fitted: Sequence[FittedSlot], settings: bpy.types.PropertyGroup, model: str) -> list[str]:
    """The chosen parameters of a model in the order of its list; the property itself is a set.

    Of Blender's sockets those that have no link, for the panel shows no box for others: with the material's name before
    where not all of these materials have the same.
    """
    if model != "blender_principled":
        return [key for key, *_ in PARAMETER_ITEMS if key in settings.parameters]
    free = [
        [key for key, name, *_ in SOCKET_ITEMS if key in settings.sockets and _is_free(each, name)] for each in fitted
    ]
    if all(names == free[0] for names in free):
        return free[0]
    of_each = zip(fitted, free, strict=True)
    return [f"{each.material.name}/{name}" for each, names in of_each if each.material for name in names]


def _is_free(fitted: FittedSlot, socket: str) -> bool:
    """Whether the fitted shader has such a socket without a link."""
    target = target_shader(fitted.material)
    found = target.sockets.get(socket) if target is not None else None
    return found is not None and source_of(found) is None
