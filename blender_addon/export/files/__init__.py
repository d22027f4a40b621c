# SPDX-License-Identifier: GPL-3.0-or-later
"""The formats an export writes: EXR, PNG, PLY, Mitsuba XML, and the folder they lie in."""
