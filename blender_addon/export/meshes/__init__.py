# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's meshes as triangles."""
