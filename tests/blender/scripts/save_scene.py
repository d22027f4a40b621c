# SPDX-License-Identifier: Apache-2.0
"""Save the start-up scene at the size of the fake backend's pictures."""

import sys

import bpy

bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 96, 64
bpy.context.scene.view_settings.view_transform = "Standard"
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[sys.argv.index("--") + 1])
