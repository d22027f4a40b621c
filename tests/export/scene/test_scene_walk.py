# SPDX-License-Identifier: Apache-2.0
"""What of a scene is exported: layers, instances, geometry nodes, muted nodes. Oracles: Cycles, and known scenes."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.job import ExportError, check_export

from ..scenes import add_camera, add_light, add_quad, diffuse_material, emission_material, new_material, world_color


def lit_quad(scene: Any) -> Any:
    item = add_quad("Target", 2.0, 0.0, new_material("Target"))
    add_light("POINT", (0, 0, 3), energy=100.0)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=3.0)
    bpy.context.view_layer.update()
    return item


def test_an_object_that_only_an_instance_shows_is_fitted(scene: Any, export: Any, render_cycles: Any,
                                                         render_mitsuba: Any) -> None:  # fmt: skip
    item = lit_quad(scene)
    prefab = bpy.data.collections.new("Prefab")
    prefab.objects.link(item)
    scene.collection.objects.unlink(item)
    scene.collection.children.link(prefab)
    bpy.context.view_layer.layer_collection.children["Prefab"].exclude = True
    for x in (-0.6, 0.6):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", prefab
        empty.location, empty.scale = (x, 0, 0), (0.5, 0.5, 0.5)
        scene.collection.objects.link(empty)
    bpy.context.view_layer.update()
    item.data.materials[0] = emission_material("Glow", (1.0, 0.5, 0.2))
    theirs = render_cycles()
    item.data.materials[0] = new_material("Target", Emission_Color=(1.0, 0.5, 0.2), Emission_Strength=1.0,
                                          Base_Color=(0, 0, 0), Specular_IOR_Level=0.0)  # fmt: skip
    assert render_mitsuba(export(item)).mean() == pytest.approx(theirs.mean(), rel=0.02)


def scatter(item: Any, material: Any = None, of: Any = None, *, joined: bool = True) -> None:
    """Put `of`, or a small cube of that material that the tree makes itself, on every vertex of `item`, or for it."""
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes, link = group.nodes, group.links.new
    start, end, join = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput"), nodes.new("GeometryNodeJoinGeometry")
    cube, painted = nodes.new("GeometryNodeMeshCube"), nodes.new("GeometryNodeSetMaterial")
    instances = nodes.new("GeometryNodeInstanceOnPoints")
    cube.inputs["Size"].default_value = (0.4, 0.4, 0.4)
    painted.inputs["Material"].default_value = material
    link(cube.outputs["Mesh"], painted.inputs["Geometry"])
    source = painted
    if of is not None:
        source = nodes.new("GeometryNodeObjectInfo")
        source.inputs["Object"].default_value, source.inputs["As Instance"].default_value = of, True
    link(source.outputs["Geometry"], instances.inputs["Instance"])
    link(start.outputs[0], instances.inputs["Points"])
    link(instances.outputs[0], join.inputs[0])
    if joined:
        link(start.outputs[0], join.inputs[0])
    link(join.outputs[0], end.inputs[0])
    item.modifiers.new("Scatter", "NODES").node_group = group


def test_meshes_that_geometry_nodes_make_are_instanced_with_their_material(scene: Any, export: Any, render_cycles: Any,
                                                                           render_mitsuba: Any) -> None:  # fmt: skip
    item = lit_quad(scene)
    scatter(item, emission_material("Sprinkle", (0.2, 0.5, 1.0)))
    bpy.context.view_layer.update()
    theirs = render_cycles()
    report = export(item)
    assert len(list((report.folder / "meshes").glob("*.ply"))) == 1 + 4
    ours = render_mitsuba(report)
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.02)


def test_a_material_with_nodes_is_fitted_on_meshes_that_geometry_nodes_make(scene: Any, export: Any) -> None:
    """Its values were looked for in the object's slot alone, so that the camera was said to see nothing."""
    item = lit_quad(scene)
    material = item.data.materials[0]
    tree = material.node_tree
    noise, shader = tree.nodes.new("ShaderNodeTexNoise"), next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    tree.links.new(noise.outputs["Color"], shader.inputs["Base Color"])
    scatter(item, material, joined=False)
    bpy.context.view_layer.update()
    assert export(item).request["target"]["object"] == "Target"
    assert item.material_slots[0].material == material


def test_what_nodes_say_of_their_instances_is_named(scene: Any, export: Any) -> None:
    target = lit_quad(scene)
    item = add_quad("Item", 0.9, 1.0, new_material("Plain"))
    material = new_material("Sprinkle")
    tree = material.node_tree
    said, shader = tree.nodes.new("ShaderNodeAttribute"), next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    said.attribute_type, said.attribute_name = "INSTANCER", "tone"
    tree.links.new(said.outputs["Color"], shader.inputs["Base Color"])
    scatter(item, material)
    assert [note for note in export(target).notes if "what Attribute tell of each instance of 'Item'" in note]


def sprinkle(item: Any, source: Any, *, collection: bool) -> None:
    """Let hair particles of `item` be `source`, by itself or as what a collection holds."""
    made = item.modifiers.new("Sprinkles", "PARTICLE_SYSTEM").particle_system.settings
    made.type, made.count, made.use_advanced_hair, made.particle_size = "HAIR", 6, True, 1.0
    if not collection:
        made.render_type, made.instance_object = "OBJECT", source
        return
    holder = bpy.data.collections.new("Sprinkles")
    bpy.context.scene.collection.children.link(holder)
    holder.objects.link(source)
    made.render_type, made.instance_collection = "COLLECTION", holder


def bright_cube() -> Any:
    """A small cube that glows, out of sight."""
    bpy.ops.mesh.primitive_cube_add(size=0.3, location=(0.0, 0.0, -9.0))
    cube = bpy.context.object
    cube.data.materials.append(emission_material("Sprinkle", (0.2, 0.5, 1.0)))
    return cube


@pytest.mark.parametrize(
    ("put", "shown"),
    [
        pytest.param(lambda item, cube: sprinkle(item, cube, collection=False), True, id="particles"),
        pytest.param(lambda item, cube: sprinkle(item, cube, collection=True), False, id="particles of a collection"),
        pytest.param(lambda item, cube: scatter(item, of=cube), True, id="nodes"),
    ],
)
def test_a_hidden_object_is_instanced_where_cycles_shows_it(
    put: Any, shown: bool, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """The source of what is scattered is often hidden itself: particles and nodes that name it show it all the same."""
    item = lit_quad(scene)
    cube = bright_cube()
    cube.hide_render = True
    put(item, cube)
    bpy.context.view_layer.update()
    theirs = render_cycles()
    report = export(item)
    assert (len(list((report.folder / "meshes").glob("*.ply"))) > 1) is shown
    assert render_mitsuba(report).mean() == pytest.approx(theirs.mean(), rel=0.02)
    assert not cube.hide_viewport


def cut(item: Any, cube: Any) -> None:
    """Cut a hole into a thick copy of `item`."""
    item.modifiers.new("Thick", "SOLIDIFY").thickness = 0.2
    hole = item.modifiers.new("Hole", "BOOLEAN")
    hole.object, hole.solver = cube, "EXACT"
    cube.location, cube.scale = (0.0, 0.0, 0.0), (4.0, 4.0, 4.0)


@pytest.mark.parametrize("hidden", ["object", "collection above", "out of the layer"])
@pytest.mark.parametrize(
    "put", [pytest.param(lambda item, cube: sprinkle(item, cube, collection=False), id="particles"), scatter, cut]
)
def test_modifiers_of_what_is_hidden_are_as_cycles_has_them(
    put: Any, hidden: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """A cutter and a source are hidden and have modifiers: those of the render, or none where particles are of it."""
    item = lit_quad(scene)
    cube = bright_cube()
    around = cube.modifiers.new("Round", "SUBSURF")
    around.levels, around.render_levels = 0, 3
    outer, inner = bpy.data.collections.new("Outer"), bpy.data.collections.new("Inner")
    scene.collection.children.link(outer)
    outer.children.link(inner)
    for owner in list(cube.users_collection):
        owner.objects.unlink(cube)
    inner.objects.link(cube)
    if put is scatter:
        scatter(item, of=cube)
    else:
        put(item, cube)
    if hidden == "object":
        cube.hide_render = True
    elif hidden == "collection above":
        outer.hide_render = True
    else:
        bpy.context.view_layer.layer_collection.children["Outer"].exclude = True
    bpy.context.view_layer.update()
    theirs = render_cycles()
    assert render_mitsuba(export(item)).mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=0.02)
    assert around.levels == 0


def test_the_view_layer_that_renders_is_exported(scene: Any, export: Any) -> None:
    item = lit_quad(scene)
    other = add_quad("Other", 1.0, -1.0, diffuse_material("Other", (0.5, 0.5, 0.5)))
    hidden = bpy.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    for collection in list(other.users_collection):
        collection.objects.unlink(other)
    hidden.objects.link(other)
    second = scene.view_layers.new("Second")
    second.layer_collection.children["Hidden"].exclude = True
    scene.view_layers[0].use = False
    report = export(item)
    assert any("'Second' is exported" in note for note in report.notes)
    assert len(list((report.folder / "meshes").glob("*.ply"))) == 1


def test_muted_nodes_are_as_in_cycles(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    item = lit_quad(scene)
    floor = add_quad("Floor", 6.0, -0.1, diffuse_material("Floor", (0.9, 0.2, 0.1)))
    tree = floor.data.materials[0].node_tree
    gamma = tree.nodes.new("ShaderNodeGamma")
    gamma.inputs["Gamma"].default_value, gamma.mute = 4.0, True
    colour = tree.nodes.new("ShaderNodeRGB")
    colour.outputs[0].default_value = (0.1, 0.8, 0.3, 1.0)
    tree.links.new(colour.outputs[0], gamma.inputs["Color"])
    diffuse = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    tree.links.new(gamma.outputs[0], diffuse.inputs["Color"])
    world_color(scene, 0.5)
    next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND").mute = True
    bpy.context.view_layer.update()
    theirs, ours = render_cycles(), render_mitsuba(export(item))
    for channel in range(3):  # of the frame around the target
        assert ours[:2, :, channel].mean() == pytest.approx(theirs[:2, :, channel].mean(), rel=0.03)
    item.data.materials[0].node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node.mute = True
    with pytest.raises(ExportError, match="is muted"):
        export(item, "muted")


def test_faces_in_the_same_place_are_named(scene: Any) -> None:
    item = lit_quad(scene)
    for name in ("A", "B"):
        add_quad(name, 1.0, -1.0, new_material(name))
    bpy.context.view_layer.update()
    _, notes = check_export(bpy.context, item)
    assert sum("'A' and 'B' have faces in the same place" in note for note in notes) == 1


@pytest.mark.parametrize("kind", ["ORTHO", "PERSP"])
def test_others_in_one_plane_that_the_camera_sees_are_named(scene: Any, render_cycles: Any, kind: str) -> None:
    """Floors of two sizes share no corner: they were black in Cycles alone, and nothing was said."""
    item = lit_quad(scene)
    scene.camera.data.type = kind
    floor, other = (add_quad(f"Floor {size}", size, -1.0, new_material(str(size))) for size in (20.0, 19.0))
    bpy.context.view_layer.update()
    _, notes = check_export(bpy.context, item)
    assert sum("have faces in the same place" in note and "Floor" in note for note in notes) == 1
    dark = render_cycles()[0, 0].mean()
    other.location.z = -0.5
    bpy.context.view_layer.update()
    assert not any("have faces in the same place" in note for note in check_export(bpy.context, item)[1])
    assert dark < 0.2 * render_cycles()[0, 0].mean()
    assert floor.location.z == 0.0


def test_a_world_that_the_camera_does_not_see(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    item = lit_quad(scene)
    world_color(scene, 0.5)
    scene.world.cycles_visibility.camera = False
    theirs, ours = render_cycles(), render_mitsuba(export(item))
    assert theirs[0, 0].max() == ours[0, 0].max() == 0.0
    assert np.abs(ours.mean() / theirs.mean() - 1.0) < 0.03


def test_a_background_set_is_shown(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    """A glowing quad and a lamp of another scene, of which a hidden object is not shown."""
    item = lit_quad(scene)
    other = bpy.data.scenes.new("Set")
    glow = add_quad("Glow", 0.5, 1.0, emission_material("Glow", (2.0, 1.0, 0.5)))
    hidden = add_quad("Hidden", 1.0, 2.0, emission_material("Hidden", (5.0, 5.0, 5.0)))
    hidden.hide_render = True
    light = add_light("POINT", (1, 1, 2), energy=50.0)
    for each in (glow, hidden, light):
        scene.collection.objects.unlink(each)
        other.collection.objects.link(each)
    scene.background_set = other
    bpy.context.view_layer.update()
    theirs, ours = render_cycles(), render_mitsuba(export(item))
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.03)  # half of it comes from the set


@pytest.mark.parametrize("kind", ["VERTS", "FACES", "NONE"])
def test_a_child_of_what_shows_it_on_faces_or_vertices_is_not_shown_itself(
    kind: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """A lamp on one face was there twice."""
    item = lit_quad(scene)
    lamp = next(each for each in scene.objects if each.type == "LIGHT")
    carrier = add_quad("Carrier", 0.2, 0.0, new_material("Carrier"))
    carrier.instance_type, carrier.show_instancer_for_render, carrier.hide_render = kind, False, kind == "NONE"
    carrier.location, lamp.location, lamp.parent = (0.0, 0.0, 2.0), (0.0, 0.0, 1.0), carrier
    bpy.context.view_layer.update()
    theirs = render_cycles()
    report = export(item)
    assert (report.folder / "scene.xml").read_text("utf-8").count('id="light_') == {"VERTS": 4}.get(kind, 1)
    assert render_mitsuba(report).mean() == pytest.approx(theirs.mean(), rel=0.02)


def put_away(scene: Any, shown_by: str, kind: str) -> Any:
    """A large bright carrier that is not shown itself, with what it shows: in the scene, or in an instance."""
    where = scene.collection
    if shown_by == "a collection":
        where = bpy.data.collections.new("Prefab")
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", where
        scene.collection.objects.link(empty)
    carrier = add_quad("Carrier", 1.0, 0.5, emission_material("Bright", (5.0, 5.0, 5.0)))
    chip = add_quad("Chip", 0.2, 0.0, emission_material("Chip", (1.0, 0.2, 0.1)))
    for item in (carrier, chip):
        scene.collection.objects.unlink(item)
        where.objects.link(item)
    carrier.show_instancer_for_render = False
    if kind == "PARTICLES":
        carrier.modifiers.new("Particles", "PARTICLE_SYSTEM")
        settings = carrier.particle_systems[0].settings
        settings.count, settings.frame_end, settings.physics_type, settings.particle_size = 3, 1, "NO", 1.0
        settings.render_type, settings.instance_object = "OBJECT", chip
        chip.location = (9.0, 0.0, 0.0)
    elif kind == "NODES":
        scatter(carrier, emission_material("Sprinkle", (0.2, 0.5, 1.0)))
    else:
        carrier.instance_type, chip.parent = kind, carrier
        chip.location = (0.0, 0.0, 0.1)
    bpy.context.view_layer.update()
    return carrier


@pytest.mark.parametrize("kind", ["VERTS", "FACES", "PARTICLES", "NODES"])
@pytest.mark.parametrize("shown_by", ["the scene", "a collection"])
def test_an_instancer_that_renders_do_not_show(
    kind: str, shown_by: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """Within an instance, or with geometry nodes, it was shown: 5 for 0.3 where it is seen."""
    item = lit_quad(scene)
    carrier = put_away(scene, shown_by, kind)
    viewport = carrier.show_instancer_for_viewport
    theirs = render_cycles()
    ours = render_mitsuba(export(item))
    assert theirs.mean() < 1.0
    assert ours.mean() == pytest.approx(theirs.mean(), rel=0.05)
    assert carrier.show_instancer_for_viewport == viewport


def test_a_curve_that_shows_a_child_on_its_vertices_and_not_itself(
    scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """The faces of curves and texts come as instances, which were shown whatever the object says."""
    item = lit_quad(scene)
    curve = bpy.data.curves.new("Ring", "CURVE")
    curve.dimensions, curve.fill_mode = "2D", "BOTH"
    spline = curve.splines.new("POLY")
    spline.points.add(3)
    for point, (x, y) in zip(spline.points, ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)), strict=True):
        point.co = (x, y, 0.5, 1.0)
    spline.use_cyclic_u = True
    curve.materials.append(emission_material("Bright", (5.0, 5.0, 5.0)))
    ring = bpy.data.objects.new("Ring", curve)
    scene.collection.objects.link(ring)
    ring.instance_type, ring.show_instancer_for_render = "VERTS", False
    bpy.context.view_layer.update()
    theirs = render_cycles()
    assert render_mitsuba(export(item)).mean() == pytest.approx(theirs.mean(), rel=0.02)
