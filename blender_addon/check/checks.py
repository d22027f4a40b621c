# SPDX-License-Identifier: GPL-3.0-or-later
"""What is fine, ignored, still to choose, or stops a fit, as plain data; looks at no mesh and no pixel, so it is quick.

The export itself checks more (geometry, lights, visibility): `mfo.check` adds what it says.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import bpy

from ..export.camera.read_camera import has_camera, note_picture_settings
from ..export.camera.render_region import Size, pictured_region, pictured_size, render_region
from ..export.findings import ExportError, Findings, Fix
from ..export.fitted_slot import FittedSlot
from ..export.images.image_pixels import UnreadableImageError, is_data, read_pixels, without_pixels
from ..export.images.picture_header import PictureHeader
from ..export.materials.read_material import read_target
from ..export.nodes.shader_graph import source_of
from ..export.nodes.target_shader import TargetShader, fits_all_leaves, target_shader
from ..export.reference.chosen_file import DISPLAY_SUFFIXES, LINEAR_SUFFIXES, chosen_file
from ..export.reference.counted_part import CountedPart
from ..export.reference.picture_setup import size_of
from ..export.reference.reference import (
    holds_display_colours,
    refuse_size,
)
from ..export.reference.reference_colour import other_space
from ..export.reference.reference_view import SCENE, mixed_by, needs_table, output_view
from ..export.reference.turned_picture import turn_notes
from ..export.render_state import instanced_objects, rendered_objects
from ..export.scene.read_scene import MESH_TYPES
from ..graph_values.mix_values import default_values, inside_values
from ..pictures.overlay import background_of
from ..properties import SOCKET_ITEMS, crossed_limits, node_value_key
from ..result.animated_sockets import DRIVER, REPLACE, animation_of
from ..result.local_copy import unwritable
from ..versions import overrides_of
from .ticked_slots import NONE_TICKED, left_out, ticked_slots

FINE, IGNORED, TO_CHOOSE, STOPS = "fine", "ignored", "to_choose", "stops"
REGION_ALONE = "Render Region is on, and the picture shows the region alone."
REGION_IN_FRAME = "Render Region is on: where the picture is empty beside the region, the region alone counts."
SHOWN_INSIDE = 3  # values of nodes that the check names
_FITTED = {name for _, name, *_ in SOCKET_ITEMS}


@dataclass(frozen=True)
class Finding:
    """One line of the check: a level, a sentence, and what one press could do about it."""

    level: str
    sentence: str
    fixes: tuple[Fix, ...] = ()


def quick_check(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> tuple[Finding, ...]:
    """Everything that can be known about the next fit without reading geometry; worst first.

    It is of the ticked materials where several are listed, else of the active object's.
    """
    found = [*_targets(scene, view_layer), *_picture(scene, view_layer), *_reference(scene), *_more_pictures(scene)]
    return in_order(found)


def from_export(findings: Findings) -> tuple[Finding, ...]:
    """The sentences of an export as lines of the check."""
    levels = [(STOPS, findings.errors), (IGNORED, findings.notes)]
    return tuple(Finding(level, s, findings.fixes[s]) for level, sentences in levels for s in sentences)


def in_order(found: list[Finding]) -> tuple[Finding, ...]:
    """Each sentence once: what stops the fit, what is still to choose, what is ignored, what is fine."""
    once = {finding.sentence: finding for finding in reversed(found)}
    levels = (STOPS, TO_CHOOSE, IGNORED, FINE)
    return tuple(f for level in levels for f in reversed(list(once.values())) if f.level == level)


def _targets(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> list[Finding]:
    if not scene.mfo.targets:
        target = view_layer.objects.active
        return _target(scene, view_layer, target, target.active_material_index if target is not None else 0)
    slots = ticked_slots(scene)
    gone = left_out(scene)
    found = [Finding(IGNORED if slots else STOPS, sentence) for sentence in gone]
    found += [] if slots or gone else [Finding(STOPS, NONE_TICKED)]
    for each in slots:
        found += [_named(finding, each) for finding in _target(scene, view_layer, each.object, each.slot)]
    return found


def _named(finding: Finding, fitted: FittedSlot) -> Finding:
    """A line with the name of the material that it is of, unless it names it or the object; its buttons mend that."""
    name = fitted.material.name if fitted.material is not None else ""
    is_named = any(f"'{each}'" in finding.sentence for each in (name, fitted.object.name))
    sentence = finding.sentence if is_named else f"'{name}': {finding.sentence}"
    of = fitted.object.name, fitted.slot
    return replace(finding, sentence=sentence, fixes=tuple(replace(fix, of=of) for fix in finding.fixes))


def _target(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, target: bpy.types.Object | None, slot: int
) -> list[Finding]:
    if target is None or target.type not in MESH_TYPES:
        what = "No object is active" if target is None else f"'{target.name}' has no faces"
        fixes = [Fix("select", item.name) for item in scene.objects if _can_be_fitted(item, view_layer)]
        return [Finding(STOPS, f"{what}: select the object whose material is to be fitted.", tuple(fixes[:3]))]
    findings = Findings()
    if target.name_full not in rendered_objects(view_layer) | instanced_objects(view_layer):
        findings.error(f"Object '{target.name}' is hidden in the render: show it.", Fix("show_in_render"))
    material = target.material_slots[slot].material if slot < len(target.material_slots) else None
    with without_pixels():
        read_target(material, target.name, slot, findings)
    found = list(from_export(findings))
    if material is None or target_shader(material) is None:
        return found
    if unwritable(material):
        found.append(Finding(STOPS, unwritable(material), (Fix("make_local"),)))
    found += _animation(scene, material)
    others = _others_with(material, target, scene)
    if others:
        listed = ", ".join(others[:2]) + (f" and {len(others) - 2} more" if len(others) > 2 else "")
        sentence = f"Material '{material.name}' is also on {listed}: applied values change it there too."
        found.append(Finding(IGNORED, sentence, (Fix("single_user"),)))
    found += _free_values(scene, material, "".join(findings.errors))
    return found


def _animation(scene: bpy.types.Scene, material: bpy.types.Material) -> list[Finding]:
    target = target_shader(material)
    assert target is not None
    found = []
    for fitted, what in animation_of(target.sockets).items():
        if fitted not in _FITTED:
            continue
        name = target.own_name(fitted)
        if scene.mfo.animated == REPLACE:
            done = "the driver" if what == DRIVER else "the value at this frame"
            found.append(Finding(FINE, f"{name} has {what}: an apply replaces {done}."))
            continue
        fix = Fix("remove_driver", name) if what == DRIVER else Fix("replace_animation")
        sentence = f"{name} has {what}: it is fitted as it is at this frame, and an apply leaves it out."
        found.append(Finding(IGNORED, sentence, (fix,)))
    return found


def _others_with(material: bpy.types.Material, target: bpy.types.Object, scene: bpy.types.Scene) -> list[str]:
    """Names of other objects of the scene that have the material."""
    if material.users <= 1 and target.data.users <= 1:
        return []
    return [o.name for o in scene.objects if o != target and any(s.material == material for s in o.material_slots)]


def _free_values(scene: bpy.types.Scene, material: bpy.types.Material, said: str) -> list[Finding]:
    target = target_shader(material)
    assert target is not None
    sockets = {name: socket for name, socket in target.sockets.items() if name in _FITTED}
    linked = [name for name, socket in sockets.items() if source_of(socket) is not None]
    settings = scene.mfo
    found = [Finding(FINE, f"'{material.name}' has a {target.node.bl_label}.")]
    inside = _inside(settings, target, material)
    if settings.parameter_set == "chosen" and settings.model == "blender_principled":
        chosen = {name for key, name, *_ in SOCKET_ITEMS if key in settings.sockets and name in sockets}
        of_others = bool(settings.targets) and len(settings.node_values) > 0
        if not chosen - set(linked) and not inside and not of_others:
            fix = (Fix("all_parameters"),)
            return [Finding(STOPS, "No value is chosen that has no link: choose at least one, or All.", fix)]
        linked = [name for name in linked if name in chosen]
        for name in crossed_limits(settings):
            found.append(Finding(STOPS, f"The limits of {name} leave nothing: the least must be below the most."))
    linked = [target.own_name(name) for name in linked if f"{target.own_name(name)} of material" not in said]
    if inside:
        more = f" and {len(inside) - SHOWN_INSIDE} more" if len(inside) > SHOWN_INSIDE else ""
        where = "beside it" if target.is_mixed else "inside nodes"
        found.append(Finding(FINE, f"Fitted {where}: {', '.join(inside[:SHOWN_INSIDE])}{more}."))
    elif linked:
        sentence = f"Kept as nodes give it, not fitted: {', '.join(linked)}."
        found.append(Finding(FINE, sentence, tuple(Fix("unlink", name) for name in linked[:3])))
    return found


def _inside(settings: bpy.types.PropertyGroup, target: TargetShader, material: bpy.types.Material) -> list[str]:
    """Names of the values inside the target's nodes, or of a mix the others', that the next fit changes."""
    if settings.model != "blender_principled" or settings.parameter_set == "reduced" or settings.preset == "paper":
        return []
    if settings.parameter_set == "chosen":
        keys = {value.name: node_value_key(settings, material, value.name) for value in inside_values(target)}
        return [name for name, key in keys.items() if key in settings.node_values]
    return [value.name for value in default_values(target, all_leaves=fits_all_leaves(material))]


def _picture(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> list[Finding]:
    findings, size = Findings(), _reference_size(scene)
    if has_camera(scene, findings):
        note_picture_settings(scene, findings, size)
    replaced = overrides_of(view_layer)
    if replaced:
        name, other = view_layer.name, replaced[0]
        sentence = f"View layer '{name}' replaces materials or the world by '{other}': remove the override."
        findings.error(sentence, Fix("no_override"))
    found = list(from_export(findings))
    if scene.render.engine != "CYCLES":
        engine = scene.render.engine.removeprefix("BLENDER_").replace("_", " ").title()
        sentence = f"The render engine is {engine}; the fit reproduces what Cycles shows."
        found.append(Finding(IGNORED, sentence, (Fix("cycles"),)))
    if not findings.errors:
        width, height = pictured_size(scene.render, size)
        found.append(Finding(FINE, f"Camera '{scene.camera.name}', {width} x {height} pixels."))
        if render_region(scene.render) is not None:
            alone = pictured_region(scene.render, size) is not None
            sentence = REGION_ALONE if alone else REGION_IN_FRAME
            found.append(Finding(FINE, sentence, (Fix("whole_frame"),)))
    return found


def _reference_size(scene: bpy.types.Scene) -> Size | None:
    """Width and height of the chosen reference, None where they are not known."""
    settings = scene.mfo
    if settings.reference_source == "IMAGE":
        return size_of(settings.reference_image)
    try:
        return size_of(Path(settings.reference_path)) if settings.reference_path else None
    except OSError:
        return None


def _more_pictures(scene: bpy.types.Scene) -> list[Finding]:
    """The further pictures of the list: those without a file or at a frame that the scene does not have."""
    found, settings = [], scene.mfo
    for number, entry in enumerate(settings.pictures, 2):
        if not entry.use:
            continue
        path, shows = Path(bpy.path.abspath(entry.path)), entry.scene or scene
        if not entry.path:
            found.append(Finding(TO_CHOOSE, f"Choose the file of picture {number}, or do not use it."))
        elif problem := _file_problem(entry.path):
            found.append(Finding(STOPS, f"Picture {number}: {problem}"))
        elif not shows.frame_start <= entry.frame <= shows.frame_end:
            frames = f"{shows.frame_start} to {shows.frame_end}"
            found.append(Finding(STOPS, f"Picture {number}: frame {entry.frame} is outside of the frames {frames}."))
        elif problem := _part_problem(entry.part, path):
            found.append(Finding(STOPS, f"Picture {number}: {problem}"))
        else:
            found.append(Finding(FINE, f"Picture {number}: {path.name}, frame {entry.frame}."))
    return found


def _reference(scene: bpy.types.Scene) -> list[Finding]:
    settings = scene.mfo
    is_image = settings.reference_source == "IMAGE"
    if not (settings.reference_image if is_image else settings.reference_path):
        kind = "an image of this file" if is_image else "a file"
        behind = background_of(scene.camera)
        fixes = (Fix("background", behind.name),) if behind is not None else ()
        # no fault: every scene begins like this
        return [Finding(TO_CHOOSE, f"Choose the picture to match: {kind}.", fixes)]
    try:
        found = _image_reference(settings.reference_image) if is_image else _file_reference(scene)
    except ExportError as problem:
        return [Finding(STOPS, str(problem), problem.fixes)]
    problems = []
    if all(found.size):
        wanted = pictured_size(scene.render, found.size)
        of_region = pictured_region(scene.render, found.size) is not None
        problems += _refused(partial(refuse_size, of_region=of_region), found.name, found.size, wanted)
    words = f"scene-linear {found.space}, converted to Rec.709" if found.space else "scene-linear Rec.709"
    if not found.is_linear:
        problems += _refused(needs_table, scene, found.name, settings.reference_view)
        words = "taken as a photograph or a render under Standard"
        if settings.reference_view == SCENE:
            words = f"display colours under the view {output_view(scene)[0].view_transform}"
            words = f"taken as rendered in this scene, {words}" if mixed_by(scene) else words
    said = [Finding(IGNORED, " ".join(found.turned), (Fix("upright"),))] if found.turned else []
    problems += _part(scene, found)
    return problems or [*said, *_part_words(scene), Finding(FINE, f"Reference: {found.words}, {words}.")]


def _part(scene: bpy.types.Scene, found: _Picture) -> list[Finding]:
    """What keeps the part of the picture that counts from being used."""
    problem = _part_problem(scene.mfo.first_picture.part, Path(found.name))
    return [Finding(STOPS, problem, (Fix("whole_picture"),))] if problem else []


def _part_problem(part: bpy.types.PropertyGroup, path: Path) -> str:
    if part.is_whole:
        return ""
    try:
        with without_pixels():
            CountedPart(path, part.crop, part.mask, part.use_alpha).check(thorough=False)
    except ExportError as problem:
        return str(problem)
    return ""


def _part_words(scene: bpy.types.Scene) -> list[Finding]:
    """That not all of the picture counts, and what is made of a mask of another size."""
    part = scene.mfo.first_picture.part
    if part.is_whole:
        return []
    size = pictured_size(scene.render, _reference_size(scene))
    if part.mask is not None and all(part.mask.size) and tuple(part.mask.size) != size:
        mask, picture = (f"{width}x{height}" for width, height in (part.mask.size, size))
        said = f"The mask '{part.mask.name}' is {mask} and the picture {picture}: it is scaled to that."
        return [Finding(IGNORED, said, (Fix("whole_picture"),))]
    return [Finding(FINE, "Only a part of the picture counts.", (Fix("whole_picture"),))]


@dataclass(frozen=True)
class _Picture:
    name: str
    size: tuple[int, int]  # width and height, 0 where unknown
    words: str
    is_linear: bool
    space: str = ""  # of linear colours that are converted
    turned: tuple[str, ...] = ()  # what is to be said of a turn by EXIF data


def _file_problem(given: str) -> str:
    """Why there is no picture at a path."""
    try:
        _promised_file(given)
    except ExportError as problem:
        return str(problem)
    return ""


def _promised_file(given: str) -> tuple[Path, PictureHeader]:
    path, header = chosen_file(given)
    if header is None:
        raise ExportError(
            f"The reference '{path.name}' holds no picture of the kind that its name says: choose another file."
        )
    return path, header


def _file_reference(scene: bpy.types.Scene) -> _Picture:
    path, header = _promised_file(scene.mfo.reference_path)
    kind = f"{header.depth} {header.kind}".strip()
    words = f"{header.width} x {header.height}, {kind}" if header.width else header.kind
    is_linear = path.suffix.lower() in LINEAR_SUFFIXES
    said = turn_notes(path.name, header, pictured_size(scene.render, (header.width, header.height)))
    space = other_space(header) if is_linear else ""
    return _Picture(path.name, (header.width, header.height), words, is_linear, space, said)


def _image_reference(image: bpy.types.Image) -> _Picture:
    try:
        with without_pixels():
            read_pixels(image)
    except UnreadableImageError as problem:
        fixes = (Fix("colorspace", "sRGB"), Fix("colorspace", "Linear Rec.709")) if "colour" in str(problem) else ()
        raise ExportError(f"The reference '{image.name}' {problem}.", *fixes) from None
    width, height = image.size
    space = "raw numbers taken as colours" if is_data(image) else image.colorspace_settings.name
    return _Picture(image.name, (width, height), f"{width} x {height}, {space}", not holds_display_colours(image))


def asks_view(scene: bpy.types.Scene) -> bool:
    """Whether it makes a difference how the chosen reference was made; reads no file, for the panel's drawing."""
    settings = scene.mfo
    if settings.reference_source == "IMAGE":
        image = settings.reference_image
        is_display = image is not None and holds_display_colours(image)
    else:
        is_display = Path(settings.reference_path).suffix.lower() in DISPLAY_SUFFIXES
    return is_display and bool(mixed_by(scene))


def _refused(check: Callable[..., object], *arguments: object) -> list[Finding]:
    """What a check of the export refuses, as lines."""
    try:
        check(*arguments)
    except ExportError as problem:
        return [Finding(STOPS, str(problem), problem.fixes)]
    return []


def _can_be_fitted(item: bpy.types.Object, view_layer: bpy.types.ViewLayer) -> bool:
    has_faces = item.type in MESH_TYPES and item.name in view_layer.objects
    return has_faces and target_shader(item.active_material) is not None
