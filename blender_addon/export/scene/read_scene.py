# SPDX-License-Identifier: GPL-3.0-or-later
"""From bpy to `SceneData`: the target object, everything else the render shows, lights, world, camera."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...bake.dependence import deformed_generated
from ...versions import (
    cycles_settings,
    divides_adaptively,
    has_compositor,
    node_tree_of,
    overrides_of,
    shadow_terminator,
)
from ..audit.object_table import OBJECT_CYCLES
from ..audit.rules import name_settings
from ..audit.scene_table import BY_SIMPLIFY, LAYER_COLLECTION, RENDER, SCENE_CYCLES, VIEW_LAYER
from ..camera.bent_normals import share_of_bent_normals
from ..camera.read_camera import read_camera, read_pixel_filter
from ..files.ply_file import TriangleMesh
from ..findings import Findings, Fix
from ..lights.read_light import read_light
from ..material_model import Material, grey
from ..materials.read_material import needs_bake, note_volume, read_context, read_target
from ..meshes.coincident import shared_faces
from ..meshes.mesh_arrays import CornerMesh, joined, world_mesh
from ..meshes.read_mesh import material_of_slot, read_mesh, slot_count
from ..render_state import instanced_objects, layer_collections, render_state, rendered_layer, rendered_objects
from .read_world import BLACK, read_world
from .scene_bakes import SceneBakes, Surface
from .scene_data import TARGET_BSDF, TARGET_SHAPE, RenderSettings, SceneData, Shape, Terminator
from .visibility import check_visible

MESH_TYPES = ("MESH", "CURVE", "SURFACE", "FONT", "META")
SILENT_TYPES = ("EMPTY", "ARMATURE", "LATTICE", "CAMERA", "SPEAKER", "LIGHT_PROBE")
DEFAULT_SPP = 64
# of the target's area; 0.09 on a ball of 12 segments, whose diffuse light is 0.6 % off, 0.02 on one of 24
MOST_BENT = 0.05
BOUNCES = ("diffuse", "glossy", "transmission")
# of a ball, a box and a floor with a limit of 0 one block was 8 % too dark, the picture 1 %; with 1 the picture was
# 0.06 % too dark, and with 2 or 4 nothing was above the noise
FEW_GLOSSY_BOUNCES = 2


def read_scene(
    context: bpy.types.Context,
    target: bpy.types.Object,
    findings: Findings,
    bakes: SceneBakes | None = None,
    leaf: str | None = None,
) -> SceneData | None:
    """Return the scene as the render would see it, or None with errors in `findings`.

    What only Cycles can tell is asked of `bakes`; `finish_scene` puts it in. `leaf` names the shader of the target's
    mix that is fitted.
    """
    layer = rendered_layer(context.scene, context.view_layer)
    if layer != context.view_layer:
        findings.note(f"View layer '{context.view_layer.name}' is not rendered; '{layer.name}' is exported.")
        with context.temp_override(view_layer=layer):
            return read_scene(bpy.context, target, findings, bakes, leaf)
    scene, view_layer = context.scene, context.view_layer
    others = [each.name for each in scene.view_layers if each.use and each != view_layer]
    if others and view_layer.use:
        findings.note(f"View layer '{view_layer.name}' is exported; also rendered are: {', '.join(others)}.")
    if target is None or target.type not in MESH_TYPES:
        what = "nothing" if target is None else f"'{target.name}' ({target.type.title()})"
        findings.error(f"The object to fit is {what}: select an object with faces.")
        return None
    if overrides_of(view_layer):
        findings.error(
            f"View layer '{view_layer.name}' replaces materials or the world by '{overrides_of(view_layer)[0]}': "
            "remove the override.",
            Fix("no_override"),
        )
        return None
    if has_compositor(scene):
        findings.note("Compositing nodes are left out: a reference that went through them holds more than the render.")
    with render_state(view_layer, scene):
        depsgraph = context.evaluated_depsgraph_get()
        camera = read_camera(scene, depsgraph, findings)
        settings = _read_settings(scene, findings)
        slot = target.active_material_index
        slots = target.material_slots
        material = read_target(slots[slot].material if slot < len(slots) else None, target.name, slot, findings, leaf)
        if camera is None or material is None:
            return None
        _name_settings(scene, view_layer, findings)
        world = read_world(scene, settings.exposure, findings, bakes) if view_layer.use_sky else BLACK
        data = SceneData(camera, settings, world)
        walk = _Walk(data, target, slot, material, depsgraph, rendered_objects(view_layer), findings, bakes)
        walk.run()
        if data.target is None:
            if target.name_full not in rendered_objects(view_layer) | instanced_objects(view_layer):
                findings.error(f"Object '{target.name}' is hidden in the render: show it.", Fix("show_in_render"))
            elif walk.target_left_out:
                findings.error(
                    f"All faces of '{target.name}' with its active material have corners at NaN, infinite or absurdly "
                    "far positions (1e18 m): move or scale the object, or mend its mesh."
                )
            else:
                findings.error(f"No face of '{target.name}' uses its active material slot {slot + 1}: choose another.")
            return None
        walk.note_coincident_faces()
        share = share_of_bent_normals(data.target.mesh, camera)
        if share > MOST_BENT:
            findings.note(
                f"Object '{target.name}' is smooth over few faces, or has custom normals: on {100 * share:.0f} % of it "
                "normals turn away from the camera. There Cycles bends them for reflections alone, the fit for all "
                "light."
            )
        check_visible(data, target, scene, depsgraph, findings)
    return data


def finish_scene(data: SceneData, findings: Findings, bakes: SceneBakes | None = None) -> None:
    """Put what `bakes` was asked for into the scene, and look whether there is light."""
    if bakes is not None:
        bakes.finish(data, findings)
    if not data.world.is_lit and not data.lights and not data.emitting:
        findings.error("The scene has no light: add a light or give the world a colour.")


def _name_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, findings: Findings) -> None:
    """Report what the scene's settings do to a picture and the fit does not."""
    idle = () if scene.render.use_simplify else BY_SIMPLIFY
    name_settings(SCENE_CYCLES, cycles_settings(scene), scene.name, findings, idle)
    name_settings(RENDER, scene.render, scene.name, findings)
    name_settings(VIEW_LAYER, view_layer, view_layer.name, findings)
    for collection in layer_collections(view_layer):
        name_settings(LAYER_COLLECTION, collection, collection.name, findings)
    strips = getattr(scene.sequence_editor, "strips", None) or getattr(scene.sequence_editor, "sequences", ())
    if scene.render.use_sequencer and len(strips):
        findings.note("The render shows the strips of the Video Sequencer; the fit shows the scene.")


def _read_settings(scene: bpy.types.Scene, findings: Findings) -> RenderSettings:
    cycles = cycles_settings(scene)
    pixel_filter = read_pixel_filter(scene)
    if scene.render.engine not in ("CYCLES", "BLENDER_EEVEE", "BLENDER_EEVEE_NEXT"):
        findings.note(f"The render engine is {scene.render.engine}; the scene is exported as Cycles would see it.")
    if cycles is None:
        findings.note("Cycles is switched off in the preferences; its default settings are used.")
        return RenderSettings(pixel_filter, 14, scene.render.film_transparent, 1.0, DEFAULT_SPP)
    if cycles.sample_clamp_direct > 0.0:
        findings.note("Cycles clamps direct light; the fit does not.")
    light_paths = _read_light_paths(cycles, findings)
    # N bounces in Cycles are N + 1 scattering events, which Mitsuba counts as N + 2 segments
    depth = 2 + min(cycles.max_bounces, max(light_paths[f"{kind}_bounces"] for kind in BOUNCES))
    exposure = cycles.film_exposure
    return RenderSettings(pixel_filter, depth, scene.render.film_transparent, exposure, DEFAULT_SPP, light_paths)


def _read_light_paths(cycles: bpy.types.PropertyGroup, findings: Findings) -> dict[str, Any]:
    """The settings that change indirect light in Cycles alone; Blender's defaults have all of them."""
    if cycles.sample_clamp_indirect > 0.0:
        findings.note(
            f"Clamping of indirect light ({cycles.sample_clamp_indirect:.3g}) works on single samples, and those of "
            "the fit are not Cycles': how much light it takes away may differ.",
            explains=False,  # Blender's default
        )
    if not (cycles.caustics_reflective and cycles.caustics_refractive):
        findings.note("Cycles removes caustics; the fit does not.")
    if cycles.glossy_bounces < min(FEW_GLOSSY_BOUNCES, cycles.max_bounces):
        findings.note(
            f"The limit of glossy bounces is {cycles.glossy_bounces}: what counts as one follows from Cycles' choice "
            "among the lobes of a material, which the fit does not have exactly. Light over glossy surfaces may be "
            f"several percent off; set {FEW_GLOSSY_BOUNCES} or more in Render Properties > Light Paths, and render the "
            "reference anew."
        )
    return {
        "filter_glossy": cycles.blur_glossy,
        "clamp_indirect": cycles.sample_clamp_indirect * cycles.film_exposure,
        **{f"{kind}_bounces": getattr(cycles, f"{kind}_bounces") for kind in BOUNCES},
    }


class _Walk:
    """One pass over everything the depsgraph shows."""

    def __init__(
        self,
        data: SceneData,
        target: bpy.types.Object,
        slot: int,
        material: Material,
        depsgraph: bpy.types.Depsgraph,
        rendered: set[str],
        findings: Findings,
        bakes: SceneBakes | None,
    ) -> None:
        self.bakes, self.baked = bakes, set[str]()  # BSDFs that are to be baked for each object
        self.data, self.target, self.slot = data, target, slot
        self.depsgraph, self.rendered, self.findings = depsgraph, rendered, findings
        self.meshes: dict[tuple[str, int], CornerMesh | None] = {}
        self.target_pieces: list[tuple[TriangleMesh, bool]] = []
        self.target_left_out = 0  # triangles
        self.places: list[tuple[str, TriangleMesh]] = []
        data.materials[TARGET_BSDF] = material
        self.bsdfs: dict[str, str] = {target.material_slots[slot].material.name_full: TARGET_BSDF}

    def run(self) -> None:
        for instance in self.depsgraph.object_instances:
            item = instance.object
            if not self._is_rendered(instance, item):
                continue
            matrix = np.array(instance.matrix_world, dtype=np.float64)
            if item.type == "LIGHT":
                light = read_light(item, matrix, self.data.settings.exposure, self.findings)
                if light is not None:
                    self.data.lights.append(light)
            elif item.type == "MESH":
                # the faces of curves, texts and geometry nodes come as instances whose parent is the object itself
                own = not instance.is_instance or instance.parent == item.original.evaluated_get(self.depsgraph)
                # an object that only collection instances show is fitted in all of them
                own |= item.original.name_full not in self.rendered
                self._add_mesh(instance, matrix, own and item.original == self.target)
            elif item.type not in (*MESH_TYPES, *SILENT_TYPES):
                self.findings.note(f"Object '{item.name}' is a {item.type.title()}, which is not exported.")
        if self.target_pieces:
            meshes, closed = zip(*self.target_pieces, strict=True)
            self.data.shapes.insert(
                0,
                Shape(
                    TARGET_SHAPE, joined(meshes), TARGET_BSDF, all(closed), Terminator(*shadow_terminator(self.target))
                ),
            )

    def _is_rendered(self, instance: bpy.types.DepsgraphObjectInstance, item: bpy.types.Object) -> bool:
        if instance.is_instance:
            parent = instance.parent
            return parent is not None and parent.original.name_full in self.rendered and not item.hide_render
        if item.original.name_full not in self.rendered:
            return False
        return not item.is_instancer or item.show_instancer_for_render

    def _add_mesh(
        self, instance: bpy.types.DepsgraphObjectInstance, matrix: NDArray[np.float64], is_target: bool
    ) -> None:
        item = instance.object
        key = (item.name_full, item.data.as_pointer())
        if key not in self.meshes:
            self.meshes[key] = read_mesh(item, self.depsgraph)
        mesh = self.meshes[key]
        if mesh is None:
            return
        self._note_visibility(item)
        last = max(slot_count(item) - 1, 0)
        slots = np.clip(mesh.slots, 0, last)
        bsdfs = {int(slot): self._bsdf(item, int(slot)) for slot in np.unique(slots)}
        fitted = {slot for slot, bsdf in bsdfs.items() if bsdf == TARGET_BSDF} if is_target else set()
        if self.slot in fitted:  # the same material in another slot is not what was chosen
            fitted = {self.slot}
        for slot, bsdf in bsdfs.items():
            piece = world_mesh(mesh, slots == slot, matrix)
            left_out = int((slots == slot).sum()) - len(piece.triangles)
            if left_out:
                self.findings.note(
                    f"Object '{item.name}' has {left_out} triangles with corners at NaN, infinite or absurdly far "
                    "positions; they are left out."
                )
            if slot in fitted:
                self.target_left_out += left_out
            if not len(piece.triangles):
                continue
            self.places.append((item.name, piece))
            if slot in fitted:
                self.target_pieces.append((piece, mesh.is_closed))
                continue
            name = f"shape_{len(self.data.shapes) + 1:04d}"
            shape = Shape(name, piece, bsdf, mesh.is_closed, Terminator(*shadow_terminator(item)))
            if bsdf in self.baked:
                self._note_generated(item, slot)
            if self.bakes is not None and bsdf in self.baked:
                surface = Surface(instance, slot, mesh, slots == slot, matrix)
                shape = self.bakes.ask_surface(self.data, shape, surface, self.findings)
            self.data.shapes.append(shape)

    def _note_generated(self, item: bpy.types.Object, slot: int) -> None:
        material = material_of_slot(item, slot)
        tree = None if material is None else node_tree_of(material.original)
        deforming = [] if tree is None else deformed_generated(item.original, tree)
        if material is not None and deforming:
            self.findings.note(
                f"Material '{material.name}' of '{item.name}': the bake takes Generated coordinates after the mesh is "
                f"deformed ({', '.join(deforming)}), Cycles before."
            )

    def note_coincident_faces(self) -> None:
        """Report objects whose faces lie in the same place."""
        for first, second in shared_faces(self.places):
            self.findings.note(
                f"'{first}' and '{second}' have faces in the same place: which of them is seen is left to chance, in "
                "Cycles and in the fit."
            )

    def _bsdf(self, item: bpy.types.Object, slot: int) -> str:
        material = material_of_slot(item, slot)
        key = "" if material is None else material.original.name_full
        if key not in self.bsdfs:
            self.bsdfs[key] = f"material_{len(self.bsdfs):04d}"
            original = None if material is None else material.original
            if needs_bake(original):
                assert original is not None
                self.findings.note(f"Material '{original.name}' of '{item.name}' is baked into textures by Cycles.")
                note_volume(original, self.findings)
                self.baked.add(self.bsdfs[key])
                if self.bakes is None:
                    self.data.materials[self.bsdfs[key]] = grey(original.name)
                return self.bsdfs[key]
            self.data.materials[self.bsdfs[key]] = read_context(original, item.name, self.findings)
        return self.bsdfs[key]

    def _note_visibility(self, item: bpy.types.Object) -> None:
        name_settings(OBJECT_CYCLES, cycles_settings(item), item.name, self.findings)
        if any(divides_adaptively(modifier, item) for modifier in item.modifiers):
            self.findings.note(
                f"Adaptive Subdivision of '{item.name}' is left out: its mesh has the modifier's level for renders."
            )
        for system in item.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                self.findings.note(f"The hair '{system.name}' of '{item.name}' is left out.")
        off = [
            label
            for name, label in (
                ("visible_camera", "camera"),
                ("visible_diffuse", "diffuse"),
                ("visible_glossy", "glossy"),
                ("visible_transmission", "transmission"),
                ("visible_shadow", "shadow"),
            )
            if not getattr(item, name)
        ]
        if off:
            self.findings.note(f"Object '{item.name}' is hidden from {', '.join(off)} rays; in the fit it is not.")
        if item.is_holdout or item.is_shadow_catcher:
            self.findings.note(f"Object '{item.name}' is a holdout or shadow catcher; in the fit it is an object.")
