# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole scene: read, baked where Mitsuba has no like of it, written as scene.xml."""
