# SPDX-License-Identifier: Apache-2.0
"""Which languages must have every sentence; the others may lag behind, and what they lack is shown in English."""

from __future__ import annotations

import re

COMPLETE = ("de",)
# words that neither language has, to find what was left
ENGLISH = re.compile(r"\b(the|is|are|not|of|and|with|it|be|to|or|has|have|which|that|from|its|for|at|by)\b")
