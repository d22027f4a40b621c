# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of objects, meshes, worlds, lights and cameras, Blender 4.2 to 5.2."""

from __future__ import annotations

from .rules import Named, Owner

OBJECT = Owner(
    exported="active_material active_material_index constraints data delta_location delta_rotation_euler "
    "delta_rotation_quaternion delta_scale hide_render hide_viewport instance_collection instance_faces_scale "
    "instance_type is_from_instancer is_holdout is_instancer is_shadow_catcher light_linking location material_slots "
    "matrix_basis matrix_local matrix_parent_inverse matrix_world mode modifiers parent parent_bone "
    "parent_bone_head_tail_factor parent_type parent_vertices particle_systems pose rotation_axis_angle rotation_euler "
    "rotation_mode rotation_quaternion scale shadow_terminator_geometry_offset shadow_terminator_shading_offset "
    "show_instancer_for_render type use_instance_faces_scale use_instance_vertices_rotation use_parent_final_indices "
    "visible_camera visible_diffuse visible_glossy visible_shadow visible_transmission cycles vertex_groups "
    "active_shape_key active_shape_key_index show_only_shape_key use_shape_key_edit_mode use_simulation_cache "
    "add_rest_position_attribute",
    no_effect="active_selection_set animation_visualization bound_box collision color dimensions display "
    "display_bounds_type display_type empty_display_size empty_display_type empty_image_depth empty_image_offset "
    "empty_image_side field grease_pencil_modifiers hide_probe_plane hide_probe_sphere hide_probe_volume "
    "hide_select hide_surface_pick "
    "image_user is_from_set lightgroup lineart lock_location lock_rotation lock_rotation_w lock_rotations_4d "
    "lock_scale "
    "motion_path pass_index rigid_body rigid_body_constraint selection_sets shader_effects "
    "shadow_terminator_normal_offset show_all_edges show_axis show_bounds show_empty_image_only_axis_aligned "
    "show_empty_image_orthographic show_empty_image_perspective show_in_front show_instancer_for_viewport show_name "
    "show_texture_space show_transparent show_wire soft_body track_axis up_axis use_camera_lock_parent "
    "use_dynamic_topology_sculpting use_empty_image_alpha use_grease_pencil_lights use_mesh_mirror_x use_mesh_mirror_y "
    "use_mesh_mirror_z visible_raycast visible_volume_scatter",
)

OBJECT_CYCLES = Owner(
    exported="use_adaptive_subdivision dicing_rate shadow_terminator_geometry_offset shadow_terminator_offset",
    no_effect="ao_distance is_caustics_receiver motion_steps name use_camera_cull use_deform_motion "
    "use_distance_cull use_motion_blur",
    named={
        "is_caustics_caster": Named(False, "Object '{owner}' casts Shadow Caustics in Cycles, which the fit has not."),
    },
)

MESH = Owner(
    exported="attributes color_attributes corner_normals edges has_custom_normals loop_triangle_polygons "
    "loop_triangles "
    "loops materials normals_domain polygon_normals polygons shape_keys uv_layers vertex_colors vertex_normals "
    "vertices",
    no_effect="auto_texspace cycles is_editmode radial_symmetry remesh_mode remesh_voxel_adaptivity remesh_voxel_size "
    "skin_vertices texco_mesh texspace_location texspace_size texture_mesh total_edge_sel total_face_sel "
    "total_vert_sel "
    "use_auto_texspace use_mirror_topology use_mirror_vertex_groups use_mirror_x use_mirror_y use_mirror_z "
    "use_paint_bone_selection use_paint_mask use_paint_mask_vertex use_remesh_fix_poles use_remesh_preserve_attributes "
    "use_remesh_preserve_volume uv_layer_clone uv_layer_clone_index uv_layer_stencil uv_layer_stencil_index",
)

WORLD = Owner(
    exported="color cycles cycles_visibility node_tree use_nodes",
    no_effect="light_settings lightgroup mist_settings probe_resolution sun_angle sun_shadow_filter_radius "
    "sun_shadow_jitter_overblur sun_shadow_maximum_resolution sun_threshold use_eevee_finite_volume use_sun_shadow "
    "use_sun_shadow_jitter",
)

WORLD_CYCLES = Owner(
    no_effect="homogeneous_volume is_caustics_light name sample_map_resolution sampling_method volume_interpolation "
    "volume_sampling volume_step_size",
    named={
        "max_bounces": Named(
            1024, "World '{owner}' has a limit of bounces (Settings > Surface > Max Bounces), which the fit has not."
        ),
        "use_shadows": Named(True, "The light of world '{owner}' casts no shadows in Cycles; in the fit it does."),
    },
)

WORLD_VISIBILITY = Owner(
    exported="camera",
    no_effect="name scatter shadow",
    named={
        key: Named(
            True,
            f"World '{{owner}}' is hidden from {key} rays (Ray Visibility); in the fit it is not, so that values that "
            f"its {key} light shows cannot be trusted.",
        )
        for key in ("diffuse", "glossy", "transmission")
    },
)

LIGHT = Owner(
    exported="angle color cycles energy exposure node_tree normalize shadow_soft_size shape size size_y spot_blend "
    "spot_size spread temperature temperature_color type use_nodes use_shadow use_soft_falloff use_temperature",
    # the first line is of Eevee before Blender 4.3
    no_effect="contact_shadow_bias contact_shadow_distance contact_shadow_thickness shadow_buffer_bias shadow_color "
    "use_contact_shadow cutoff_distance diffuse_factor shadow_buffer_clip_start shadow_cascade_count "
    "shadow_cascade_exponent "
    "shadow_cascade_fade shadow_cascade_max_distance shadow_filter_radius shadow_jitter_overblur "
    "shadow_maximum_resolution show_cone specular_factor transmission_factor use_absolute_resolution "
    "use_custom_distance use_shadow_jitter use_square volume_factor",
)

LIGHT_CYCLES = Owner(
    exported="is_portal use_multiple_importance_sampling",
    no_effect="name is_caustics_light",
    named={
        "max_bounces": Named(1024, "Light '{owner}' has a limit of bounces (Max Bounces), which the fit has not."),
    },
)

CAMERA = Owner(
    exported="angle angle_x angle_y clip_end clip_start dof lens lens_unit ortho_scale sensor_fit sensor_height "
    "sensor_width shift_x shift_y type",
    # the rest belongs to types of camera that are refused, or to the interface
    no_effect="background_images central_cylindrical_radius central_cylindrical_range_u_max "
    "central_cylindrical_range_u_min central_cylindrical_range_v_max central_cylindrical_range_v_min "
    "composition_guide_color custom_bytecode custom_bytecode_hash custom_filepath custom_mode custom_shader cycles "
    "cycles_custom display_size fisheye_fov fisheye_lens fisheye_polynomial_k0 fisheye_polynomial_k1 "
    "fisheye_polynomial_k2 fisheye_polynomial_k3 fisheye_polynomial_k4 latitude_max latitude_min longitude_max "
    "longitude_min panorama_type passepartout_alpha show_background_images show_composition_center "
    "show_composition_center_diagonal show_composition_golden show_composition_golden_tria_a "
    "show_composition_golden_tria_b show_composition_harmony_tri_a show_composition_harmony_tri_b "
    "show_composition_thirds show_limits show_mist show_name show_passepartout show_safe_areas show_safe_center "
    "show_sensor stereo",
)
