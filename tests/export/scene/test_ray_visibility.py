# SPDX-License-Identifier: Apache-2.0
"""Objects that the camera does not see light the target and reflect in it; pictures of all routes against Cycles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.findings import ExportError  # noqa: E402

from ..materials.test_node_graphs import ball, lit_scene, recorded_and_cycles, renderer_and_cycles  # noqa: E402
from ..scenes import add_mesh, emission_material, new_material  # noqa: E402


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
