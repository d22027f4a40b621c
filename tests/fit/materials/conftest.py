# SPDX-License-Identifier: Apache-2.0
"""Members of these tests stand in for renderers, and nothing records them."""

from __future__ import annotations

import pytest

from mfo_backend.fit.materials import rounds


@pytest.fixture(autouse=True)
def nothing_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without scenes."""
    monkeypatch.setattr(rounds, "recorded_scene", lambda *_: None)
