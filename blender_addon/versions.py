# SPDX-License-Identifier: GPL-3.0-or-later
"""Every difference between Blender 4.2 and 5.2 that matters here, found by looking for the feature."""

from __future__ import annotations

from typing import Any

import bpy
import mathutils  # pyright: ignore[reportMissingImports]
import numpy as np
from numpy.typing import NDArray

PRINCIPLED, DIFFUSE = "ShaderNodeBsdfPrincipled", "ShaderNodeBsdfDiffuse"
# options of a path that may begin with "//": Blender 4.5 and later draw it in red without, older ones refuse the word
RELATIVE_PATH: set[str] = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


def working_space_to_rec709() -> NDArray[np.float64] | None:
    """Return the 3x3 matrix from the scene-linear working space to linear Rec.709, or None where they are the same."""
    color = mathutils.Color((1.0, 0.0, 0.0))
    if not hasattr(color, "from_scene_linear_to_rec709_linear"):
        return None
    columns = [mathutils.Color(axis).from_scene_linear_to_rec709_linear() for axis in np.eye(3)]
    matrix = np.array([list(column) for column in columns], dtype=np.float64).T
    return None if np.allclose(matrix, np.eye(3), atol=1e-5) else matrix


def light_strength(light: bpy.types.Light) -> float:
    """Energy with the exposure of Blender 4.5 and later."""
    return light.energy * 2.0 ** getattr(light, "exposure", 0.0)


def light_color(light: bpy.types.Light) -> NDArray[np.float64]:
    """Colour times the colour temperature of Blender 4.5 and later, in the working space."""
    color = np.array(light.color, dtype=np.float64)
    if getattr(light, "use_temperature", False):
        color = color * np.array(light.temperature_color, dtype=np.float64)
    return color


def light_is_normalized(light: bpy.types.Light) -> bool:
    """Whether the power is independent of the size (always so before Blender 4.5)."""
    return getattr(light, "normalize", True)


def cycles_settings(owner: Any) -> Any:
    """Return Cycles' settings of a scene, light, object ..., or None where the Cycles add-on is off.

    They are those of the original: a change of them by a script does not reach evaluated copies.
    """
    return getattr(getattr(owner, "original", owner), "cycles", None)


def shadow_terminator(item: bpy.types.Object) -> tuple[float, float]:
    """Return Geometry Offset and Shading Offset: of the object from Blender 5.0 on, before of its Cycles settings.

    Blender 5 still has those of Cycles, which change nothing any more (measured in 5.0 and 5.2).
    """
    if hasattr(item, "shadow_terminator_shading_offset"):
        return item.shadow_terminator_geometry_offset, item.shadow_terminator_shading_offset
    cycles = cycles_settings(item)
    if cycles is None:
        return 0.1, 0.0
    return cycles.shadow_terminator_geometry_offset, cycles.shadow_terminator_offset


def divides_adaptively(modifier: bpy.types.Modifier, item: bpy.types.Object) -> bool:
    """Whether Cycles subdivides by the size on screen: a property of the modifier from Blender 5.0 on."""
    if modifier.type != "SUBSURF" or not modifier.show_render:
        return False
    if hasattr(modifier, "use_adaptive_subdivision"):
        return modifier.use_adaptive_subdivision
    cycles = cycles_settings(bpy.context.scene)
    experimental = getattr(cycles, "feature_set", "SUPPORTED") == "EXPERIMENTAL"
    return experimental and getattr(cycles_settings(item), "use_adaptive_subdivision", False)


def active_output(tree: bpy.types.NodeTree | None) -> bpy.types.Node | None:
    """Return the output node that Cycles uses."""
    if tree is None:
        return None
    return tree.get_output_node("CYCLES")


def node_tree_of(owner: Any) -> bpy.types.NodeTree | None:
    """Return the shader nodes of a material, world or light; None when it does not use them.

    `use_nodes` is deprecated, always true and a warning to read: for materials and worlds from Blender 5.0 on, for
    lights from 5.2 on.
    """
    tree = getattr(owner, "node_tree", None)
    if tree is None:
        return None
    switch = owner.bl_rna.properties.get("use_nodes")
    if switch is None or getattr(switch, "is_deprecated", False):
        return tree
    return tree if owner.use_nodes else None


def nodes_enabled(owner: Any) -> bpy.types.NodeTree:
    """Return the node tree of a new material or world, made if there is none (5.0: it always has one)."""
    if owner.node_tree is None:
        owner.use_nodes = True
    return owner.node_tree


def default_surface_is_principled() -> bool:
    """Whether Cycles gives faces without material a Principled BSDF, as since Blender 5.0, or a diffuse of 0.8.

    Measured: diffuse in 4.3, Principled in 5.0 and 5.2. Materials got nodes for good in the same release.
    """
    return getattr(bpy.types.Material.bl_rna.properties.get("use_nodes"), "is_deprecated", False)


def curves_of(owner: Any) -> list[bpy.types.FCurve]:
    """Return the F-curves that animate an ID: those of its action and of its NLA strips.

    Actions have layers with a bag of curves for each slot from Blender 4.4 on, and nothing else from 5.0 on.
    """
    data = owner.animation_data
    if data is None:
        return []
    strips = [strip for track in data.nla_tracks for strip in track.strips]
    found = []
    for user in (data, *strips):
        action, slot = user.action, getattr(user, "action_slot", None)
        if action is None:
            continue
        if not hasattr(action, "layers"):
            found += list(action.fcurves)
            continue
        bags = [bag for layer in action.layers for strip in layer.strips for bag in strip.channelbags]
        found += [curve for bag in bags if slot is not None and bag.slot_handle == slot.handle for curve in bag.fcurves]
    return found


def has_compositor(scene: bpy.types.Scene) -> bool:
    """Whether rendered pictures pass through compositing nodes (a node group from Blender 5.0 on)."""
    if not scene.render.use_compositing:
        return False
    if hasattr(scene, "compositing_node_group"):
        return scene.compositing_node_group is not None
    return bool(scene.use_nodes and scene.node_tree is not None)


def overrides_of(view_layer: bpy.types.ViewLayer) -> list[str]:
    """Return the names of the material and (from Blender 4.3 on) world that replace all others in `view_layer`."""
    owners = (getattr(view_layer, name, None) for name in ("material_override", "world_override"))
    return [owner.name for owner in owners if owner is not None]


def can_denoise() -> bool:
    """Whether this build has OpenImageDenoise; Debian's 4.3 has not, and refuses to render with denoising on."""
    try:
        import _cycles  # pyright: ignore[reportMissingImports]
    except ImportError:
        return False
    return getattr(_cycles, "with_openimagedenoise", True)


def is_modal_operator_running() -> bool:
    """Whether a drag or another modal operator runs in some window; never, where Blender does not tell."""
    return any(getattr(window, "modal_operators", ()) for window in bpy.context.window_manager.windows)


def has_diffuse_roughness() -> bool:
    """Whether a Diffuse BSDF with roughness is the Oren-Nayar lobe of the Principled BSDF (4.2 has an older one)."""
    return bpy.app.version >= (4, 3, 0)


def counts_passages_exactly() -> bool:
    """Whether Cycles ends a path at the limit of transparent bounces; before 5.0 it goes through one surface more."""
    return bpy.app.version >= (5, 0, 0)


def alpha_is_by_setting() -> bool:
    """Whether an image's Alpha says what Cycles multiplies by alpha; before Blender 5.2 the image's file says it."""
    return bpy.app.version >= (5, 2, 0)


def reads_webp_multiplied() -> bool:
    """Whether OpenImageIO gives Cycles the colours of a WebP times their alpha, as it did before 3.0.7."""
    return bpy.app.oiio.version < (3, 0, 7)


def is_module() -> bool:
    """Whether Blender is a module of this Python, not a program."""
    return not bpy.app.binary_path


def corner_normals(mesh: bpy.types.Mesh) -> NDArray[np.float32]:
    """Return the shading normal of every face corner, custom normals included, (corners, 3)."""
    normals = np.empty(len(mesh.loops) * 3, dtype=np.float32)
    mesh.corner_normals.foreach_get("vector", normals)
    return normals.reshape(-1, 3)


def rounds_beside_flat_faces() -> bool:
    """Whether the normals of smooth faces lean towards flat neighbours in Cycles where no edge of the mesh is sharp.

    Measured with 4.3 and 5.0, where they do, and 5.2, where they do not.
    """
    return bpy.app.version < (5, 2, 0)


def bends_flat_faces_as_smooth() -> bool:
    """Whether Displacement and Bump bends the normals that flat faces would have if they were smooth.

    Before, it bends those of their planes (`svm_node_enter_bump_eval`).
    """
    return bpy.app.version >= (5, 0, 0)


def gives_below_zero() -> bool:
    """Whether a negative emission of a Principled BSDF takes light away, as that of Emission does; not from 5.0 on."""
    return bpy.app.version < (5, 0, 0)


def keeps_data_below_subdivision() -> bool:
    """Whether in renders a Subdivision that is the last modifier keeps the custom properties of the mesh.

    Blender 4.3 loses them, 5.0 and 5.2 keep them; what is between was not tried.
    """
    return bpy.app.version >= (5, 0, 0)


def save_as_multilayer(settings: bpy.types.ImageFormatSettings) -> None:
    """Let renders be written as uncompressed 32-bit multilayer EXR (a media type of its own from Blender 5.0 on)."""
    if hasattr(settings, "media_type"):
        settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    settings.color_depth, settings.exr_codec = "32", "NONE"
