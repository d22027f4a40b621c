# SPDX-License-Identifier: Apache-2.0
"""Names of losses: kinds, ranges, aliases, and what is refused."""

from __future__ import annotations

import pytest

from mfo_backend.metrics.losses.loss_names import KINDS, LOSS_NAMES, OPTIONAL_LOSS_NAMES, is_squared, loss_in_range
from mfo_backend.types.errors import BadInputError


def test_every_loss_is_reached_by_its_kind_and_by_its_full_name():
    for name in LOSS_NAMES + OPTIONAL_LOSS_NAMES:
        kind, dynamic_range = name.split("-")
        assert kind in KINDS
        assert loss_in_range(kind, dynamic_range) == name
        assert {loss_in_range(name, other) for other in ("ldr", "hdr")} == {name}


@pytest.mark.parametrize(
    ("name", "dynamic_range", "full"),
    [
        ("lpips", "ldr", "lpips_alex-ldr"),
        ("lpips", "hdr", "lpips_alex-hdr"),
        ("lpips-ldr", "hdr", "lpips_alex-ldr"),
        ("lpips_pu", "ldr", "lpips_alex-hdr"),
        ("lpips_pu_vgg", "hdr", "lpips_vgg-hdr"),
        ("log", "hdr", "log-hdr"),
        ("flip-ldr", "hdr", "flip-ldr"),
    ],
)
def test_short_names(name, dynamic_range, full):
    assert loss_in_range(name, dynamic_range) == full


def test_squared_losses_are_those_with_a_residual():
    squared = [name for name in LOSS_NAMES + OPTIONAL_LOSS_NAMES if is_squared(name)]
    assert squared == [name for name in LOSS_NAMES if not name.startswith("flip")]
    assert not is_squared("lpips")


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("ssim", "Unknown loss 'ssim': choose one of mse, pu21, itp, flip, log, relative, cvvdp, lpips_alex"),
        ("log-ldr", "no loss 'log-ldr', for log is of scene-linear values: use log-hdr"),
        ("mse-", "Unknown loss 'mse-'"),
        ("", "Unknown loss ''"),
    ],
)
def test_other_names_are_refused(name, sentence):
    with pytest.raises(BadInputError, match=sentence):
        loss_in_range(name, "ldr")


def test_a_kind_that_the_range_lacks_is_refused():
    with pytest.raises(BadInputError, match="use relative-hdr"):
        loss_in_range("relative", "ldr")
