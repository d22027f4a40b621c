# SPDX-License-Identifier: Apache-2.0
"""Volumes inside of glass that absorb light: our pictures of them against Cycles, and which volumes are named."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from ..scenes import add_light, add_quad, diffuse_material, new_material  # noqa: E402
from .test_mixed_targets import Build, lit_by_the_sky, material_of, mix, noise, shader  # noqa: E402
from .test_node_graphs import ball, renderer_and_cycles  # noqa: E402

TEA = (0.85, 0.35, 0.08)
CLEAR = shader("BsdfTransparent")
GLASS = shader("BsdfGlass", Roughness=0.1, IOR=1.15)  # little is reflected, and noise is low
PRINCIPLED_GLASS = shader("BsdfPrincipled", Roughness=0.3, IOR=1.4, Transmission_Weight=1.0)
ABSORBS = shader("VolumeAbsorption", Color=TEA, Density=0.7)


def filled(surface: Build, volume: Build) -> Any:
    """A material of that surface with that volume inside."""
    material = material_of(surface)
    tree = material.node_tree
    tree.links.new(volume(tree), tree.get_output_node("CYCLES").inputs["Volume"])
    return material


def bumped_glass(tree: Any) -> Any:
    surface, bump = GLASS(tree), tree.nodes.new("ShaderNodeBump")
    bump.inputs["Strength"].default_value = 0.05
    tree.links.new(noise(tree), bump.inputs["Height"])
    tree.links.new(bump.outputs[0], surface.node.inputs["Normal"])
    return surface


def add_shell(target: Any) -> None:
    """A smaller ball in the same mesh: what leaves it has left the volume."""
    inner = ball(target.data.materials[0])
    inner.scale, inner.location = (0.4, 0.4, 0.4), (0.3, -0.2, 0.1)
    with bpy.context.temp_override(active_object=target, selected_editable_objects=[target, inner]):
        bpy.ops.object.join()


TARGETS = {
    "glass": (GLASS, ABSORBS),
    "principled": (PRINCIPLED_GLASS, shader("VolumePrincipled", Color=(0.0, 0.0, 0.0), Absorption_Color=TEA)),
    # light comes straight through it into the shadow
    "clear to shadows": (mix(0.4, GLASS, CLEAR), ABSORBS),
}


@pytest.mark.parametrize("name", TARGETS)
def test_what_is_left_of_light_inside_a_target_is_that_of_cycles(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, name: str
) -> None:
    """By the path tracer that judges results, its shadow included, and by that of the fit."""
    from mfo_backend.render.traced.traced_paths import TracedPaths

    lit_by_the_sky(scene)
    if name == "clear to shadows":
        add_light("SUN", rotation=(0.3, 0.2, 0.0), energy=2.0, angle=0.6)
    add_quad("Floor", 6.0, -1.2, diffuse_material("Floor", (0.8, 0.8, 0.8)))
    target = ball(filled(*TARGETS[name]))
    if name == "principled":
        add_shell(target)
    found, truth = renderer_and_cycles(export, render_cycles, target)
    assert found.shape.bsdf().absorbing is not None
    mask = found.target_mask()
    judged = found.image(found.start, seed=0, spp=1024)
    traced = TracedPaths(found).images(
        np.asarray(found.start), np.flatnonzero(mask), seed=0, samples=1024, jacobian=False
    )[0, :, :, 0]
    pairs = [(judged[~mask], truth[~mask]), (judged[mask], truth[mask]), (traced, truth[mask])]
    # the sun's light bent by the glass itself is rare and bright: 1 % of noise on the target, and the shadow has none
    for shown, wanted in pairs[:1] if name == "clear to shadows" else pairs:
        levels = shown.reshape(-1, 3).mean(axis=0) / wanted.reshape(-1, 3).mean(axis=0) - 1.0
        assert np.abs(levels).max() < 0.005


def drink() -> None:
    """Two fillings in each other, the inner one by coefficients where Blender has that node, and a pebble in both."""
    coefficients = hasattr(bpy.types, "ShaderNodeVolumeCoefficients")
    inner = shader("VolumeCoefficients", Absorption_Coefficients=(0.1, 0.3, 0.6), Scatter_Coefficients=(0.0, 0.0, 0.0))
    for name, radius, volume in (("Cup", 1.0, ABSORBS), ("Tea", 0.8, inner if coefficients else ABSORBS)):
        material = filled(GLASS, volume)
        material.name = name
        ball(material).scale = (radius, radius, radius)
    pebble = ball(diffuse_material("Pebble", (0.8, 0.8, 0.8)))
    pebble.scale, pebble.location = (0.3, 0.3, 0.3), (0.2, 0.0, 0.1)


def baked() -> None:
    material = filled(bumped_glass, ABSORBS)
    material.name = "Bumped"
    ball(material)


@pytest.mark.parametrize("build", [drink, baked])
def test_a_neighbour_takes_as_much_light_as_in_cycles(
    scene: Any, export: Any, render_cycles: Any, mitsuba: Any, build: Callable[[], None]
) -> None:
    lit_by_the_sky(scene)
    scene.cycles.max_bounces = scene.cycles.transmission_bounces = 12
    build()
    found, truth = renderer_and_cycles(export, render_cycles, add_quad("Floor", 6.0, -1.2, new_material("Target")))
    shown, middle = found.image(found.start, seed=0, spp=1024), np.s_[8:16, 8:16]
    assert not found.target_mask()[middle].any()
    levels = shown[middle].mean(axis=(0, 1)) / truth[middle].mean(axis=(0, 1)) - 1.0
    assert np.abs(levels).max() < 0.005


SAID = "Material 'Target': its volume is left out."
OPAQUE = shader("BsdfDiffuse", Color=TEA)
VOLUMES = {
    "absorbs": (GLASS, ABSORBS, [], (0.7, TEA)),
    "less than nothing": (GLASS, shader("VolumeAbsorption", Color=TEA, Density=-1.0), [], (0.0, TEA)),
    "scatters": (GLASS, shader("VolumeScatter"), [SAID], None),
    "principled that scatters": (GLASS, shader("VolumePrincipled"), [SAID], None),
    "mixed": (GLASS, mix(0.5, ABSORBS, None), [SAID], None),
    "by nodes": (GLASS, lambda tree: linked(ABSORBS, "Density", tree), [SAID], None),
    "inside of what lets no light in": (OPAQUE, ABSORBS, [], None),
}


def linked(build: Build, name: str, tree: Any) -> Any:
    found = build(tree)
    tree.links.new(noise(tree), found.node.inputs[name])
    return found


@pytest.mark.parametrize("name", VOLUMES)
def test_what_a_volume_takes_is_read_and_any_other_is_named(scene: Any, name: str) -> None:
    from blender_addon.export.findings import Findings
    from blender_addon.export.materials.read_context import read_context
    from blender_addon.export.materials.read_material import read_target

    surface, volume, said, wanted = VOLUMES[name]
    material = filled(surface, volume)
    for read in (lambda to: read_target(material, "Ball", 0, to), lambda to: read_context(material, "Ball", to)):
        findings = Findings()
        sockets = read(findings).sockets
        assert findings.notes == said
        assert ("Absorption Density" in sockets) == (wanted is not None)
        if wanted is not None:
            found = [sockets["Absorption Density"].value, *sockets["Absorption Color"].value]
            assert found == pytest.approx([wanted[0], *wanted[1]])


def test_a_volume_without_a_surface_has_none(scene: Any) -> None:
    """In Cycles nothing is seen of it but what it does to light; it was black."""
    from blender_addon.export.findings import Findings
    from blender_addon.export.materials.read_context import read_context

    material = filled(GLASS, ABSORBS)
    tree, findings = material.node_tree, Findings()
    tree.links.remove(tree.get_output_node("CYCLES").inputs["Surface"].links[0])
    assert read_context(material, "Cloud", findings).model == "null"
    assert findings.notes == [SAID]
