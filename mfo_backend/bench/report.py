# SPDX-License-Identifier: Apache-2.0
"""The report of a bench folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def write_report(folder: Path, *, notes: Sequence[str] = ()) -> str:
    """Write the report into `folder` and return its text."""
    return ""
