# SPDX-License-Identifier: GPL-3.0-or-later
"""From bpy to `SceneData`: the target object, everything else the render shows, lights, world, camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...versions import (
    has_compositor,
    node_tree_of,
    overrides_of,
    shadow_terminator,
)
from ..camera.read_camera import read_camera
from ..camera.render_region import Size
from ..files.ply_file import TriangleMesh
from ..findings import Findings, Fix
from ..fitted_slot import FittedSlot
from ..lights.light_model import takes_light
from ..lights.read_light import linked_light, note_linking, read_light
from ..material_model import Material, grey
from ..materials.baked_material import refuse_dark
from ..materials.read_context import needs_bake, read_context
from ..materials.read_material import name_material_settings, read_target, with_circling_tangents
from ..materials.unfinite_pixels import refuse_unfinite_pixels
from ..meshes.circled_axes import CircledAxes
from ..meshes.face_notes import APART, MANY, note_coincident_faces, note_coplanar_faces
from ..meshes.known_meshes import KnownMeshes
from ..meshes.mesh_arrays import CornerMesh, Piece, joined
from ..meshes.read_mesh import MESH_TYPES, material_of_slot, read_mesh, slot_count
from ..nodes.circling import circled_axis, keeps_place
from ..nodes.dependence import deformed_generated
from ..nodes.displacement import moves_faces
from ..render_state import (
    background_objects,
    geometry_of,
    hides_original,
    note_viewport,
    render_state,
    rendered_layer,
    rendered_objects,
    shown_by,
    without_modifiers,
)
from ..steps import Steps
from .origin import moved, note_far_scattering, note_wide_scattering, scene_origin
from .ray_visibility import (
    camera_misses,
    hidden_from,
    hide_from_rays,
    is_cut,
    note_hidden,
    note_visibility,
    shadow_transmission,
)
from .read_settings import name_render_settings, read_settings
from .read_world import BLACK, read_world
from .scene_bakes import SceneBakes, Surface
from .scene_data import Hidden, SceneData, Shape, Terminator, target_bsdf, target_shape
from .visibility import look_at_targets, met_points, say_no_faces

SILENT_TYPES = ("EMPTY", "ARMATURE", "LATTICE", "CAMERA", "SPEAKER", "LIGHT_PROBE")
_NO_POINTS = np.zeros((0, 3), np.float32)
NOT_PLACED = TriangleMesh(_NO_POINTS, _NO_POINTS, np.zeros((0, 2), np.float32), np.zeros((0, 3), np.int32))


def read_scene(
    context: bpy.types.Context,
    target: bpy.types.Object,
    findings: Findings,
    bakes: SceneBakes | None = None,
    leaf: str | None = None,
    targets: Sequence[FittedSlot] = (),
    *,
    may_miss: bool = False,
    picture: Size | None = None,
    known: KnownMeshes | None = None,
) -> Steps[SceneData | None]:
    """Return the scene as the render would see it, or None with errors in `findings`.

    What only Cycles can tell is asked of `bakes`; `finish_scene` puts it in. `leaf` names the shader of the target's
    mix that is fitted, and `targets` are the slots whose materials are fitted together, where these are several. With
    `may_miss` the camera need not see all of these: other pictures may. `picture` is the reference's size, which says
    whether it shows the Render Region alone. All but the computing with many triangles is one step; `known` spares that
    where an earlier reading had the same.
    """
    found = known or KnownMeshes()
    walk = _read(context, target, findings, bakes, leaf, targets, found, may_miss=may_miss, picture=picture)
    if walk is None:
        return None
    yield from walk.place()
    yield from walk.note_faces()
    return walk.data


def _read(
    context: bpy.types.Context,
    target: bpy.types.Object,
    findings: Findings,
    bakes: SceneBakes | None,
    leaf: str | None,
    targets: Sequence[FittedSlot],
    known: KnownMeshes,
    *,
    may_miss: bool,
    picture: Size | None,
) -> _Walk | None:
    """Everything that `read_scene` takes out of Blender; the meshes are not placed yet."""
    layer = rendered_layer(context.scene, context.view_layer)
    if layer != context.view_layer:
        findings.note(f"View layer '{context.view_layer.name}' is not rendered; '{layer.name}' is exported.")
        with context.temp_override(view_layer=layer):
            here = bpy.context
            return _read(here, target, findings, bakes, leaf, targets, known, may_miss=may_miss, picture=picture)
    scene, view_layer = context.scene, context.view_layer
    others = [each.name for each in scene.view_layers if each.use and each != view_layer]
    if others and view_layer.use:
        findings.note(f"View layer '{view_layer.name}' is exported; also rendered are: {', '.join(others)}.")
    for each in [slot.object for slot in targets] or [target]:
        if each is None or each.type not in MESH_TYPES:
            what = "nothing" if each is None else f"'{each.name}' ({each.type.title()})"
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
        camera = read_camera(scene, depsgraph, findings, picture)
        settings = read_settings(scene, findings)
        fitted = targets or [FittedSlot(target, target.active_material_index, leaf)]
        materials = []
        for each in fitted:
            of_one = Findings(findings.of_mitsuba) if targets else findings
            found = read_target(each.material, each.object.name, each.slot, of_one, each.leaf)
            axis = circled_axis(each.material)
            if found is not None and axis and keeps_place(each.object):
                found = with_circling_tangents(found, axis)
            materials.append(found)
            if targets:
                findings.take_over(of_one, (each.object.name, each.slot))
        described = [material for material in materials if material is not None]
        if camera is None or len(described) < len(materials):
            return None
        name_render_settings(scene, view_layer, findings)
        world = read_world(scene, settings.exposure, findings, bakes) if view_layer.use_sky else BLACK
        origin = scene_origin(scene.camera, [each.object for each in fitted], depsgraph)
        data = SceneData(replace(camera, world=moved(camera.world, origin)), settings, world, origin=origin)
        rendered = rendered_objects(view_layer) | background_objects(scene)
        walk = _Walk(data, fitted, described, depsgraph, rendered, findings, bakes, known)
        walk.run()
        note_viewport(depsgraph, findings)
        owners = [each for each in bpy.data.materials if each.name_full in walk.bsdfs]
        owners += [scene.world] if view_layer.use_sky and scene.world is not None else []
        refuse_unfinite_pixels(filter(None, map(node_tree_of, owners)), findings)
        pieces = [walk.pieces_of(target_shape(number)) for number in range(len(fitted))]
        for number, each in enumerate(fitted):
            if not pieces[number]:
                of_one = Findings()
                say_no_faces(each, view_layer, walk.targets_left_out[number], of_one)
                findings.take_over(of_one, (each.object.name, each.slot))
        if not all(pieces):
            return None
        seen = look_at_targets(data, fitted, pieces, scene, depsgraph, findings, may_miss=may_miss)
        for name, points in (*seen, *met_points(data, scene, depsgraph).items()):
            walk.seen[name] = np.concatenate([walk.seen.get(name, points[:0]), points])
    return walk


def finish_scene(data: SceneData, findings: Findings, bakes: SceneBakes | None = None) -> None:
    """Put what `bakes` was asked for into the scene, and look whether there is light."""
    if bakes is not None:
        bakes.finish(data, findings)
    note_wide_scattering(data, findings)
    hide_from_rays(data, findings)
    for material in data.materials.values():
        below_zero = data.settings.gives_below_zero
        leaves = [leaf for leaf in (material, *material.leaves) if leaf.model == "emission" or below_zero]
        if any(takes_light(leaf.emission) for leaf in leaves):
            refuse_dark(material.name, findings)
    for shape in data.emitting:
        if shape.linked:
            note_linking(shape.linked, findings)
    if not data.world.is_lit and not data.lights and not data.emitting:
        findings.error("The scene has no light: add a light or give the world a colour.")


class _Walk:
    """One pass over everything the depsgraph shows."""

    def __init__(
        self,
        data: SceneData,
        targets: Sequence[FittedSlot],
        materials: Sequence[Material],
        depsgraph: bpy.types.Depsgraph,
        rendered: set[str],
        findings: Findings,
        bakes: SceneBakes | None,
        known: KnownMeshes,
    ) -> None:
        self.known = known
        self.bakes, self.baked = bakes, set[str]()  # BSDFs that are to be baked for each object
        self.data, self.targets = data, targets
        self.depsgraph, self.rendered, self.findings = depsgraph, rendered, findings
        self.bare = without_modifiers(depsgraph.view_layer)
        self.meshes: dict[tuple[str, int], CornerMesh | None] = {}
        self.pieces: list[tuple[str, str, Piece]] = []  # with names of object and shape
        self.targets_left_out = [0] * len(targets)  # triangles
        self.target_bodies = [0] * len(targets)
        self.target_shadows: list[list[float | None]] = [[] for _ in targets]  # `shadow_transmission` of the instances
        self.bodies = 0
        self.places: list[tuple[str, TriangleMesh]] = []
        self.seen: dict[str, NDArray[np.float64]] = {}  # points of what the camera sees
        data.target_count = len(targets)
        self.bsdfs: dict[str, str] = {}
        axes: dict[str, str] = {}
        for number, (each, material) in enumerate(zip(targets, materials, strict=True)):
            data.materials[target_bsdf(number)] = material
            assert each.material is not None  # it was read
            self.bsdfs[each.material.name_full] = target_bsdf(number)
            axes[each.material.name_full] = material.circling
        self.axes = CircledAxes(axes, findings)

    def run(self) -> None:
        """Read all that there is; the shapes of the scene have no triangles until they are placed."""
        self.known.begin()
        for instance in self.depsgraph.object_instances:
            item = instance.object
            if not self._is_rendered(instance, item):
                continue
            matrix = moved(np.array(instance.matrix_world, dtype=np.float64), self.data.origin)
            if item.type == "LIGHT":
                seen = not camera_misses(instance, self.depsgraph.view_layer)
                rays = {"camera": seen, "hidden_from": hidden_from(instance)}
                light = read_light(item, matrix, self.data.settings.exposure, self.findings, **rays)
                if light is not None:
                    if light.nodes is not None and self.bakes is not None:
                        self.bakes.lamps.ask(instance, len(self.data.lights), light)
                    self.data.lights.append(light)
            elif item.type == "MESH":
                # the faces of curves, texts and geometry nodes come as instances whose parent is the object itself
                own = shown_by(instance).original == item.original
                # an object that only collection instances show is fitted in all of them
                own |= item.original.name_full not in self.rendered
                self._add_mesh(instance, matrix, own)
            elif item.type not in (*MESH_TYPES, *SILENT_TYPES):
                self.findings.note(f"Object '{item.name}' is a {item.type.title()}, which is not exported.")
        for number, each in reversed(list(enumerate(self.targets))):  # the first one comes first
            names = target_shape(number), target_bsdf(number)
            if self.pieces_of(names[0]):
                terminator = Terminator(*shadow_terminator(each.object))
                shadows, body = self.target_shadows[number], self.target_bodies[number]
                if len(set(shadows)) > 1:
                    self.findings.note(
                        f"Some instances of '{each.object.name}' cast shadows and others do not; in the fit all are as "
                        "the first of them."
                    )
                made = Shape(names[0], NOT_PLACED, names[1], terminator, shadows[0], body=body)
                self.data.shapes.insert(0, replace(made, linked=linked_light(each.object)))

    def pieces_of(self, shape: str) -> list[Piece]:
        """What a shape of the scene consists of."""
        return [piece for _, name, piece in self.pieces if name == shape]

    def place(self) -> Steps[None]:
        """Move all triangles into the world."""
        meshes: dict[str, list[TriangleMesh]] = {}
        for owner, shape, piece in self.pieces:
            if len(piece) >= MANY:
                yield APART
            mesh = self.known.place(piece)
            self.places.append((owner, mesh))
            meshes.setdefault(shape, []).append(mesh)
        self.data.shapes[:] = [replace(shape, mesh=joined(meshes[shape.identifier])) for shape in self.data.shapes]

    def _is_rendered(self, instance: bpy.types.DepsgraphObjectInstance, item: bpy.types.Object) -> bool:
        if not instance.show_self:  # an instancer that is not shown, or an instance of one
            return False
        if instance.is_instance:
            parent = instance.parent
            return parent is not None and parent.original.name_full in self.rendered
        return item.original.name_full in self.rendered and not hides_original(item)

    def _fitted(self, item: bpy.types.Object, bsdfs: dict[int, str]) -> dict[int, int]:
        """The slots of an object that are fitted, with the numbers of their targets."""
        found: dict[int, int] = {}
        for number, each in enumerate(self.targets):
            if item.original != each.object:
                continue
            slots = [slot for slot, bsdf in bsdfs.items() if bsdf == target_bsdf(number)]
            # the same material in another slot is not what was chosen
            found |= dict.fromkeys([each.slot] if each.slot in slots else slots, number)
        return found

    def _add_mesh(self, instance: bpy.types.DepsgraphObjectInstance, matrix: NDArray[np.float64], own: bool) -> None:
        """Add an instance; the faces of its `own` object may be fitted."""
        item, source = instance.object, geometry_of(instance, self.bare)
        key = (item.name_full, source.data.as_pointer())
        if key not in self.meshes:
            mesh = read_mesh(source, self.depsgraph, self.axes.of(item))
            self.meshes[key] = mesh = None if mesh is None else self.known.mesh(item.name_full, mesh)
            displaces = any(moves_faces(material_of_slot(item, slot)) for slot in range(slot_count(item)))
            if mesh is not None and displaces and self.bakes is not None:
                self.bakes.displaced.ask(instance, mesh)
        mesh = self.meshes[key]
        if mesh is None:
            return
        hidden, rays = camera_misses(instance, self.depsgraph.view_layer), Hidden(item.name, hidden_from(instance))
        last = max(slot_count(item) - 1, 0)
        slots = np.clip(mesh.slots, 0, last)
        bsdfs = {int(slot): self._bsdf(item, int(slot)) for slot in np.unique(slots)}
        fitted = self._fitted(item, bsdfs) if own else {}
        note_visibility(instance, self.findings, is_fitted=bool(fitted))
        body = self._body(bsdfs)
        for slot, bsdf in bsdfs.items():
            piece = Piece(mesh, slots == slot, matrix)
            left_out = piece.left_out()
            if left_out:
                self.findings.note(
                    f"Object '{item.name}' has {left_out} triangles with corners at NaN, infinite or absurdly far "
                    "positions; they are left out."
                )
            if slot in fitted:
                self.targets_left_out[fitted[slot]] += left_out
            if left_out == len(piece):
                continue
            name = target_shape(fitted[slot]) if slot in fitted else f"shape_{len(self.data.shapes) + 1:04d}"
            self.pieces.append((item.name, name, piece))
            if self.bakes is not None:
                self.bakes.displaced.place(name, piece)
            if slot in fitted:
                self.target_bodies[fitted[slot]] = body
                self.target_shadows[fitted[slot]].append(shadow_transmission(instance, slot))
                if hidden:
                    self.findings.error(f"Object '{item.name}' is hidden from camera rays: let the camera see it.")
                note_hidden(rays, self.findings)
                continue
            terminator, shadow = Terminator(*shadow_terminator(item)), shadow_transmission(instance, slot)
            if bsdf in self.baked:
                self._note_generated(item, slot)
                if self.bakes is not None:
                    bsdf = self.bakes.ask_surface(self.data, name, Surface(instance, slot, piece), self.findings)
            linked, cut = linked_light(item), is_cut(instance)
            self.data.shapes.append(Shape(name, NOT_PLACED, bsdf, terminator, shadow, hidden, body, linked, rays, cut))

    def _body(self, bsdfs: dict[int, str]) -> int:
        """The number of an object of several shapes that light goes through below the surface, else 0."""
        known = (self.data.materials.get(bsdf) for bsdf in bsdfs.values())  # what is to be baked is not read yet
        scatters = (each is None or bool(each.scattering) for each in known)
        if len(bsdfs) < 2 or not any(scatters):
            return 0
        self.bodies += 1
        return self.bodies

    def _note_generated(self, item: bpy.types.Object, slot: int) -> None:
        material = material_of_slot(item, slot)
        tree = None if material is None else node_tree_of(material.original)
        deforming = [] if tree is None else deformed_generated(item.original, tree)
        if material is not None and deforming:
            self.findings.note(
                f"Material '{material.name}' of '{item.name}': the bake takes Generated coordinates after the mesh is "
                f"deformed ({', '.join(deforming)}), Cycles before."
            )

    def note_faces(self) -> Steps[None]:
        """Report faces that lie in the same place, and what is far away."""
        yield from note_coincident_faces(self.places, self.known, self.findings)
        yield from note_coplanar_faces(self.seen, self.places, self.data.camera, self.findings)
        shapes = [self.data.target_of(number) for number in range(len(self.targets))]
        there = [(each, shape) for each, shape in zip(self.targets, shapes, strict=True) if shape is not None]
        note_far_scattering(self.data, there, self.findings)

    def _bsdf(self, item: bpy.types.Object, slot: int) -> str:
        material = material_of_slot(item, slot)
        key = "" if material is None else material.original.name_full
        if key not in self.bsdfs:
            self.bsdfs[key] = f"material_{len(self.bsdfs):04d}"
            original = None if material is None else material.original
            if needs_bake(original):
                assert original is not None
                self.findings.note(f"Material '{original.name}' of '{item.name}' is baked into textures by Cycles.")
                name_material_settings(original, self.findings)
                self.baked.add(self.bsdfs[key])
                if self.bakes is None:
                    self.data.materials[self.bsdfs[key]] = grey(original.name)
                return self.bsdfs[key]
            self.data.materials[self.bsdfs[key]] = read_context(original, item.name, self.findings)
        return self.bsdfs[key]
