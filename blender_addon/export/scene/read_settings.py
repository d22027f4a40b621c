# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of the render: limits of bounces and what else changes light, with what the fit cannot follow exactly."""

from __future__ import annotations

from typing import Any

import bpy

from ...versions import counts_passages_exactly, cycles_settings, gives_below_zero, working_space_to_rec709
from ..audit.rules import name_settings
from ..audit.scene_table import BY_SIMPLIFY, LAYER_COLLECTION, RENDER, SCENE_CYCLES, VIEW_LAYER
from ..camera.read_camera import read_pixel_filter
from ..findings import Findings
from ..images.image_alpha import is_read_by_cycles, reads_alpha_otherwise
from ..images.texture_cache import uses_texture_cache
from ..meshes.read_mesh import MESH_TYPES
from ..render_state import layer_collections
from .scene_data import RenderSettings

DEFAULT_SPP = 64
BOUNCES = ("diffuse", "glossy", "transmission")
# of a ball, a box and a floor with a limit of 0 one block was 8 % too dark, the picture 1 %; with 1 the picture was
# 0.06 % too dark, and with 2 or 4 nothing was above the noise. With no diffuse bounce a metal's picture was 0.4 % too
# bright, one block 2 %
FEW_BOUNCES = 2
MANY_PASSAGES = 8  # Blender's default; one to three panes under lower limits were 2 to 18 % off in 4.5.15


def read_settings(scene: bpy.types.Scene, findings: Findings) -> RenderSettings:
    """What the picture of `scene` needs beside what is in it; Cycles' defaults where Cycles is off."""
    cycles = cycles_settings(scene)
    pixel_filter = read_pixel_filter(scene)
    if scene.render.engine not in ("CYCLES", "BLENDER_EEVEE", "BLENDER_EEVEE_NEXT"):
        findings.note(f"The render engine is {scene.render.engine}; the scene is exported as Cycles would see it.")
    if cycles is None:
        findings.note("Cycles is switched off in the preferences; its default settings are used.")
        return RenderSettings(pixel_filter, 14, scene.render.film_transparent, 1.0, DEFAULT_SPP)
    if cycles.sample_clamp_direct > 0.0:
        findings.note(
            "Cycles clamps direct light, so highlights and mirrored lights are darker than in the fit: set Light "
            "Paths > Clamping > Direct Light to 0 and render the reference again."
        )
    light_paths = _read_light_paths(cycles, findings)
    # N bounces in Cycles are N + 1 scattering events, which Mitsuba counts as N + 2 segments
    depth = 2 + min(cycles.max_bounces, max(light_paths[f"{kind}_bounces"] for kind in BOUNCES))
    exposure = cycles.film_exposure
    film = scene.render.film_transparent
    others = cycles.use_light_tree, cycles.shading_system or gives_below_zero()  # Open Shading Language does
    return RenderSettings(pixel_filter, depth, film, exposure, DEFAULT_SPP, light_paths, *others)


def name_render_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, findings: Findings) -> None:
    """Report what the settings of a scene and its layers do to a picture and the fit does not."""
    idle = () if scene.render.use_simplify else BY_SIMPLIFY
    name_settings(SCENE_CYCLES, cycles_settings(scene), scene.name, findings, idle)
    name_settings(RENDER, scene.render, scene.name, findings)
    name_settings(VIEW_LAYER, view_layer, view_layer.name, findings)
    for layer in layer_collections(view_layer):
        idle = () if _shows_faces(layer.collection) else ("holdout",)  # Cycles cuts out no lamp
        name_settings(LAYER_COLLECTION, layer, layer.name, findings, idle)
    strips = getattr(scene.sequence_editor, "strips", None) or getattr(scene.sequence_editor, "sequences", ())
    if scene.render.use_sequencer and len(strips):
        findings.note("The render shows the strips of the Video Sequencer; the fit shows the scene.")
    if working_space_to_rec709() is not None:
        findings.note(
            f"The working space of this file is {bpy.data.colorspace.working_space}. The fit counts in linear Rec.709, "
            "where coloured light on coloured surfaces is another: values of what such light shows may be off."
        )
    if uses_texture_cache(scene.render, (image for image in bpy.data.images if image.users)):
        findings.note(
            "Cycles reads pictures through its texture cache, which averages them where they are small; the fit does "
            "not. Turn Texture Cache off in Render Properties > Performance, and render the reference anew."
        )
    cycles = cycles_settings(scene)
    if cycles is not None and cycles.shading_system:
        _note_files([image for image in bpy.data.images if image.users], findings)


def _note_files(images: list[bpy.types.Image], findings: Findings) -> None:
    """Name a file that Open Shading Language reads by itself, and what it makes of it.

    Holes by a JPEG's threshold, seen from the side, were gone: a block of 8 x 8 pixels was 6 % of the picture's mean
    off. Packed into the .blend they are those without that language, to 1e-7.
    """
    read = next((image.name for image in images if reads_alpha_otherwise(image)), None)
    if read is not None:
        findings.note(
            f"Open Shading Language multiplies the colours of '{read}' by its alpha, and filters them in another way "
            "than the fit. Turn Open Shading Language off, and render the reference anew."
        )
        return
    small = next((image.name for image in images if is_read_by_cycles(image)), None)
    if small is not None:
        findings.note(
            f"Open Shading Language averages the pixels of '{small}' where they are small; the fit does not. Pack the "
            "picture (File > External Data), or turn Open Shading Language off, and render the reference anew."
        )


def _shows_faces(collection: bpy.types.Collection) -> bool:
    shown = (item for item in collection.all_objects if not item.hide_render)
    return any(item.type in MESH_TYPES or item.instance_type != "NONE" for item in shown)


def _read_light_paths(cycles: bpy.types.PropertyGroup, findings: Findings) -> dict[str, Any]:
    """The settings that change indirect light in Cycles alone; Blender's defaults have all of them."""
    if not (cycles.caustics_reflective and cycles.caustics_refractive):
        findings.note("Cycles removes caustics; the fit does not.")
    for kind in ("glossy", "diffuse"):
        limit = getattr(cycles, f"{kind}_bounces")
        if limit < min(FEW_BOUNCES, cycles.max_bounces):
            findings.note(
                f"The limit of {kind} bounces is {limit}: what counts as one follows from Cycles' choice among the "
                "lobes of a material, which the fit does not have exactly. Light over glossy surfaces may be several "
                f"percent off; set {FEW_BOUNCES} or more in Render Properties > Light Paths, and render the reference "
                "anew."
            )
    if 0 < cycles.transparent_max_bounces < MANY_PASSAGES and not counts_passages_exactly():
        findings.note(
            f"The limit of transparent bounces is {cycles.transparent_max_bounces}: where light meets as many clear "
            "surfaces, this Blender lets it through one more than the fit. Set 8 or more in Render Properties > "
            "Light Paths, and render the reference anew."
        )
    return {
        "filter_glossy": cycles.blur_glossy,
        "clamp_indirect": cycles.sample_clamp_indirect * cycles.film_exposure,
        **{f"{kind}_bounces": getattr(cycles, f"{kind}_bounces") for kind in BOUNCES},
        "transparent_bounces": cycles.transparent_max_bounces,
        "min_light_bounces": cycles.min_light_bounces,
        "min_transparent_bounces": cycles.min_transparent_bounces,
    }
