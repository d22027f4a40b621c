# SPDX-License-Identifier: Apache-2.0
"""Every property of the Blender that runs this, beside the audit's tables."""

from __future__ import annotations

from typing import Any

import bpy

from blender_addon.export.audit import object_table as objects
from blender_addon.export.audit import scene_table as scenes
from blender_addon.export.audit import shading_table as shading
from blender_addon.export.audit.rules import Owner

TYPES = {
    "Scene": scenes.SCENE,
    "RenderSettings": scenes.RENDER,
    "ViewLayer": scenes.VIEW_LAYER,
    "LayerCollection": scenes.LAYER_COLLECTION,
    "Collection": scenes.COLLECTION,
    "Object": objects.OBJECT,
    "Mesh": objects.MESH,
    "World": objects.WORLD,
    "PointLight": objects.LIGHT,
    "SpotLight": objects.LIGHT,
    "SunLight": objects.LIGHT,
    "AreaLight": objects.LIGHT,
    "Camera": objects.CAMERA,
    "Material": shading.MATERIAL,
    "Image": shading.IMAGE,
    "ImageUser": shading.IMAGE_USER,
    "ColorManagedInputColorspaceSettings": shading.COLORSPACE,
    "TexMapping": shading.TEXTURE_MAPPING,
    "Node": shading.NODE,
}


def cycles_owners() -> dict[str, tuple[Any, Owner]]:
    """What Cycles adds to Blender's types, by a word for it, on new data."""
    scene = bpy.context.scene
    item = bpy.data.objects.new("Audit", bpy.data.meshes.new("Audit"))
    world = bpy.data.worlds.new("Audit")
    return {
        "Scene.cycles": (scene.cycles, scenes.SCENE_CYCLES),
        "ViewLayer.cycles": (scene.view_layers[0].cycles, scenes.VIEW_LAYER_CYCLES),
        "Object.cycles": (item.cycles, objects.OBJECT_CYCLES),
        "World.cycles": (world.cycles, objects.WORLD_CYCLES),
        "World.cycles_visibility": (world.cycles_visibility, objects.WORLD_VISIBILITY),
        "Light.cycles": (bpy.data.lights.new("Audit", "AREA").cycles, objects.LIGHT_CYCLES),
        "Material.cycles": (bpy.data.materials.new("Audit").cycles, shading.MATERIAL_CYCLES),
    }


def unknown() -> list[str]:
    """Properties that no table knows, each with its owner."""
    every_id = set(bpy.types.ID.bl_rna.properties.keys()) | {"rna_type", "animation_data"}
    every_node = set(bpy.types.Node.bl_rna.properties.keys())
    walked = {name: (getattr(bpy.types, name).bl_rna, table, every_id) for name, table in TYPES.items()}
    walked |= {name: (owner.bl_rna, table, {"rna_type", "name"}) for name, (owner, table) in cycles_owners().items()}
    for name, table in shading.NODES.items():
        if hasattr(bpy.types, name):
            walked[name] = getattr(bpy.types, name).bl_rna, table, every_node
    missing = []
    for name, (rna, table, inherited) in walked.items():
        # other add-ons register properties of their own on these types
        own = {p.identifier for p in rna.properties if not p.is_runtime or "." in name}
        missing += [f"{name}.{key}" for key in sorted(own - inherited - table.known)]
    return missing
