# SPDX-License-Identifier: GPL-3.0-or-later
"""Material Fit: the extension Blender loads; everything is in `blender_addon`."""

from .blender_addon import register, unregister

__all__ = ["register", "unregister"]
