# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit that runs, those that wait, and what follows when Blender changes something."""
