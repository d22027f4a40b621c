# SPDX-License-Identifier: Apache-2.0
"""When a fit begins again from another class of material, from what, and which result counts."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from mfo_backend.job.material_classes import (
    changed,
    is_better,
    is_worth_another,
    other_classes,
    parameters_of,
    value_of,
)
from mfo_backend.types.verdict import Cause, Difference, Judgement, Verdict


def material(**values):
    return {"sockets": {name.replace("_", " "): {"value": value, "linked": False} for name, value in values.items()}}


def judgement(verdict, cause=None, visible=0.2):
    return Judgement(verdict, cause, Difference(visible + 0.05, 0.05, visible / 2.0, visible / 3.0, visible / 2.0))


def result(judged, model="blender_principled"):
    return SimpleNamespace(judgement=judged, model=model)


@pytest.mark.parametrize(
    ("values", "others"),
    [
        ({}, ["of glass", "cut out"]),
        ({"Transmission_Weight": 1.0}, ["cut out", "opaque"]),
        ({"Transmission_Weight": 1.0, "Metallic": 0.6}, ["of glass", "cut out", "opaque"]),
        ({"Alpha": 0.5}, ["of glass", "opaque"]),
    ],
)
def test_the_other_classes_are_tried(values, others):
    assert [other.name for other in other_classes(material(**values))] == others


def test_a_class_begins_with_its_own_values_and_the_scenes_others():
    own = material(Metallic=0.6, Roughness=0.5, Coat_Weight=0.3)
    glass = changed(own, other_classes(own)[0])
    assert value_of(glass, "transmission_weight") == 1.0
    assert value_of(glass, "metallic") == 0.0
    assert value_of(glass, "coat_weight") == 0.3
    assert value_of(own, "metallic") == 0.6
    assert value_of(own, "transmission_weight") == 0.0  # Blender's own


def test_a_link_decides_a_class():
    own = material(Alpha=1.0, Transmission_Weight=0.0)
    own["sockets"]["Alpha"]["linked"] = True
    assert other_classes(own) == []


def test_a_cut_out_fits_how_much_there_is_of_it_but_no_glass():
    cut_out = other_classes(material())[1]
    assert parameters_of(cut_out, ("base_color", "ior", "transmission_weight")) == ["base_color", "alpha"]
    assert parameters_of(other_classes(material())[0], ("base_color",)) == "all"


def test_another_class_is_worth_it_where_the_material_may_be_wrong():
    wrong = judgement(Verdict.DIFFERENT, Cause.MATERIAL)
    assert is_worth_another(result(wrong), "all")
    assert not is_worth_another(result(judgement(Verdict.SAME)), "all")
    assert not is_worth_another(result(judgement(Verdict.DIFFERENT, Cause.PICTURE)), "all")
    assert not is_worth_another(result(None), "all")
    assert not is_worth_another(result(wrong), "reduced")  # the user holds transmission and alpha
    assert not is_worth_another(result(wrong), ("base_color",))
    assert not is_worth_another(result(wrong, "mitsuba_principled"), "all")


def test_only_a_clearly_better_class_takes_the_place_of_the_scenes():
    first = judgement(Verdict.DIFFERENT, Cause.MATERIAL, 0.2)
    assert is_better(judgement(Verdict.CLOSE, Cause.MATERIAL, 0.08), first)
    assert not is_better(judgement(Verdict.DIFFERENT, Cause.MATERIAL, 0.12), first)
    assert not is_better(None, first)
    assert not is_better(judgement(Verdict.SAME, None, 0.01), judgement(Verdict.SAME, None, 0.015))
