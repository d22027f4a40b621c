# SPDX-License-Identifier: Apache-2.0
"""Blender's Principled BSDF: its values, its layers, and directions drawn from it."""
