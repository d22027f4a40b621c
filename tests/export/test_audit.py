# SPDX-License-Identifier: Apache-2.0
"""The audit knows every property of this Blender, and names those that are set. Oracle: RNA itself."""

from __future__ import annotations

from typing import Any

import bpy
import pytest

from blender_addon.export.render_state import RENDER_TWINS

from .rna_walk import TYPES, cycles_owners, unknown
from .scenes import add_camera, add_light, add_quad, new_material, world_color


def test_no_property_is_unknown(scene: Any) -> None:
    assert unknown() == []


@pytest.mark.parametrize("table", list(TYPES.values()), ids=list(TYPES))
def test_every_property_has_one_verdict(table: Any) -> None:
    exported, no_effect, named = table.exported.split(), table.no_effect.split(), list(table.named)
    assert not (set(exported) & set(no_effect) | set(exported) & set(named) | set(no_effect) & set(named))


def test_named_properties_are_neutral_at_first(scene: Any) -> None:
    """A default that is named would be said of every scene."""
    owners = [(scene.render, TYPES["RenderSettings"]), (scene.view_layers[0], TYPES["ViewLayer"])]
    for owner, table in [*owners, *cycles_owners().values()]:
        for key, rule in table.named.items():
            assert getattr(owner, key, rule.neutral) == rule.neutral, key


def test_modifiers_that_differ_between_viewport_and_render_are_known(scene: Any) -> None:
    kinds = [getattr(bpy.types, name) for name in dir(bpy.types)]
    found = {
        prop.identifier
        for kind in kinds
        if isinstance(kind, type) and issubclass(kind, bpy.types.Modifier)
        for prop in kind.bl_rna.properties
        if "render" in prop.identifier or "viewport" in prop.identifier
    }
    assert found - {"show_render", "show_viewport"} <= {name for pair in RENDER_TWINS.values() for name in pair}


def ball(scene: Any) -> Any:
    item = add_quad("Target", 2.0, 0.0, new_material("Target"))
    add_light("POINT", (0, 0, 3), energy=100.0)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=3.0)
    world_color(scene, 0.5)
    bpy.context.view_layer.update()
    return item


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda s: setattr(s.cycles, "use_fast_gi", True), "Fast GI"),
        (lambda s: setattr(s.world.cycles_visibility, "glossy", False), "hidden from glossy rays"),
        (lambda s: setattr(s.world.cycles, "max_bounces", 1), "limit of bounces"),
        (lambda s: setattr(s.render, "use_stamp", True), "Burn Into Image"),
        (lambda s: limit_textures(s, simplify=True), "size of textures"),
    ],
)
def test_what_is_set_is_said(change: Any, words: str, scene: Any, export: Any) -> None:
    item = ball(scene)
    assert not export(item, "plain").notes
    change(scene)
    assert any(words in note for note in export(item).notes)


def limit_textures(scene: Any, *, simplify: bool) -> None:
    scene.render.use_simplify, scene.cycles.texture_limit_render = simplify, "128"
    scene.cycles.use_camera_cull = True


def test_what_simplify_does_is_silent_without_simplify(scene: Any, export: Any) -> None:
    item = ball(scene)
    limit_textures(scene, simplify=False)
    assert not export(item).notes


def test_a_holdout_is_said_of_what_it_cuts_out(scene: Any, export: Any) -> None:
    """Cycles lights with the lamps of such a collection as with any others."""
    item = ball(scene)
    made = bpy.data.collections.new("Cut")
    scene.collection.children.link(made)
    bpy.context.view_layer.layer_collection.children["Cut"].holdout = True
    made.objects.link(next(each for each in scene.objects if each.type == "LIGHT"))
    assert not export(item, "lamp").notes
    made.objects.link(add_quad("Card", 0.5, 0.5, new_material("Card")))
    assert export(item, "card").notes == (
        "Collection 'Cut' is a holdout: Cycles cuts its objects out; in the fit they are objects.",
    )
