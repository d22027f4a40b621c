# SPDX-License-Identifier: Apache-2.0
"""Verdicts of materials that were fitted together: what does not count in the reference says nothing of them."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.materials import judged_materials
from mfo_backend.fit.materials.judged_materials import fit_together
from mfo_backend.types.image import Encoding, Image

from .test_rounds import SHOWN, Fits, members, turns


def test_what_a_crop_leaves_out_is_no_error_beside_it(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = np.ones((4, 8), bool)
    counts[:, 6:] = False
    pixels = np.where(counts[..., None], SHOWN.pixels, np.float32(5.0))  # something else altogether
    found = turns(Fits(), monkeypatch)
    monkeypatch.setattr(judged_materials, "take_turns", lambda *_, **__: found)
    together = fit_together(
        members(3), Image(pixels, Encoding.LINEAR, counts=counts), display=None,
        listener=lambda event: None, should_stop=lambda: False,
    )  # fmt: skip
    for outcome in together.outcomes:
        before, after = outcome.result.errors["flip"]
        assert after < 0.01 < before
