# SPDX-License-Identifier: Apache-2.0
"""Pictures with alpha in real Blender programs: their Cycles is the oracle, for its versions differ."""

from __future__ import annotations

from pathlib import Path

import pytest

from .conftest import RealBlender

pytestmark = pytest.mark.blender
SCRIPT = Path(__file__).resolve().parent / "scripts" / "alpha_of_pictures.py"


def test_pictures_with_alpha_are_as_in_cycles_of_this_blender(blender: RealBlender) -> None:
    """Until 5.2 the file says what is multiplied, from then on the image's Alpha."""
    assert "WRONG [] of 224" in blender.run("--python-exit-code", "3", "--python", str(SCRIPT)).stdout
