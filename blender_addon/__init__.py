# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender side: export a job, run the backend beside Blender, write the recovered values onto the material."""


def register() -> None:
    """Add the classes and properties of the extension to Blender."""


def unregister() -> None:
    """Take everything `register` added away again."""
