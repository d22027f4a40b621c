# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of every property of Blender that could change Cycles' picture: `rules` says how, the rest is data."""
