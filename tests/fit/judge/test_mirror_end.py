# SPDX-License-Identifier: Apache-2.0
"""Ends at the least roughness, which a picture without any may take the place of."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.judge.mirror_end import as_mirror
from mfo_backend.fit.result.outcome import End
from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.parameter import Parameter, ParameterTable

NAMES = ("base_color", "metallic", "roughness")
TABLE = ParameterTable(BLENDER_PRINCIPLED[name] for name in NAMES)


def end(roughness: float, sd: float = 0.004, level: Level = Level.DETERMINED) -> End:
    x = TABLE.with_values(TABLE.lower, base_color=0.5, metallic=1.0, roughness=roughness)
    return End(
        "refine", x, {"roughness": Certainty((sd,), level, ("metallic",)), "metallic": Certainty((0.01,), level)}
    )


@pytest.mark.parametrize(("roughness", "is_asked"), [(0.05, True), (0.0999, True), (0.101, False)])
def test_a_mirror_is_asked_for_where_an_end_is_nearly_one(roughness, is_asked):
    mirror = as_mirror(end(roughness), TABLE)
    assert (mirror is not None) is is_asked
    if mirror is not None:
        assert TABLE.unpack(mirror.x) == TABLE.unpack(end(roughness).x) | {"roughness": 0.0}
        assert mirror.certainty["roughness"] == Certainty((roughness,), Level.WEAK, ("metallic",))
        assert mirror.certainty["metallic"] == end(roughness).certainty["metallic"]


def test_what_is_less_sure_stays_so():
    mirror = as_mirror(end(0.05, 0.3, Level.NOT_TOLD_APART), TABLE)
    assert mirror is not None
    assert mirror.certainty["roughness"] == Certainty((0.3,), Level.NOT_TOLD_APART, ("metallic",))


def test_a_value_that_was_kept_stays():
    assert as_mirror(end(0.05, 0.3, Level.NOT_VISIBLE), TABLE) is None


def test_a_limit_of_the_users_holds():
    limited = ParameterTable(
        Parameter("roughness", 1, 0.1, 1.0, 0.5) if name == "roughness" else BLENDER_PRINCIPLED[name] for name in NAMES
    )
    at, known = limited.with_values(limited.lower, roughness=0.1), end(0.05).certainty
    assert as_mirror(End("refine", at, known), limited) is None
    held = ParameterTable([BLENDER_PRINCIPLED["metallic"]])
    assert as_mirror(End("refine", np.zeros(1), known), held) is None
