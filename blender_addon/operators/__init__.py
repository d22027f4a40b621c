# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user or a script can do: set up the backend, check, fit, cancel, apply, revert, go back, look at pictures."""

from . import apply, backend, check, cycles, fit, history, more_pictures, pictures, reference

CLASSES = (
    *reference.CLASSES,
    *more_pictures.CLASSES,
    *check.CLASSES,
    *fit.CLASSES,
    *apply.CLASSES,
    *history.CLASSES,
    *cycles.CLASSES,
    *pictures.CLASSES,
    *backend.CLASSES,
)
