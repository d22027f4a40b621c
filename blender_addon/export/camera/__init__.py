# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's camera, and what it sees of a mesh."""
