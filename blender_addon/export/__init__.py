# SPDX-License-Identifier: GPL-3.0-or-later
"""From bpy to a job folder: scene.xml, PLY, EXR, request.json."""
