# SPDX-License-Identifier: Apache-2.0
"""One finding of `mfo doctor`."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One finding. `state` is ok, warning (works, but) or problem (the backend cannot run); `cure` mends it."""

    name: str
    state: str
    found: str
    cure: str = ""
