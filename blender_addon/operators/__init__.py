# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user or a script can do: set up the backend, choose pictures, check, fit, apply, revert, go back, compare."""

from . import apply, asset, backend, check, cycles, fit, history, materials, more_pictures, part, pictures, reference

CLASSES = (
    *reference.CLASSES,
    *part.CLASSES,
    *more_pictures.CLASSES,
    *materials.CLASSES,
    *check.CLASSES,
    *fit.CLASSES,
    *apply.CLASSES,
    *asset.CLASSES,
    *history.CLASSES,
    *cycles.CLASSES,
    *pictures.CLASSES,
    *backend.CLASSES,
)
