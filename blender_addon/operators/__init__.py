# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user or a script can do: check, fit, cancel, apply, revert, go back in the history, look at pictures."""

from . import apply, check, cycles, fit, history, pictures

CLASSES = (
    *check.CLASSES,
    *fit.CLASSES,
    *apply.CLASSES,
    *history.CLASSES,
    *cycles.CLASSES,
    *pictures.CLASSES,
)
