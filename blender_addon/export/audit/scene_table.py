# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of the scene, its render settings, view layers and collections, Blender 4.2 to 5.2."""

from __future__ import annotations

from .rules import Named, Owner

SCENE = Owner(
    exported="background_set camera collection compositing_node_group cycles frame_current frame_subframe node_tree "
    "objects render use_nodes view_layers view_settings world frame_current_final frame_float unit_settings "
    "display_settings sequence_editor",
    no_effect="active_clip allow_preroll annotation audio_distance_model audio_doppler_factor audio_doppler_speed "
    "audio_volume cursor cycles_curves display eevee frame_end frame_preview_end frame_preview_start "
    "frame_start frame_step gravity grease_pencil grease_pencil_settings hydra is_nla_tweakmode keying_sets "
    "keying_sets_all lock_frame_selection_to_range playback_loop_mode rigidbody_world safe_areas "
    "sequencer_colorspace_settings show_keys_from_selected_only show_subframe simulation_frame_end "
    "simulation_frame_start sync_mode time_jump_delta time_jump_unit timeline_markers tool_settings "
    "transform_orientation_slots use_audio use_audio_scrub use_custom_simulation_range use_gravity use_preview_range "
    "use_stamp_note",
)

SCENE_CYCLES = Owner(
    exported="blur_glossy caustics_reflective caustics_refractive diffuse_bounces film_exposure filter_width "
    "glossy_bounces max_bounces pixel_filter_type sample_clamp_direct sample_clamp_indirect transmission_bounces "
    "dicing_rate max_subdivisions feature_set transparent_max_bounces use_light_tree min_light_bounces "
    "min_transparent_bounces",
    # samplers, denoisers and guiding change the noise and no mean; fast GI's numbers need fast GI
    no_effect="adaptive_min_samples adaptive_threshold ao_bounces ao_bounces_render auto_scrambling_distance bake_type "
    "camera_cull_margin debug_bvh_layout debug_bvh_time_steps debug_bvh_type debug_texture_cache_preserve_unused "
    "debug_use_compact_bvh debug_use_cpu_avx2 debug_use_cpu_sse42 debug_use_cuda_adaptive_compile debug_use_hair_bvh "
    "debug_use_hip_adaptive_compile debug_use_metal_adaptive_compile debug_use_optix_debug debug_use_spatial_splits "
    "debug_use_texture_cache_eviction denoiser denoising_input_passes denoising_prefilter denoising_quality "
    "denoising_use_gpu device dicing_camera direct_light_sampling_type distance_cull_margin fast_gi_method "
    "film_transparent_roughness guiding_directional_sampling_type guiding_distribution_type "
    "guiding_roughness_threshold guiding_training_samples light_sampling_threshold "
    "offscreen_dicing_scale preview_adaptive_min_samples preview_adaptive_threshold "
    "preview_denoiser preview_denoising_input_passes preview_denoising_prefilter preview_denoising_quality "
    "preview_denoising_start_sample preview_denoising_use_gpu preview_dicing_rate preview_pause preview_samples "
    "preview_scrambling_distance rolling_shutter_duration rolling_shutter_type sample_offset sample_subset_length "
    "samples sampling_pattern scrambling_distance seed shading_system surface_guiding_probability texture_limit "
    "texture_resolution tile_size time_limit use_adaptive_sampling use_animated_seed "
    "use_auto_tile use_denoising use_deterministic_guiding use_guiding use_guiding_direct_light "
    "use_guiding_mis_weights use_layer_samples use_preview_adaptive_sampling use_preview_denoising "
    "use_sample_subset use_surface_guiding use_volume_guiding volume_biased volume_bounces volume_guiding_probability "
    "volume_max_steps volume_preview_step_rate volume_step_rate debug_use_hair_bvh "
    "denoising_start_sample",
    named={
        "use_fast_gi": Named(
            False,
            "Fast GI Approximation is on: Cycles replaces indirect light by ambient occlusion; the fit does not. Turn "
            "it off in Render Properties > Light Paths.",
        ),
        "film_transparent_glass": Named(
            False,
            "Transparent Glass is on: Cycles lets the background through glass; in the fit glass shows the world.",
        ),
        "use_camera_cull": Named(
            False, "Camera Cull is on: Cycles leaves objects outside the frame out; the fit has them."
        ),
        "use_distance_cull": Named(False, "Distance Cull is on: Cycles leaves distant objects out; the fit has them."),
        "texture_limit_render": Named(
            "OFF", "Simplify limits the size of textures in Cycles; the fit has them at full size."
        ),
        "texture_resolution_render": Named(
            1.0, "Simplify reduces the resolution of textures in Cycles; the fit has them at full size."
        ),
        # measured in 5.2: off, the default, is the picture of 5.0 (RMS 1e-5); on changes it (RMS 0.07)
        "use_pixel_jitter": Named(
            False,
            "Use Pixel Jitter, a debugging switch of Cycles, is on: it changes Cycles' picture and not the fit's.",
        ),
    },
)

# of `SCENE_CYCLES`: without Simplify in the render settings they change nothing
BY_SIMPLIFY = frozenset({"use_camera_cull", "use_distance_cull", "texture_limit_render", "texture_resolution_render"})

RENDER = Owner(
    exported="engine film_transparent pixel_aspect_x pixel_aspect_y resolution_percentage resolution_x resolution_y "
    "simplify_subdivision simplify_subdivision_render use_border use_compositing use_motion_blur use_multiview "
    "use_simplify border_max_x border_max_y border_min_x border_min_y use_crop_to_border use_sequencer "
    "use_auto_generate_texture_cache use_texture_cache",
    no_effect="anisotropic_filter bake bake_bias bake_margin bake_margin_type bake_samples bake_type bake_user_scale "
    "compositor_denoise_device compositor_denoise_final_quality compositor_denoise_preview_quality compositor_device "
    "compositor_precision dither_intensity ffmpeg file_extension filepath filter_size fps fps_base frame_map_new "
    "frame_map_old hair_subdiv hair_type has_multiple_engines image_settings is_movie_format line_thickness "
    "line_thickness_mode metadata_input motion_blur_position motion_blur_shutter motion_blur_shutter_curve ppm_base "
    "ppm_factor preview_pixel_size save_output sequencer_gl_preview simplify_child_particles "
    "simplify_child_particles_render simplify_gpencil simplify_gpencil_antialiasing simplify_gpencil_modifier "
    "simplify_gpencil_onplay simplify_gpencil_shader_fx simplify_gpencil_tint simplify_gpencil_view_fill "
    "simplify_volumes stamp_background stamp_font_size stamp_foreground stamp_note_text stereo_views threads "
    "threads_mode use_bake_clear use_bake_lores_mesh use_bake_multires "
    "use_bake_selected_to_active use_bake_user_scale use_file_extension use_high_quality_normals use_lock_interface "
    "use_new_cpu_compositor use_overwrite use_persistent_data use_placeholder use_render_cache "
    "use_sequencer_override_scene_strip use_simplify_normals use_single_layer use_spherical_stereo use_stamp_camera "
    "use_stamp_date use_stamp_filename use_stamp_frame use_stamp_frame_range use_stamp_hostname use_stamp_labels "
    "use_stamp_lens use_stamp_marker use_stamp_memory use_stamp_note use_stamp_render_time use_stamp_scene "
    "use_stamp_sequencer_strip use_stamp_time views views_format sequencer_gl_preview",
    named={
        "use_freestyle": Named(
            False,
            "Freestyle draws lines into Cycles' picture; the fit has none: turn it off and render the reference again.",
        ),
        "use_stamp": Named(False, "Burn Into Image writes text into the picture; the fit has none."),
    },
)

VIEW_LAYER = Owner(
    exported="cycles depsgraph layer_collection material_override objects use use_sky world_override",
    no_effect="active_aov active_aov_index active_layer_collection active_lightgroup active_lightgroup_index "
    "aovs eevee "
    "freestyle_settings has_export_collections lightgroups pass_alpha_threshold pass_cryptomatte_depth samples use_ao "
    "use_freestyle use_grease_pencil use_motion_blur use_pass_ambient_occlusion use_pass_combined "
    "use_pass_cryptomatte_accurate use_pass_cryptomatte_asset use_pass_cryptomatte_material "
    "use_pass_cryptomatte_object use_pass_diffuse_color use_pass_diffuse_direct use_pass_diffuse_indirect "
    "use_pass_emit "
    "use_pass_environment use_pass_glossy_color use_pass_glossy_direct use_pass_glossy_indirect use_pass_grease_pencil "
    "use_pass_material_index use_pass_mist use_pass_normal use_pass_object_index use_pass_position use_pass_shadow "
    "use_pass_subsurface_color use_pass_subsurface_direct use_pass_subsurface_indirect use_pass_transmission_color "
    "use_pass_transmission_direct use_pass_transmission_indirect use_pass_uv use_pass_vector use_pass_z use_strand "
    "use_volumes",
    named={
        "use_solid": Named(
            True, "View layer '{owner}' leaves surfaces out (Filter > Surfaces): turn them on.", stops=True
        ),
    },
)

VIEW_LAYER_CYCLES = Owner(
    no_effect="denoising_pass_follow_reflections denoising_pass_use_albedo_roughness_weighting denoising_store_passes "
    "pass_debug_sample_count pass_render_time use_denoising use_pass_shadow_catcher use_pass_volume_direct "
    "use_pass_volume_indirect use_pass_volume_majorant use_pass_volume_scatter use_pass_volume_transmit",
)

LAYER_COLLECTION = Owner(
    exported="children collection exclude indirect_only",
    no_effect="hide_viewport is_visible name",
    named={
        "holdout": Named(
            False, "Collection '{owner}' is a holdout: Cycles cuts its objects out; in the fit they are objects."
        ),
    },
)

COLLECTION = Owner(
    exported="all_objects children hide_render hide_viewport objects instance_offset",
    no_effect="active_exporter_index collection_children collection_objects color_tag exporters hide_select "
    "lineart_intersection_mask lineart_intersection_priority lineart_usage lineart_use_intersection_mask "
    "use_lineart_intersection_priority",
)
