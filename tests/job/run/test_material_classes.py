# SPDX-License-Identifier: Apache-2.0
"""From what another class of material a fit begins again, and what its result is."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.job.run import class_trials as module
from mfo_backend.job.run.material_classes import (
    brightest_glow,
    changed,
    is_better,
    is_worth_another,
    other_classes,
    parameters_of,
    value_of,
    values_of_classes,
    with_values_of,
)
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.verdict import Cause, Verdict
from tests.job.run.fits import fitted, judgement, material, named


def result(judged, model="blender_principled"):
    return SimpleNamespace(judgement=judged, model=model)


@pytest.mark.parametrize(
    ("values", "others"),
    [
        ({}, ["under a tinted coat", "under a thin film", "as rough as clay", "of glass", "cut out"]),
        # which a fit of `all` changes
        (
            {"Coat_Tint": (0.5, 0.8, 0.9), "Diffuse_Roughness": 0.1, "Thin_Film_Thickness": 90.0},
            ["of glass", "cut out"],
        ),
        ({"Transmission_Weight": 1.0}, ["cut out", "opaque"]),
        ({"Transmission_Weight": 1.0, "Metallic": 0.6}, ["of glass", "cut out", "opaque"]),
        # a fit of `all` holds alpha, so the own class is another
        ({"Alpha": 0.5}, ["cut out", "of glass", "opaque"]),
    ],
)
def test_the_other_classes_are_tried(values, others):
    assert [other.name for other in other_classes(material(**values), 0.0)] == others
    own = others[:1] if "Alpha" in values else []
    glowing = [other.name for other in other_classes(material(**values), 2.0)]
    assert glowing == [*own, "glowing", *others[len(own) :]]


def of_mesh(amount=0.0, *, linked=False):
    """A material whose meshes hold tangents."""
    own = material(Anisotropic=amount)
    own["sockets"]["Tangent"] = {"value": [0.0] * 3, "linked": linked, "mesh": True}
    return own


def test_a_brushed_one_is_tried_where_the_meshes_hold_tangents():
    plain = of_mesh()
    brushed = named("brushed", plain)
    assert "brushed" not in [other.name for other in other_classes(material(Anisotropic=0.0), 0.0)]
    assert "brushed" not in [other.name for other in other_classes(of_mesh(0.3, linked=True), 0.0)]
    again = changed(plain, brushed)
    assert value_of(again, "anisotropic") > 0.5
    assert again["sockets"]["Tangent"]["linked"]
    assert not changed(plain, named("as rough as clay"))["sockets"]["Tangent"]["linked"]
    assert "anisotropic" in values_of_classes(plain)
    # of what is cut out, or a mix, no fit begins again from a brushed one
    cut_out = of_mesh()
    cut_out["sockets"]["Alpha"] = {"value": 0.5, "linked": False}
    for other in (cut_out, plain | {"leaves": [{}]}, material(Anisotropic=0.0), None):
        assert "anisotropic" not in values_of_classes(other)
    assert parameters_of(brushed, ("roughness", "ior")) == ["roughness", "anisotropic", "anisotropic_rotation"]


def test_a_class_begins_with_its_own_values_and_the_scenes_others():
    own = material(Metallic=0.6, Roughness=0.5, Coat_Weight=0.3)
    glass = changed(own, named("of glass", own))
    assert value_of(glass, "transmission_weight") == 1.0
    assert value_of(glass, "metallic") == 0.0
    assert value_of(glass, "coat_weight") == 0.3
    assert value_of(own, "metallic") == 0.6
    assert value_of(own, "transmission_weight") == 0.0  # Blender's own


def test_a_link_decides_a_class():
    own = material(Alpha=1.0, Transmission_Weight=0.0)
    own["sockets"]["Alpha"]["linked"] = True
    assert other_classes(own, 0.0) == []


def test_a_cut_out_fits_how_much_there_is_of_it_but_no_glass():
    cut_out = named("cut out")
    assert parameters_of(cut_out, ("base_color", "ior", "transmission_weight")) == ["base_color", "alpha"]
    assert parameters_of(named("of glass"), ("base_color",)) == "all"


def test_another_class_is_worth_it_where_the_material_may_be_wrong():
    """A glass that bends nothing may be a surface that is cut out, though it is the same."""
    wrong = judgement(Verdict.DIFFERENT, Cause.MATERIAL)
    assert is_worth_another(result(wrong), "all")
    same = SimpleNamespace(judgement=judgement(Verdict.SAME), model="blender_principled", recovered={})
    assert not is_worth_another(same, "all")
    for ior, is_straight in ((1.01, True), (1.45, False)):
        same.recovered = {"transmission_weight": 0.68, "ior": ior}
        assert is_worth_another(same, "all") is is_straight
    assert not is_worth_another(result(judgement(Verdict.DIFFERENT, Cause.PICTURE)), "all")
    assert not is_worth_another(result(judgement(Verdict.CLOSE, Cause.NOISE)), "all")
    assert not is_worth_another(result(None), "all")
    assert not is_worth_another(result(wrong), "reduced")  # the user holds transmission and alpha
    assert not is_worth_another(result(wrong), ("base_color",))
    assert not is_worth_another(result(wrong, "mitsuba_principled"), "all")


def test_further_lobes_do_not_explain_what_differs_around_the_target():
    """A picture that a compositor had made brighter took three fits more."""
    around = judgement(Verdict.DIFFERENT, Cause.LIGHT)
    assert not named("as rough as clay").may_explain(around)
    assert named("of glass").may_explain(around)  # which has another shadow
    assert named("as rough as clay").may_explain(judgement(Verdict.DIFFERENT, Cause.MATERIAL))
    tried = []
    glowing, clay = named("glowing"), named("as rough as clay")
    first = replace(fitted(0.2), result=replace(fitted(0.2).result, judgement=around))

    def again(other):
        tried.append(other.name)
        return fitted(0.3)

    module.with_other_classes(first, material(), [glowing, clay], again, lambda found: True)
    assert tried == ["glowing"]


def test_only_a_clearly_better_class_takes_the_place_of_the_scenes():
    first = judgement(Verdict.DIFFERENT, Cause.MATERIAL, 0.2)
    glowing, glass = named("glowing"), named("of glass")
    assert is_better(judgement(Verdict.CLOSE, Cause.MATERIAL, 0.08), first, glass)
    assert not is_better(judgement(Verdict.DIFFERENT, Cause.MATERIAL, 0.12), first, glass)
    assert not is_better(None, first, glass)
    assert not is_better(judgement(Verdict.SAME, None, 0.01), judgement(Verdict.SAME, None, 0.015), glass)
    # a glow stands for a lamp that is missing, but not for its light around the target
    assert is_better(judgement(Verdict.CLOSE, Cause.LIGHT, 0.02), first, glass)
    assert not is_better(judgement(Verdict.CLOSE, Cause.LIGHT, 0.02), first, glowing)
    assert is_better(judgement(Verdict.SAME, None, 0.02), first, glowing)


def test_a_glow_is_sought_below_what_the_target_shows():
    target = np.array([[True, True, True, False]])
    linear = Image(
        np.array([[[0.1, 0.2, 0.4], [0.1, 0.3, 0.1], [5.0, 0.3, 0.3], [9.0, 9.0, 9.0]]], np.float32), Encoding.LINEAR
    )
    assert brightest_glow(linear, DisplayView(), target) == pytest.approx(0.6)
    shown = Image(np.full((1, 4, 3), 0.5, np.float32), Encoding.SRGB)
    assert brightest_glow(shown, DisplayView(exposure_ev=1.0), target) == pytest.approx(0.214, abs=1e-3)
    assert brightest_glow(Image(np.zeros((1, 4, 3), np.float32), Encoding.LINEAR), DisplayView(), target) == 0.0


def test_a_glow_is_written_as_a_full_colour_and_a_strength():
    own = material(Transmission_Weight=0.5)
    glowing = named("glowing", own)
    changes = parameters_of(glowing, ("base_color", "coat_weight", "transmission_weight", "ior"))
    assert changes == ["base_color", "coat_weight", "emission_color"]
    fit = fitted(0.02).result
    sure = {"emission_color": Certainty((0.01, 0.02, 0.01), Level.WEAK)}
    fit = replace(fit, recovered={"emission_color": (0.1, 0.25, 0.05), "metallic": 0.0}, certainty=sure)
    found = with_values_of(glowing, fit, own)
    # the glass has been left out, which the material has to be told
    assert found.recovered == {
        "emission_color": pytest.approx((0.4, 1.0, 0.2)), "metallic": 0.0, "transmission_weight": 0.0,
        "emission_strength": pytest.approx(1.0),
    }  # fmt: skip
    assert found.certainty["emission_color"].sd == pytest.approx((0.04, 0.08, 0.04))
    assert found.certainty["emission_strength"].sd == pytest.approx((0.08,))
    assert set(found.bounds) == set(found.recovered)


@pytest.mark.parametrize(
    ("peak", "level", "said"),
    [
        (0.5, Level.DETERMINED, Level.DETERMINED),
        (0.5, Level.DOUBTFUL, Level.DOUBTFUL),
        (0.1, Level.DETERMINED, Level.WEAK),
        (0.1, Level.DOUBTFUL, Level.WEAK),
        (0.1, Level.NOT_TOLD_APART, Level.NOT_TOLD_APART),
        (0.005, Level.DETERMINED, Level.NOT_TOLD_APART),  # next to no glow has no colour
    ],
)
def test_the_colour_of_a_faint_glow_is_not_sure(peak: float, level: Level, said: Level) -> None:
    """A glow of 0.015 had the colour (1, 0.39, 0) +- 1.3, called determined."""
    own = material()
    fit = fitted(0.02).result
    sure = {"emission_color": Certainty((0.002, 0.004, 0.001), level)}
    fit = replace(fit, recovered={"emission_color": (0.4 * peak, peak, 0.2 * peak)}, certainty=sure)
    found = with_values_of(named("glowing", own), fit, own).certainty["emission_color"]
    assert found.sd == pytest.approx((0.002 / peak, 0.004 / peak, 0.001 / peak))
    assert found.level is said


def test_of_a_glow_whose_colour_nodes_give_the_strength_is_sought():
    own = material(Emission_Color=[0.1, 0.5, 0.25])
    own["sockets"]["Emission Color"]["linked"] = True
    glowing = other_classes(own, 4.0)[0]
    assert glowing.sockets["Emission Strength"] == 8.0  # the mean colour is as bright as the class is
    assert "Emission Color" not in glowing.sockets
    assert parameters_of(glowing, ("base_color",)) == ["base_color", "emission_strength"]
    fit = replace(fitted(0.02).result, recovered={"emission_strength": 3.0}, certainty={})
    assert with_values_of(glowing, fit, own).recovered == {"emission_strength": 3.0}
    own["sockets"]["Emission Strength"] = {"value": 1.0, "linked": True}
    assert "glowing" not in [other.name for other in other_classes(own, 4.0)]
