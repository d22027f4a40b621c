# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on and its backend say at run time, in German: `{}` are the parts put in, numbered where they move."""

from .fit import FIT
from .panel import PANEL
from .scene import SCENE

GERMAN = {**PANEL, **SCENE, **FIT}
