# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user or a script can do: fit, cancel, check, apply, revert, look at pictures and report."""

from . import apply, fit, pictures

CLASSES = (*fit.CLASSES, *apply.CLASSES, *pictures.CLASSES)
