# SPDX-License-Identifier: Apache-2.0
"""What an export refuses: one sentence that names what was given and what to do, and nothing on disk."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import pytest

from blender_addon.export.job import ExportError, check_export, export_job

from .scenes import (
    add_camera,
    add_light,
    add_mesh,
    add_quad,
    diffuse_material,
    emission_material,
    new_material,
    world_color,
)


def no_camera(scene: Any, target: Any) -> None:
    scene.camera = None


def panorama(scene: Any, target: Any) -> None:
    scene.camera.data.type = "PANO"


def empty_region(scene: Any, target: Any) -> None:
    scene.render.use_border, scene.render.border_min_x, scene.render.border_max_x = True, 0.5, 0.51


def flat_camera(scene: Any, target: Any) -> None:
    scene.camera.scale = (1.0, 0.0, 1.0)


def slot_by_nodes(scene: Any, target: Any) -> None:
    """Nodes, in a group, give the faces the material that the slot had."""
    inner, tree = (bpy.data.node_groups.new(name, "GeometryNodeTree") for name in ("Inner", "Scatter"))
    inner.nodes.new("GeometryNodeSetMaterial").inputs["Material"].default_value = target.active_material
    tree.nodes.new("GeometryNodeGroup").node_tree = inner
    target.modifiers.new("Scatter", "NODES").node_group = tree
    target.data.materials.clear()


def no_slot(scene: Any, target: Any) -> None:
    target.data.materials.clear()


def empty_slot(scene: Any, target: Any) -> None:
    target.data.materials[0] = None


def no_principled(scene: Any, target: Any) -> None:
    target.data.materials[0] = emission_material("Plain", (1, 1, 1))


def slot_without_faces(scene: Any, target: Any) -> None:
    target.data.materials.append(new_material("Unused"))
    target.active_material_index = 1


def outside(scene: Any, target: Any) -> None:
    target.location.x = 5.0


def behind(scene: Any, target: Any) -> None:
    target.location.z = 20.0


def covered(scene: Any, target: Any) -> None:
    add_quad("Lid", 3.0, 1.0, diffuse_material("Lid", (1, 1, 1)))


def hidden(scene: Any, target: Any) -> None:
    target.hide_render = True


def dark(scene: Any, target: Any) -> None:
    scene.world = None


def no_faces(scene: Any, target: Any) -> None:
    target.data.clear_geometry()


def override(scene: Any, target: Any) -> None:
    bpy.context.view_layer.material_override = diffuse_material("Clay", (1, 1, 1))


def camera_nowhere(scene: Any, target: Any) -> None:
    scene.camera.rotation_euler.x = float("nan")


def endless_lens(scene: Any, target: Any) -> None:
    scene.camera.data.shift_x = float("nan")


def lamp_nowhere(scene: Any, target: Any) -> None:
    add_light("POINT").location.y = float("nan")


def endless_lamp(scene: Any, target: Any) -> None:
    add_light("SUN").data.energy = float("inf")


def holed_picture(scene: Any, target: Any) -> None:
    """A texture before other nodes: Cycles would evaluate them."""
    image = bpy.data.images.new("Holed", 4, 4, float_buffer=True)
    image.pixels[8:11] = (float("nan"),) * 3
    tree = target.data.materials[0].node_tree
    texture, gamma = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeGamma")
    texture.image = image
    tree.links.new(texture.outputs[0], gamma.inputs[0])
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(gamma.outputs[0], principled.inputs["Base Color"])


def holed_sky(scene: Any, target: Any) -> None:
    image = bpy.data.images.new("Holed", 4, 2, float_buffer=True)
    image.pixels.foreach_set([1.0, 1.0, float("inf"), 1.0] * 8)
    tree = scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(texture.outputs[0], background.inputs["Color"])


def endless_world(scene: Any, target: Any) -> None:
    add_light("SUN")  # without it the scene has no light
    world_color(scene, float("nan"))


def no_roughness(scene: Any, target: Any) -> None:
    shader = target.active_material.node_tree.nodes["Principled BSDF"]
    shader.inputs["Roughness"].default_value = float("nan")


def other_without_colour(scene: Any, target: Any) -> None:
    add_quad("Wall", 0.2, -1.0, diffuse_material("Wall", (float("nan"), 1, 1)))


def emitter_put_away(scene: Any, target: Any) -> None:
    target.modifiers.new("Hair", "PARTICLE_SYSTEM")
    target.show_instancer_for_render = False


def instancer_put_away(scene: Any, target: Any) -> None:
    target.instance_type = "VERTS"
    target.show_instancer_for_render = False


CAMERA = (
    "The place or a setting of the camera is NaN or infinite: mend the driver, constraint or keyframe that gives it."
)
LAMP = (
    "The place or a setting of light 'Light' is NaN or infinite: mend the driver, constraint or keyframe that gives "
    "it, or hide the light in renders."
)
HOLED = (
    "Image 'Holed' has pixels that are NaN, infinite or absurdly bright (1e15): replace them, or choose another image."
)
PUT_AWAY = (
    "Object 'Target' shows others and not itself in the render: turn its Show Emitter (of particles) or Show Instancer "
    "(Render) on."
)
WORLD = "The colour or strength of the world is NaN or infinite: mend the driver or keyframe that gives it."
VALUE = "A value of material '{}' is NaN or infinite: mend the driver or keyframe that gives it, or set a number."

CASES: dict[Callable[[Any, Any], None], str] = {
    no_camera: "The scene has no camera: add one and make it the active camera.",
    panorama: "Camera 'Camera' is of type Pano: make it Perspective or Orthographic.",
    empty_region: "The Render Region holds no pixel: turn Render Region off.",
    flat_camera: "Camera 'Camera' has a scale of zero: give it and its parents a scale other than zero.",
    no_slot: "Slot 1 of 'Target' has no material: give it one with a Principled BSDF.",
    slot_by_nodes: "Slot 1 of 'Target' has no material: put 'Target' there, which its nodes set.",
    empty_slot: "Slot 1 of 'Target' has no material: give it one with a Principled BSDF.",
    no_principled: "Material 'Plain' shows Emission alone, which reflects no light: link a Principled BSDF, directly, "
    "in a group or in a mix.",
    slot_without_faces: "No face of 'Target' uses its active material slot 2: choose another.",
    outside: "The camera does not see 'Target': move it into the frame.",
    behind: "The camera does not see 'Target': move it into the frame.",
    covered: "The camera does not see 'Target': it is hidden behind 'Lid'.",
    hidden: "Object 'Target' is hidden in the render: show it.",
    dark: "The scene has no light: add a light or give the world a colour.",
    override: "View layer 'ViewLayer' replaces materials or the world by 'Clay': remove the override.",
    camera_nowhere: CAMERA,
    endless_lens: CAMERA,
    lamp_nowhere: LAMP,
    endless_lamp: LAMP,
    endless_world: WORLD,
    holed_picture: HOLED,
    holed_sky: HOLED,
    no_roughness: VALUE.format("Target"),
    other_without_colour: VALUE.format("Wall"),
    emitter_put_away: PUT_AWAY,
    instancer_put_away: PUT_AWAY,
    no_faces: "No face of 'Target' uses its active material slot 1: choose another.",
}


@pytest.mark.parametrize("spoil", CASES, ids=lambda spoil: spoil.__name__)
def test_refused_with_one_sentence(spoil: Any, scene: Any, tmp_path: Path) -> None:
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=2.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    spoil(scene, target)
    with pytest.raises(ExportError) as caught:
        export_job(bpy.context, target, tmp_path / "job", reference=None, fit={})
    assert str(caught.value) == CASES[spoil]
    assert list(tmp_path.iterdir()) == []
    assert check_export(bpy.context, target)[0][0] == CASES[spoil]


def test_object_that_is_no_mesh(scene: Any) -> None:
    item = bpy.data.objects.new("Handle", None)
    bpy.context.collection.objects.link(item)
    assert check_export(bpy.context, item)[0] == ["The object to fit is 'Handle' (Empty): select an object with faces."]
    assert check_export(bpy.context, None)[0] == ["The object to fit is nothing: select an object with faces."]


def test_partly_covered_also_by_glass_is_fine(scene: Any) -> None:
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=2.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    add_quad("Lid", 0.9, 1.0, diffuse_material("Lid", (1, 1, 1)))
    assert check_export(bpy.context, target)[0] == []
    add_quad("Pane", 0.95, 2.0, new_material("Glass", Transmission_Weight=1.0))
    assert check_export(bpy.context, target)[0] == []


def test_target_larger_than_the_frame_is_fine(scene: Any) -> None:
    world_color(scene, 1.0)
    add_camera("PERSP", (0, 0, 1))
    target = add_mesh("Target", [(-90, -50, 0), (80, -70, 0), (10, 95, 0)], [(0, 1, 2)], new_material("Target"))
    assert check_export(bpy.context, target)[0] == []
