# SPDX-License-Identifier: Apache-2.0
"""Oracle: fits that leave a group out."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.solve.leverage import MOST_LEVERAGE, SEEN, residuals_left_out


@pytest.mark.parametrize("groups", [12, 200])
def test_residuals_are_those_of_fits_without_the_group(groups):
    rng = np.random.default_rng(0)
    derivatives = rng.normal(size=(groups, 3, 4)) * np.exp(rng.normal(size=(groups, 1, 1)))
    noise = rng.normal(size=(groups, 3))
    rows = derivatives.reshape(-1, 4)
    inverse = np.linalg.inv(rows.T @ rows)
    residual = noise - derivatives @ (inverse @ rows.T @ noise.ravel())
    found = residuals_left_out(derivatives, residual[:, :, None], inverse)[:, :, 0]
    leverage = np.einsum("gnk,kl,gnl->g", derivatives, inverse, derivatives)
    for g in np.flatnonzero(leverage < MOST_LEVERAGE):
        others = np.delete(np.arange(groups), g)
        x = np.linalg.lstsq(derivatives[others].reshape(-1, 4), noise[others].ravel(), rcond=None)[0]
        expected = noise[g] - derivatives[g] @ x
        # groups of no leverage are left as they are
        np.testing.assert_allclose(found[g], expected, rtol=1e-9, atol=2.0 * SEEN * np.abs(expected).max())


def test_a_group_that_rules_a_value_alone_counts_ten_times_at_most():
    derivatives = np.zeros((5, 1, 2))
    derivatives[0, 0, 0] = 1.0  # nobody else sees the first value
    derivatives[1:, 0, 1] = 1.0
    inverse = np.linalg.inv(np.einsum("gnk,gnl->kl", derivatives, derivatives))
    found = residuals_left_out(derivatives, np.full((5, 1, 1), 0.1), inverse)[:, 0, 0]
    np.testing.assert_allclose(found, [1.0, *[0.1 / 0.75] * 4])
