# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user or a script can do: set up the backend, fit, cancel, check, apply, revert, look at pictures."""

from . import apply, backend, fit, pictures

CLASSES = (*fit.CLASSES, *apply.CLASSES, *pictures.CLASSES, *backend.CLASSES)
