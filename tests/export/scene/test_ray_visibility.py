# SPDX-License-Identifier: Apache-2.0
"""Objects that some rays do not find, or find as something else; pictures of all routes against Cycles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.findings import ExportError  # noqa: E402

from ..materials.test_node_graphs import ball, lit_scene, recorded_and_cycles, renderer_and_cycles  # noqa: E402
from ..scenes import add_light, add_mesh, add_quad, emission_material, new_material, world_color  # noqa: E402

RECORDINGS = 4


def softbox(height: float = 2.0) -> Any:
    """A glowing square between the camera and the target, which throws its light down."""
    h, z = 0.5, height
    corners = [(-h, -h, z), (-h, h, z), (h, h, z), (h, -h, z)]
    return add_mesh("Softbox", corners, [(0, 1, 2, 3)], emission_material("Glow", (4.0, 3.0, 2.0)))


def target(**values: Any) -> Any:
    return ball(new_material("Target", Base_Color=(0.6, 0.4, 0.3), Roughness=0.3, **values))


def hide(scene: Any, item: Any, how: str) -> None:
    """By its own ray visibility, by its collection, or by that of the instancer which shows it."""
    if how == "own":
        item.visible_camera = False
        return
    collection = bpy.data.collections.new("Lights")
    for owner in list(item.users_collection):
        owner.objects.unlink(item)
    collection.objects.link(item)
    if how == "indirect only":
        scene.collection.children.link(collection)
        bpy.context.view_layer.layer_collection.children["Lights"].indirect_only = True
        return
    instancer = bpy.data.objects.new("Instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", collection
    instancer.visible_camera = False
    scene.collection.objects.link(instancer)


@pytest.mark.parametrize("how", ["own", "indirect only", "instancer"])
def test_recorded_paths_see_the_target_behind_a_softbox(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, how: str
) -> None:
    lit_scene(scene)
    scene.cycles.samples = 1024
    item = target()
    hide(scene, softbox(), how)
    found, truth = recorded_and_cycles(export, render_cycles, item)
    assert abs(found.mean() / truth.mean() - 1.0) < 0.01
    assert np.sqrt(np.mean((found - truth) ** 2)) / truth.mean() < 0.05


def test_traced_pictures_see_the_target_behind_a_softbox(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any
) -> None:
    """Glass, which is looked at by whole paths: the camera's ray stays the camera's through alpha alone."""
    lit_scene(scene)
    scene.cycles.samples, scene.cycles.max_bounces = 1024, 4
    scene.cycles.transmission_bounces = scene.cycles.glossy_bounces = 4
    item = target(Transmission_Weight=1.0, Alpha=0.7)
    hide(scene, softbox(), "own")
    hide(scene, softbox(-2.0), "own")  # behind the ball: seen through its glass, not through its holes
    renderer, truth = renderer_and_cycles(export, render_cycles, item)
    from mfo_backend.render.traced.traced_paths import TracedPaths

    pixels = np.flatnonzero(renderer.target_mask().ravel())
    traced = TracedPaths(renderer).images(renderer.start[None], pixels, seed=1, samples=512, jacobian=False)
    pictures = {"path": renderer.image(renderer.start, seed=2, spp=512).reshape(-1, 3)[pixels]}
    pictures["traced"] = traced[0, :, :, 0]
    level = truth.reshape(-1, 3)[pixels].mean()
    for name, found in pictures.items():
        assert abs(found.mean() / level - 1.0) < 0.01, name


def test_a_target_that_the_camera_misses_is_refused(scene: Any, export: Any) -> None:
    lit_scene(scene)
    item = target()
    item.visible_camera = False
    with pytest.raises(ExportError, match="'Sphere' is hidden from camera rays: let the camera see it"):
        export(item)


@pytest.mark.parametrize("flag", ["is_holdout", "is_shadow_catcher"])
def test_a_target_whose_material_no_picture_shows_is_refused(
    scene: Any, export: Any, render_cycles: Any, flag: str
) -> None:
    """Oracle: Cycles, of which red and blue give the same picture."""
    lit_scene(scene)
    item = target()
    setattr(item, flag, True)
    pictures = []
    for color in ((0.9, 0.1, 0.1, 1.0), (0.1, 0.1, 0.9, 1.0)):
        item.data.materials[0].node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = color
        pictures.append(render_cycles())
    np.testing.assert_allclose(pictures[0], pictures[1], atol=0.01)
    with pytest.raises(ExportError, match="'Sphere' is a holdout or shadow catcher, so pictures do not show its"):
        export(item)


def glow_to_the_camera(material: Any) -> None:
    """Let a material glow to rays of the camera alone, as a backdrop may."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    mix, glow, path = (nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "Emission", "LightPath"))
    glow.inputs["Color"].default_value = (1.0, 0.0, 1.0, 1.0)
    links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    links.new(nodes["Principled BSDF"].outputs[0], mix.inputs[1])
    links.new(glow.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], material.node_tree.get_output_node("CYCLES").inputs["Surface"])


@pytest.mark.parametrize("flag", ["is_holdout", "is_shadow_catcher", "light path"])
def test_what_the_camera_sees_otherwise_is_none_of_the_surroundings(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, flag: str
) -> None:
    """Oracle: Cycles' picture of the truth, whose verdict hung on a green floor that no picture shows."""
    from mfo_backend.fit.judge.verdict import AROUND_SHARED, judge
    from mfo_backend.metrics.display.tone_mapping import DisplayView
    from mfo_backend.types.image import Encoding, Image
    from mfo_backend.types.verdict import Verdict

    lit_scene(scene)
    scene.cycles.samples = 256
    corners = [(-3, -3, -4), (3, -3, -4), (3, 3, -4), (-3, 3, -4)]
    floor = add_mesh("Floor", corners, [(0, 1, 2, 3)], new_material("Floor", Base_Color=(0.05, 0.4, 0.05)))
    item = target()
    # a reference whose surroundings are even counts as cut out
    post = [(-3, -3, -3.9), (-2, -3, -3.9), (-2, 3, -3.9), (-3, 3, -3.9)]
    add_mesh("Post", post, [(0, 1, 2, 3)], new_material("Post", Base_Color=(0.7, 0.2, 0.1)))
    if flag == "light path":
        glow_to_the_camera(floor.data.materials[0])
    else:
        setattr(floor, flag, True)
    renderer, truth = renderer_and_cycles(export, render_cycles, item)
    picture, mask = renderer.image(renderer.start, seed=1, spp=256), renderer.target_mask()
    otherwise = renderer.otherwise_mask()
    assert otherwise.any()
    reference = Image(np.ascontiguousarray(truth, np.float32), Encoding.LINEAR)
    found = judge(reference, picture, mask, DisplayView(), others=otherwise)
    without = judge(reference, picture, mask, DisplayView())
    assert found is not None
    assert without is not None
    assert found.around is None or found.around.shared_at_least < 0.3 * AROUND_SHARED
    assert without.around is not None
    assert without.around.shared_at_least > AROUND_SHARED
    if flag == "light path":  # pixels of the target's rim have the glow in them, too
        return
    assert found.verdict is Verdict.SAME
    assert without.verdict is Verdict.CLOSE
    setattr(floor, flag, False)
    assert not renderer_and_cycles(export, render_cycles, item)[0].otherwise_mask().any()


def levels(export: Any, render_cycles: Any, target: Any) -> dict[str, Any]:
    """Means of both routes' pictures within the target over Cycles', RGB, less 1."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    renderer, wanted = renderer_and_cycles(export, render_cycles, target)
    recorded = RecordedScene(renderer, int(renderer.target_mask().sum()))
    pictures = []
    for seed in range(RECORDINGS):
        paths = recorded.record(renderer.start, grid=4, seed=seed, near=True)
        groups = paths.pixel_groups(paths.interior)
        pictures.append(np.asarray(recorded.pictures(paths, groups)(renderer.start))[:, :, 0])
    truth = wanted.reshape(-1, 3)[groups.pixels].mean(axis=0)
    traced = renderer.image(renderer.start, seed=2, spp=1024).reshape(-1, 3)[groups.pixels]
    found = {"recorded": np.mean(pictures, axis=0), "traced": traced}
    return {name: picture.mean(axis=0) / truth - 1.0 for name, picture in found.items()}


@pytest.mark.parametrize("hidden", [["diffuse"], ["glossy"], ["diffuse", "glossy"]])
def test_a_wall_that_some_rays_pass(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, hidden: list[str]
) -> None:
    """Beside a ball, which is 12, 2 and 14 % brighter where all rays find it."""
    lit_scene(scene)
    scene.cycles.samples, scene.cycles.max_bounces = 1024, 3
    target = ball(new_material("Target", Base_Color=(0.5, 0.4, 0.3), Roughness=0.4))
    wall = add_quad("Wall", 3.0, 0.0, new_material("Wall", Base_Color=(0.9, 0.8, 0.7)))
    wall.location, wall.rotation_euler = (-1.1, 0.0, 0.0), (0.0, np.pi / 2, 0.0)
    for kind in hidden:
        setattr(wall, f"visible_{kind}", False)
    for name, level in levels(export, render_cycles, target).items():
        assert np.abs(level).max() < 0.003, name


def test_a_plain_world_is_seen_past_a_wall_that_diffuse_rays_pass(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any
) -> None:
    """Cycles finds such a world by directions of materials alone; our light samples of it ended at the wall."""
    lit_scene(scene)
    bpy.data.objects.remove(next(item for item in scene.objects if item.type == "LIGHT"))
    scene.cycles.samples, scene.cycles.max_bounces = 1024, 3
    world_color(scene, 1.0)
    target = ball(new_material("Target", Base_Color=(0.5, 0.4, 0.3), Roughness=1.0, Specular_IOR_Level=0.0))
    wall = add_quad("Wall", 3.0, 0.0, new_material("Wall", Base_Color=(0.1, 0.1, 0.1)))
    wall.location, wall.rotation_euler = (-1.1, 0.0, 0.0), (0.0, np.pi / 2, 0.0)
    wall.visible_diffuse = False
    for name, level in levels(export, render_cycles, target).items():
        assert np.abs(level).max() < 0.003, name


def test_subsurface_that_some_rays_pass_is_said_to_be_diffuse(scene: Any, export: Any) -> None:
    lit_scene(scene)
    target = ball(new_material("Target"))
    wax = add_quad("Wax", 3.0, -1.2, new_material("Wax", Subsurface_Weight=1.0))
    for is_seen, count in ((True, 0), (False, 1)):
        wax.visible_glossy = is_seen
        bpy.context.view_layer.objects.active = target
        said = [n for n in export(target, name=f"{is_seen}").notes if "its Subsurface is shown as diffuse" in n]
        assert len(said) == count


def material_by_rays(shader: str, *rays: str) -> Any:
    """One that is clear to these rays and another shader to all others, as windows have it."""
    material = new_material("By Ray")
    tree = material.node_tree
    tree.nodes.clear()
    kinds = ("OutputMaterial", "MixShader", "LightPath", "BsdfTransparent", shader)
    output, mix, path, clear, other = (tree.nodes.new(f"ShaderNode{kind}") for kind in kinds)
    most: Any = path.outputs[rays[0]]
    for name in rays[1:]:
        larger = tree.nodes.new("ShaderNodeMath")
        larger.operation = "MAXIMUM"
        tree.links.new(most, larger.inputs[0])
        tree.links.new(path.outputs[name], larger.inputs[1])
        most = larger.outputs[0]
    for source, to in ((most, 0), (other.outputs[0], 1), (clear.outputs[0], 2)):
        tree.links.new(source, mix.inputs[to])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


@pytest.mark.parametrize(
    ("rays", "roughness"),
    [(["Is Shadow Ray"], 0.4), (["Is Shadow Ray", "Is Diffuse Ray"], 0.4), (["Is Shadow Ray", "Is Diffuse Ray"], 0.9)],
)
def test_a_window_pane(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, rays: list[str], roughness: float
) -> None:
    """Between a ball and a softbox; as diffuse rays find it the ball was 40 and 10 % too dark.

    A rough lobe is drawn by its albedo, as in Cycles: by its Fresnel term the third was 5.5 % off.
    """
    lit_scene(scene)
    scene.cycles.samples = 1024
    scene.cycles.max_bounces = scene.cycles.transmission_bounces = scene.cycles.glossy_bounces = 6
    target = ball(new_material("Target", Base_Color=(0.5, 0.4, 0.3), Roughness=roughness))
    pane = add_quad("Pane", 6.0, 0.0, material_by_rays("BsdfGlass", *rays))
    pane.location, pane.rotation_euler = (-1.5, 0.0, 0.0), (0.0, np.pi / 2, 0.0)
    pane.modifiers.new("Thickness", "SOLIDIFY").thickness = 0.02
    add_light("AREA", location=(-3.0, 0.0, 1.0), rotation=(0.0, -1.2, 0.0), energy=400.0, size=1.0)
    for name, level in levels(export, render_cycles, target).items():
        assert np.abs(level).max() < (0.01 if name == "recorded" else 0.025), name  # glass traces with more noise


def test_a_wall_that_the_camera_looks_through(scene: Any, export: Any, render_cycles: Any, mitsuba: Any) -> None:
    """As of a doll's house: it is there to all other rays, and hid the target."""
    lit_scene(scene)
    scene.cycles.samples, scene.cycles.max_bounces = 1024, 3
    world_color(scene, 0.5)
    target = ball(new_material("Target", Base_Color=(0.5, 0.4, 0.3), Roughness=0.4))
    add_quad("Wall", 2.0, 1.6, material_by_rays("BsdfDiffuse", "Is Camera Ray"))
    for name, level in levels(export, render_cycles, target).items():
        assert np.abs(level).max() < 0.005, name


@pytest.mark.parametrize("hidden", [[], ["diffuse"], ["glossy"]])
def test_wax_that_some_rays_pass_shines_beside_other_wax(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, hidden: list[str]
) -> None:
    """Its light was left out for a walk that nobody made: it was black. A Lambert lobe stands in, 8 % too bright."""
    lit_scene(scene)
    scene.cycles.samples, scene.cycles.max_bounces = 256, 3
    values = {"Base_Color": (0.8, 0.5, 0.3), "Subsurface_Weight": 1.0, "Subsurface_Scale": 0.002}
    target = ball(new_material("Target", **values))
    floor = add_quad("Floor", 4.0, -1.2, new_material("Floor", **values))
    for kind in hidden:
        setattr(floor, f"visible_{kind}", False)
    renderer, wanted = renderer_and_cycles(export, render_cycles, target)
    beside = ~renderer.target_mask() & (wanted.max(axis=-1) > 0.0)
    found = renderer.image(renderer.start, seed=1, spp=256)
    assert found[beside].mean() == pytest.approx(wanted[beside].mean(), rel=0.1 if hidden else 0.02)
