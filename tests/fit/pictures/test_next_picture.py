# SPDX-License-Identifier: Apache-2.0
"""What a proposal promises of values whose deviations before and after a further picture are given."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.pictures.next_picture import Choice, _proposal
from mfo_backend.types.parameter import Parameter, ParameterTable

TABLE = ParameterTable([Parameter("roughness", 1, 0.0, 1.0, 0.5), Parameter("coat_weight", 1, 0.0, 1.0, 0.5)])


@pytest.mark.parametrize(
    ("before", "after", "settles", "ends"),
    [
        ((0.2, 0.3), (0.01, 0.1), ("roughness",), "would settle Roughness."),
        ((0.2, 0.3), (0.05, 0.2), (), "would make Roughness surer."),
        # undetermined for another reason than its deviation, as a rival: this hardly falls
        ((0.012, 0.3), (0.008, 0.1), (), "would make Coat Weight surer."),
    ],
)
def test_what_a_picture_settles_is_what_falls(before, after, settles, ends):
    found = _proposal(Choice(turn=60.0), np.zeros(3), np.array(after), np.array(before), TABLE.names, TABLE)
    assert found is not None
    assert found.settles == settles
    assert found.sentence.endswith(ends)


def test_where_no_deviation_falls_nothing_is_proposed():
    assert (
        _proposal(Choice(turn=60.0), np.zeros(3), np.array([0.015, 0.2]), np.array([0.019, 0.3]), TABLE.names, TABLE)
        is None
    )
