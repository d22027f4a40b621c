# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of materials, images and shader nodes that the export reads, Blender 4.2 to 5.2."""

from __future__ import annotations

from .rules import Named, Owner

MATERIAL = Owner(
    exported="cycles diffuse_color displacement_method node_tree use_nodes use_transparent_shadow",
    no_effect="alpha_threshold blend_method grease_pencil is_grease_pencil line_color line_priority lineart "
    "max_vertex_displacement metallic paint_active_slot paint_clone_slot pass_index preview_render_type "
    "refraction_depth "
    "roughness shadow_method show_transparent_back specular_color specular_intensity surface_render_method "
    "texture_paint_images "
    "texture_paint_slots thickness_mode use_backface_culling use_backface_culling_lightprobe_volume "
    "use_backface_culling_shadow use_preview_world use_raytrace_refraction use_screen_refraction use_sss_translucency "
    "use_thickness_from_shadow use_transparency_overlap volume_intersection_method",
)

MATERIAL_CYCLES = Owner(
    no_effect="emission_sampling homogeneous_volume name volume_interpolation volume_sampling volume_step_rate",
    named={
        "use_bump_map_correction": Named(
            True, "Bump Map Correction of material '{owner}' is off in Cycles; in the fit normals are corrected."
        ),
    },
)

IMAGE = Owner(
    exported="alpha_mode channels colorspace_settings filepath filepath_raw generated_color generated_height "
    "generated_type generated_width has_data is_dirty is_float packed_file packed_files pixels size source tiles type "
    "use_generated_float",
    no_effect="bindcode depth display_aspect file_format frame_duration is_multiview is_stereo_3d render_slots "
    "resolution seam_margin stereo_3d_format use_deinterlace use_half_precision use_multiview use_view_as_render "
    "views_format",
)

# movies, sequences and tiles are refused, and so are the frames of their users
IMAGE_USER = Owner(
    no_effect="frame_current frame_duration frame_offset frame_start multilayer_layer multilayer_pass multilayer_view "
    "tile use_auto_refresh use_cyclic"
)

COLORSPACE = Owner(exported="is_data name")

TEXTURE_MAPPING = Owner(
    exported="mapping_x mapping_y mapping_z max min rotation scale translation use_max use_min vector_type",
    no_effect="mapping",
)

# of any node; by type what it has beside these
NODE = Owner(
    exported="bl_idname inputs internal_links mute outputs type",
    no_effect="bl_description bl_height_default bl_height_max bl_height_min bl_icon bl_label bl_static_type "
    "bl_width_default bl_width_max bl_width_min color color_tag dimensions height hide label location "
    "location_absolute "
    "name panel_states parent select show_options show_preview show_texture use_custom_color warning_propagation width",
)

NODES = {
    "ShaderNodeTexImage": Owner(
        exported="extension image interpolation projection texture_mapping",
        no_effect="color_mapping image_user projection_blend",  # Cycles has no colour mapping, and boxes are refused
    ),
    "ShaderNodeTexEnvironment": Owner(
        exported="image interpolation projection texture_mapping", no_effect="color_mapping image_user"
    ),
    "ShaderNodeMapping": Owner(exported="vector_type"),
    "ShaderNodeTexCoord": Owner(exported="from_instancer", no_effect="object"),  # only UV and Generated are read
    "ShaderNodeUVMap": Owner(exported="from_instancer uv_map"),
    "ShaderNodeBsdfPrincipled": Owner(exported="distribution subsurface_method"),
    "ShaderNodeOutputMaterial": Owner(exported="is_active_output target"),
    "ShaderNodeOutputWorld": Owner(exported="is_active_output target"),
    "ShaderNodeOutputLight": Owner(exported="is_active_output target"),
    "ShaderNodeBackground": Owner(),
    "ShaderNodeEmission": Owner(),
    "ShaderNodeBsdfDiffuse": Owner(),
    "ShaderNodeBsdfTransparent": Owner(),
    "ShaderNodeBsdfAnisotropic": Owner(exported="distribution"),  # approximated with a note
    "ShaderNodeBsdfMetallic": Owner(exported="distribution fresnel_type"),  # approximated with a note
    "ShaderNodeBsdfGlass": Owner(exported="distribution"),  # approximated with a note
    "ShaderNodeValue": Owner(),
    "ShaderNodeRGB": Owner(),
    "ShaderNodeGamma": Owner(),
    "ShaderNodeInvert": Owner(),
    "ShaderNodeRGBToBW": Owner(),
    "ShaderNodeSeparateColor": Owner(exported="mode"),
    "ShaderNodeMath": Owner(exported="operation use_clamp"),
    "ShaderNodeTangent": Owner(exported="axis direction_type uv_map"),
    "ShaderNodeNewGeometry": Owner(),
}
