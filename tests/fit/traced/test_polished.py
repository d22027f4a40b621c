# SPDX-License-Identifier: Apache-2.0
"""Which values of a polished glass go back to the user's, on covariances made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.traced.polished import Polished, without_lobe
from mfo_backend.solve.bounded_least_squares import NormalEquations
from mfo_backend.types.parameter import Parameter, ParameterTable

TABLE = ParameterTable(
    Parameter(name, size, 0.0, 1.0, 0.0)
    for name, size in (("base_color", 3), ("roughness", 1), ("coat_weight", 1), ("sheen_weight", 1), ("sheen_tint", 3))
)
USER = TABLE.pack({"base_color": (0.5,) * 3, "roughness": 0.0, "coat_weight": 0.0, "sheen_weight": 0.0,
                   "sheen_tint": (0.3,) * 3})  # fmt: skip

NONE = TABLE.mask_of(())


def polished(values, sd, kept=(), tied=()):
    """An end at `values` with standard deviations `sd` (0.001 for the others); `tied` values err together."""
    x = TABLE.pack({**TABLE.unpack(USER), **values})
    spread = np.full(TABLE.length, 0.001)
    for name, value in sd.items():
        spread[TABLE.slice_of(name)] = value
    correlation = np.eye(TABLE.length)
    for one in tied:
        for other in tied:
            if one != other:
                correlation[TABLE.slice_of(one), TABLE.slice_of(other)] = 0.95  # a safe matrix knows no more
    covariance = correlation * np.outer(spread, spread)
    hessian = np.linalg.inv(covariance)
    return Polished(
        x, covariance, TABLE.mask_of(kept), TABLE.mask_of(()), NormalEquations(0.0, 0.0 * x, hessian), hessian
    )


@pytest.mark.parametrize(
    ("values", "sd", "tied", "expected"),
    [
        ({"coat_weight": 0.1, "sheen_weight": 0.1}, {"coat_weight": 0.05, "sheen_weight": 0.02}, (), ["coat_weight"]),
        ({"coat_weight": 0.1}, {"coat_weight": 0.03}, (), ["sheen_weight"]),  # 3.3 deviations; no sheen was found
        # each alone may be 0, both together not: their sum is known
        ({"coat_weight": 0.1, "sheen_weight": -0.1}, dict.fromkeys(("coat_weight", "sheen_weight"), 0.05),
         ("coat_weight", "sheen_weight"), ["coat_weight"]),
        # the roughness of the glass may be the user's by chance, and the tint is not off in the user's material
        ({"roughness": 0.1}, {"roughness": 0.1, "sheen_tint": 0.4}, (), ["coat_weight", "sheen_weight"]),
    ],
)  # fmt: skip
def test_lobes_that_no_three_deviations_ask_for_are_off(values, sd, tied, expected):
    np.testing.assert_array_equal(polished(values, sd, tied=tied).unneeded(TABLE, USER, NONE), TABLE.mask_of(expected))


@pytest.mark.parametrize("detail_goes_back", [False, True])
def test_a_lobe_whose_details_go_back_is_asked_for_with_these(detail_goes_back):
    # 2.5 deviations from none while another value may be anything; at the user's value of that 0.1 is 0.1 / 0.04 * 3.2
    both = ("coat_weight", "roughness")
    end = polished({"coat_weight": 0.1}, dict.fromkeys(both, 0.04), tied=both)
    unseen = TABLE.mask_of(["roughness"]) if detail_goes_back else NONE
    assert end.unneeded(TABLE, USER, unseen)[TABLE.slice_of("coat_weight")].all() != detail_goes_back


def test_only_amounts_that_are_well_known_can_be_told_from_none():
    end = polished({"coat_weight": 0.2, "sheen_weight": 0.01}, {"coat_weight": 0.1, "sheen_weight": 0.02})
    np.testing.assert_array_equal(end.unneeded(TABLE, USER, NONE, 0.05), TABLE.mask_of(["sheen_weight"]))


def test_values_that_are_not_determined_go_back_until_the_rest_is_sure():
    end = polished({}, {"sheen_weight": 0.2, "sheen_tint": 0.5, "coat_weight": 0.1})
    np.testing.assert_array_equal(end.undetermined(TABLE, USER), TABLE.mask_of(["sheen_weight", "sheen_tint"]))
    # two values that only together are unknown: one is taken for known, then the other is
    tied = polished({}, dict.fromkeys(("coat_weight", "sheen_weight"), 0.2), tied=("coat_weight", "sheen_weight"))
    assert tied.undetermined(TABLE, USER).sum() == 1


@pytest.mark.parametrize(("found", "goes_back"), [(0.4, True), (0.8, False)])
def test_a_lobe_that_is_surely_there_stays_however_unsure_its_amount(found, goes_back):
    end = polished({"coat_weight": found}, {"coat_weight": 0.2})  # two and four deviations from the user's
    assert end.undetermined(TABLE, USER).any() == goes_back


def test_details_go_back_with_their_lobe():
    kept = TABLE.mask_of(["sheen_weight"])
    np.testing.assert_array_equal(without_lobe(kept, TABLE, USER), TABLE.mask_of(["sheen_tint"]))
    there = TABLE.pack({**TABLE.unpack(USER), "sheen_weight": 0.5})  # kept as the user's, who has one
    assert not without_lobe(kept, TABLE, there).any()


def test_the_glass_itself_goes_back_only_where_nothing_else_does():
    sd = {"roughness": 0.3, "sheen_tint": 0.5}
    np.testing.assert_array_equal(polished({}, sd).undetermined(TABLE, USER), TABLE.mask_of(["sheen_tint"]))
    np.testing.assert_array_equal(
        polished({}, sd, kept=["sheen_tint"]).undetermined(TABLE, USER), TABLE.mask_of(["roughness"])
    )


def test_what_was_kept_is_named_once():
    end = polished({}, {"sheen_weight": 0.2, "coat_weight": 0.1}, kept=["sheen_weight", "coat_weight"])
    assert not end.undetermined(TABLE, USER).any()
    assert not end.unneeded(TABLE, USER, NONE).any()


def test_without_equations_nothing_goes_back_as_undetermined():
    end = Polished(USER, np.eye(TABLE.length), TABLE.mask_of(()), TABLE.mask_of(()), None, np.eye(TABLE.length))
    assert not end.undetermined(TABLE, USER).any()
