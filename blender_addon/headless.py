# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's part of `mfo blend`: export a job, apply a result, render with Cycles.

Run by the bpy module or by a Blender program::

    python -m blender_addon.headless export FILE --object NAME --reference REF --job DIR [--fit JSON]
    blender -b --factory-startup --python blender_addon/headless.py -- apply FILE --job DIR --save-as OUT

The answer is one JSON object with `status` and `sentence` on a line of its own, the last on stdout that starts with {;
Blender prints other lines around it. Exit codes: 0 for the status "ok", 2 for bad input, 1 for anything else.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

if not __package__:  # run by a Blender program as a script: come back as a module of the package
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
    from blender_addon import headless

    sys.exit(headless.main(headless.arguments()))

from .headless_words import HeadlessError, fitted_slots, pictures

EXIT_CODES = {"ok": 0, "bad_input": 2}


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        raise HeadlessError(f"{self.prog}: {message}.")


def main(words: Sequence[str]) -> int:
    """Do one command; prints the JSON line and returns the exit code."""
    try:
        chosen = _parser().parse_args(words)
        answer = {"status": "ok", "sentence": "Done."} | chosen.run(chosen)
    except HeadlessError as error:
        answer = {"status": "bad_input", "sentence": str(error)}
    except Exception as error:  # the caller reads one line, never a traceback
        answer = {"status": "failed", "sentence": f"Blender failed with {type(error).__name__}: {error}"}
    sys.stderr.flush()
    print("\n" + json.dumps(answer), flush=True)
    return EXIT_CODES.get(answer["status"], 1)


def export(chosen: argparse.Namespace) -> dict[str, Any]:
    """Write the job folder of an object's active material, or of several materials."""
    bpy = _open(chosen.file)
    from .export.job import ExportError, export_job
    from .export.nodes.closure_leaves import ClosureError
    from .export.nodes.target_shader import leaf_called
    from .result.local_copy import unwritable

    fitted = fitted_slots(bpy, chosen)
    several, obj = len(fitted) > 1, fitted[0].object
    obj.active_material_index = fitted[0].slot  # of the open copy of the file, which is not saved
    try:
        fit = json.loads(chosen.fit)
    except ValueError as error:
        raise HeadlessError(f"--fit is not JSON ({error}).") from error
    if not isinstance(fit, dict):
        raise HeadlessError("--fit is not a JSON object.")
    if chosen.shader:
        try:
            obj.active_material.mfo.leaf = leaf_called(obj.active_material, chosen.shader)
        except ClosureError as error:
            raise HeadlessError(str(error)) from error
    refused = [said for each in fitted if (said := unwritable(each.material))]
    if chosen.will_apply and refused and (several or not chosen.make_local):
        raise HeadlessError(refused[0])
    try:
        report = export_job(
            bpy.context,
            obj,
            Path(chosen.job).absolute(),
            reference=pictures(chosen),
            fit=fit,
            reference_view=chosen.reference_view,
            upright=chosen.upright,
            targets=fitted if several else (),
        )
    except ExportError as error:
        raise HeadlessError(str(error)) from error
    return {"job": str(report.folder), "material": obj.active_material.name, "notes": list(report.notes)}


def apply(chosen: argparse.Namespace) -> dict[str, Any]:
    """Put the values of a finished job on its material and save the file under another name.

    A result that does not match its reference is refused without `--force`; of several materials those that match are
    applied.
    """
    bpy = _open(chosen.file)
    results, notes = _results(chosen)
    if len(results) > 1 and chosen.material:
        raise HeadlessError("--material names one material, and the job has several: leave it out.")
    applied = [_put_values(bpy, chosen, folder) for folder in results]
    _save(chosen.save_as)
    notes += [note for _, _, _, said in applied for note in said]
    material, _result, values, _ = applied[0]
    answer = {"saved": str(chosen.save_as), "material": material.name, "sockets": values, "notes": notes}
    if len(applied) > 1:
        answer["materials"] = {each.name: sockets for each, _, sockets, _ in applied}
    return answer


def _results(chosen: argparse.Namespace) -> tuple[list[Path], list[str]]:
    """The folders of the results that are to be applied, and what is left out."""
    from .result.job_result import JobResultError, must_ask, read_job_result, result_folders

    folder = Path(chosen.job).absolute()
    try:
        found = {path: read_job_result(path) for path in result_folders(folder)}
    except JobResultError as error:
        raise HeadlessError(str(error)) from error
    refused = [result for result in found.values() if must_ask(result.verdict) and not chosen.force]
    if len(refused) == len(found):
        raise HeadlessError(f"{refused[0].sentence} Nothing was applied; --force applies it anyway.")
    said = [
        f"Material {one.material_name!r} was left as it is: {one.sentence} --force applies it anyway."
        for one in refused
    ]
    return [path for path, result in found.items() if result not in refused], said


def _put_values(bpy: Any, chosen: argparse.Namespace, folder: Path) -> tuple[Any, Any, dict[str, Any], list[str]]:
    """Apply the result in a folder; returns the material, the result, its values by socket and what was skipped."""
    from .export.render_state import shown_object
    from .result.job_result import JobResultError, read_job_result
    from .result.local_copy import LocalCopyError, make_local, unwritable
    from .result.write_back import WriteBackError, apply_values, result_to_sockets

    try:
        result = read_job_result(folder)
        name = chosen.material or result.material_name
        obj = shown_object(result.object_name, bpy.context.scene, bpy.context.view_layer)
        if obj is not None and chosen.make_local:
            slots = [each.material for each in obj.material_slots]
            slot = next((n for n, each in enumerate(slots) if each and each.name == name), obj.active_material_index)
            if slot < len(slots) and unwritable(slots[slot]):
                make_local(obj, slot)
        # the object's own comes first: a library may have a material of the same name
        fitted = [slot.material for slot in obj.material_slots if slot.material is not None] if obj is not None else []
        material = next((m for m in fitted if m.name == name), bpy.data.materials.get(name))
        if material is None:
            raise HeadlessError(f"{chosen.file} has no material {name!r}: give the one to change with --material.")
        values = result_to_sockets(result)
        notes = apply_values(material, values, result.folder, animated=chosen.animated, leaf=result.leaf or None)
        return material, result, values, notes
    except (JobResultError, WriteBackError, LocalCopyError) as error:
        raise HeadlessError(str(error)) from error


def check(chosen: argparse.Namespace) -> dict[str, Any]:
    """Render with the values of a finished job on its material, at the job's resolution and the scene's samples."""
    bpy = _open(chosen.file)
    _watch_parent(chosen.parent)
    from .export.camera.render_region import render_as
    from .result.job_result import result_folders, whole_job

    folders = result_folders(whole_job(Path(chosen.job).absolute()))  # with what was fitted together
    result, *_ = [_put_values(bpy, chosen, folder)[1] for folder in folders]
    render_as(bpy.context.scene.render, result.image, result.frame)
    return _render(bpy, chosen)


def render(chosen: argparse.Namespace) -> dict[str, Any]:
    """Render the scene with Cycles into a scene-linear EXR at the scene's resolution.

    With `--target` and `--material` as if that material were everywhere in the place of the target's.
    """
    bpy = _open(chosen.file)
    _watch_parent(chosen.parent)
    if not chosen.target:
        return _render(bpy, chosen)
    from .export.findings import ExportError
    from .export.reference.picture_setup import PictureSetup, shown

    (fitted,) = fitted_slots(bpy, chosen)
    material = bpy.data.materials.get(chosen.material)
    if material is None:
        raise HeadlessError(f"{chosen.file} has no material {chosen.material!r}: choose one of the file.")
    fitted.material.user_remap(material)
    try:
        setup = PictureSetup(chosen.out, **json.loads(chosen.picture))
        with shown(bpy.context, setup, fitted.object, own_size=False):
            return _render(bpy, chosen)
    except (ValueError, TypeError) as error:
        raise HeadlessError(f"--picture is no JSON object with the fields of a PictureSetup ({error}).") from error
    except ExportError as error:
        raise HeadlessError(str(error)) from error


def _render(bpy: Any, chosen: argparse.Namespace) -> dict[str, Any]:
    from .versions import can_denoise

    scene = bpy.context.scene
    if scene.camera is None:
        raise HeadlessError(f"The scene of {chosen.file} has no camera: add one.")
    if chosen.engine == "cycles":
        scene.render.engine = "CYCLES"
    if chosen.samples:
        scene.cycles.samples, scene.cycles.seed = chosen.samples, chosen.seed
        scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    elif not can_denoise():
        scene.cycles.use_denoising = False
    scene.render.use_compositing = scene.render.use_sequencer = False
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5.0
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    settings.color_management = "OVERRIDE"
    with contextlib.suppress(TypeError):  # a configuration of the user's own that has it not
        settings.linear_colorspace_settings.name = "Linear Rec.709"
    # not the given name itself, in which Blender would replace # by the frame and {} by a variable
    rendered = Path(bpy.app.tempdir) / "render.exr"
    scene.render.filepath = str(rendered)
    scene.render.use_file_extension = False
    bpy.ops.render.render(write_still=True, scene=scene.name)
    try:
        shutil.move(rendered, chosen.out.absolute())
    except OSError as error:
        raise HeadlessError(
            f"{chosen.out} cannot be written ({error.strerror or error}): choose another folder or free some space."
        ) from error
    return {"picture": str(chosen.out)}


def demo_scene(chosen: argparse.Namespace) -> dict[str, Any]:
    """Build the scene of `mfo demo` in a folder; returns the object's name and the socket values of both materials."""
    from .demo_scene import OBJECT, build_demo_scene

    materials = build_demo_scene(chosen.file.absolute(), chosen.scene_seed, chosen.size)
    return {"object": OBJECT, **materials}


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="headless", description="Blender's part of `mfo blend`.")
    commands = parser.add_subparsers(dest="command", required=True, parser_class=_Parser)

    def add(name: str, run: Any) -> argparse.ArgumentParser:
        command = commands.add_parser(name)
        command.add_argument("file", type=Path, help="the .blend file")
        command.set_defaults(run=run)
        return command

    command = add("export", export)
    target = command.add_mutually_exclusive_group(required=True)
    target.add_argument("--object", help="whose active material is fitted")
    target.add_argument("--target", action="append", help="object, and slot (from 1) or material, as JSON; for each")
    reference = command.add_mutually_exclusive_group(required=True)
    reference.add_argument("--reference", type=Path)
    reference.add_argument("--picture", action="append", help="fields of a PictureSetup as JSON; once for each picture")
    command.add_argument("--job", required=True, type=Path)
    command.add_argument("--fit", default="{}", help="the `fit` object of request.json")
    command.add_argument("--reference-view", default="scene", help="scene or standard: how a display picture was made")
    command.add_argument("--upright", action="store_true", help="turn the picture as its EXIF data say")
    command.add_argument("--shader", default="", help="of a mix of shaders the one to fit")
    command.add_argument("--will-apply", action="store_true", help="refuse a material that cannot be changed")
    command.add_argument("--make-local", action="store_true", help="its object will be made local by apply")
    command = add("apply", apply)
    command.add_argument("--job", required=True, type=Path)
    command.add_argument("--animated", default="leave", help="leave or replace: sockets with keyframes or a driver")
    command.add_argument("--make-local", action="store_true", help="make object, mesh and material parts of the file")
    command.add_argument("--save-as", required=True, type=Path)
    command.add_argument("--material", default="")
    command.add_argument("--force", action="store_true", help="also a result that does not match its reference")
    for name, run in (("render", render), ("check", check)):
        command = add(name, run)
        command.add_argument("--out", required=True, type=Path)
        command.add_argument("--samples", type=int, default=64, help="0: the scene's own")
        command.add_argument("--seed", type=int, default=0)
        command.add_argument("--engine", default="cycles", choices=("cycles", "scene"), help="scene: the file's own")
        command.add_argument("--parent", type=int, default=0, help="end when this process is not the parent any more")
        command.add_argument("--material", default="")
        if name == "render":
            command.add_argument("--target", action="append", help="whose material --material replaces, as for export")
            command.add_argument("--picture", default="{}", help="with --target: fields of a PictureSetup as JSON")
            command.set_defaults(object=None)
    command.add_argument("--job", required=True, type=Path)
    command.set_defaults(animated="replace", make_local=True)  # of a copy that is thrown away
    command = add("demo-scene", demo_scene)
    command.add_argument("--scene-seed", type=int, default=0)
    command.add_argument("--size", type=int, default=256)
    return parser


def _open(path: Path) -> Any:
    """Open a .blend file without running its scripts; returns the module bpy."""
    import bpy

    from . import properties

    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist"
        raise HeadlessError(f"{path} {what}: give a .blend file.")
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.absolute()), load_ui=False, use_scripts=False)
    except RuntimeError as error:
        raise HeadlessError(f"{path} cannot be opened ({str(error).strip()}): give a .blend file.") from error
    if not hasattr(bpy.types.Material, "mfo"):  # the originals of an apply are kept in it
        for cls in properties.CLASSES:
            bpy.utils.register_class(cls)
        properties.attach()
    return bpy


def _save(path: Path) -> None:
    from .process.saved_file import save_over

    try:
        save_over(path.absolute())
    except OSError as error:
        raise HeadlessError(f"{path} cannot be written ({error.strerror or error}): choose another place.") from error


def arguments() -> list[str]:
    """Those after `--` of a Blender command line, else all."""
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]


def _watch_parent(pid: int) -> None:
    """End this process when the one that started it is gone; a render cannot be asked to."""

    def watch() -> None:
        while os.getppid() == pid:
            time.sleep(1.0)
        os._exit(1)

    if pid and os.name != "nt":  # Windows keeps the id of a parent that is gone
        threading.Thread(target=watch, daemon=True).start()


def _leave(code: int) -> NoReturn:
    """End the process of the bpy module at once: after a render the destructors of bpy 4.5 wait for ever."""
    import bpy

    sys.stdout.flush()
    sys.stderr.flush()
    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)  # what Blender's own end would remove
    os._exit(code)


if __name__ == "__main__":
    _leave(main(arguments()))
