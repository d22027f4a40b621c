# SPDX-License-Identifier: GPL-3.0-or-later
"""A second Blender on a copy of the file, which evaluates nodes for us: nothing in the user's session changes."""
