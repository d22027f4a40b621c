# SPDX-License-Identifier: GPL-3.0-or-later
"""All that an artist reads, in French: `{}` are the parts put in, numbered where they move."""

from .fit import FIT
from .labels import LABELS, OPERATORS
from .panel import PANEL
from .report import REPORT
from .scene import SCENE

LOCALES = ("fr", "fr_FR")  # what Blender 4.2, and what later ones call it
JOINTS = {" and ": " et ", " or ": " ou "}
SENTENCES = {**PANEL, **SCENE, **FIT}

__all__ = ["JOINTS", "LABELS", "LOCALES", "OPERATORS", "REPORT", "SENTENCES"]
