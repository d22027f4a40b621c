# SPDX-License-Identifier: Apache-2.0
"""Mitsuba: the only layer that imports mitsuba and drjit."""
