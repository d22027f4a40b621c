# SPDX-License-Identifier: Apache-2.0
"""Blender's lights as Cycles has them, where Mitsuba has no equal emitter."""
