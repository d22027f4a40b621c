# SPDX-License-Identifier: Apache-2.0
"""stdout as the protocol channel: whatever else prints, Python or native code, ends up on stderr."""

from __future__ import annotations

import os
import sys
from typing import TextIO


def take_stdout() -> TextIO:
    """The process' stdout as a line-buffered UTF-8 stream of its own; file descriptor 1 leads to stderr from now on."""
    sys.stdout.flush()
    own = os.dup(1)  # not inherited by children, so none of them can hold the protocol open
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    return os.fdopen(own, "w", encoding="utf-8", newline="\n", buffering=1)
