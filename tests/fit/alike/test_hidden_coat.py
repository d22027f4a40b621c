# SPDX-License-Identifier: Apache-2.0
"""How sure a material without a coat is where the truth has one, on pictures of a line with known noise."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.alike.hidden_coat import largest_covariance
from mfo_backend.fit.certainty.covariance import covariance
from mfo_backend.fit.squares.recording_noise import rows_of_samples
from tests.fit.alike import test_simplest as line_of
from tests.fit.alike.test_simplest import NAMES, TABLE, Line, solve

TRUTH = TABLE.pack(dict(zip(NAMES, (0.6, 0.5, 0.32, 0.12, 0.12), strict=True)))
ROUGHNESS, COAT_WEIGHT = 2, 3


@pytest.fixture(autouse=True)
def noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(line_of, "NOISE", 0.05)


def spread_on(line: Line):
    return lambda x: covariance(*rows_of_samples(line.evaluate.samples(x), line.residual), TABLE, 0.0)


def test_the_base_is_unsure_by_what_a_hidden_coat_may_take_from_it() -> None:
    lower, upper = TABLE.lower, TABLE.upper
    lower[COAT_WEIGHT:] = upper[COAT_WEIGHT:] = 0.0, 0.03
    sharp, hidden = [], []
    for seed in range(8):
        line = Line(TRUTH, seed)
        x = solve(line, TABLE.pack({"coat_weight": 0.0, "coat_roughness": 0.03}), (lower, upper), 40)
        spread = spread_on(line)
        off = (x - TRUTH)[ROUGHNESS] / TABLE.width[ROUGHNESS]
        sharp.append(off / np.sqrt(spread(x)[ROUGHNESS, ROUGHNESS]))
        found = largest_covariance(spread, x, TABLE)
        hidden.append(off / np.sqrt(found[ROUGHNESS, ROUGHNESS]))
        assert np.all(np.diag(found) >= np.diag(spread(x)) * (1.0 - 1e-9))
        assert np.linalg.eigvalsh(found).min() > -1e-12
    assert np.sqrt(np.mean(np.square(hidden))) < 2.0 < np.sqrt(np.mean(np.square(sharp)))


def test_a_coat_that_is_there_says_how_wide_it_is() -> None:
    spread = spread_on(Line(TRUTH))
    np.testing.assert_array_equal(largest_covariance(spread, TRUTH, TABLE), spread(TRUTH))
