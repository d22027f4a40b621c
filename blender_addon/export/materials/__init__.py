# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's materials as Mitsuba's, and the target's values in both models."""
