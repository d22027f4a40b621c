# SPDX-License-Identifier: Apache-2.0
"""Fits that begin again from other classes of material, and which result counts."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.job.run import class_trials as module
from mfo_backend.job.run import fit_scene
from mfo_backend.job.run.material_classes import (
    MOST_GLOW,
    PLAINER,
    PLAINER_GLOW,
    POLISH,
    is_rich,
    is_worth_another,
    new_layers,
    other_classes,
    without_layers,
)
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.render.sheet.contact_sheet import ContactSheet
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.errors import NoNearerError, UnrecordableError
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.result import Contradiction, StageReport
from mfo_backend.types.status import Status
from mfo_backend.types.verdict import Verdict
from tests.job.run.fits import fitted, judgement, material, named


@pytest.mark.parametrize(("verdict", "level"), [(Verdict.CLOSE, Level.WEAK), (Verdict.DIFFERENT, Level.DETERMINED)])
def test_a_class_that_takes_the_place_of_a_close_one_is_unsure_of_what_it_has_changed(verdict, level):
    """A rough glass of a third stood for a cloth that was close: two values were determined and wrong."""
    glass = named("of glass")
    sure = {name: Certainty((0.004,), Level.DETERMINED) for name in ("metallic", "transmission_weight")}
    after = fitted(0.01, Verdict.SAME)
    recovered = {"metallic": 0.45, "transmission_weight": 0.1}  # metallic 0.4 in the first fit, which had no glass
    after = replace(after, result=replace(after.result, recovered=recovered, certainty=sure))
    found = module.better(fitted(0.09, verdict), after, glass, material()).result.certainty
    assert (found["metallic"].level, found["transmission_weight"].level) == (level, level)
    assert found["metallic"].sd == pytest.approx((np.hypot(0.004, 0.05 if verdict is Verdict.CLOSE else 0.0),))


def test_a_plain_glow_takes_the_place_of_many_layers():
    layers = {"metallic": 0.9, "coat_weight": 0.9, "sheen_weight": 0.2}
    rich = fitted(0.01, Verdict.SAME)
    sure = {"metallic": Certainty((0.004,), Level.DETERMINED)}
    rich = replace(rich, result=replace(rich.result, recovered=layers, certainty=sure))
    assert is_rich(rich.result, "all")
    assert not is_rich(rich.result, "reduced")
    assert not is_rich(replace(rich.result, recovered=layers | {"sheen_weight": 0.0}), "all")
    assert not is_rich(fitted(0.2).result, "all")  # which has other classes tried
    glow = fitted(0.012, Verdict.SAME)
    values = {"metallic": 0.0, "emission_color": (0.1, 0.2, 0.1)}
    glow = replace(glow, result=replace(glow.result, recovered=values, certainty=sure))
    classes = other_classes(material(), 4.0)
    found = module.with_plainer_glow(rich, material(), classes, lambda other: glow).result
    assert found.recovered["emission_strength"] == pytest.approx(0.8)
    assert found.notes == (PLAINER_GLOW,)
    # both look the same, so what they differ in is not determined
    assert found.certainty["metallic"].level is Level.NOT_TOLD_APART
    seen = replace(glow, result=replace(glow.result, judgement=judgement(Verdict.SAME, None, 0.0)))
    worse = replace(rich, result=replace(rich.result, judgement=judgement(Verdict.SAME, None, 0.012)))
    found = module.with_plainer_glow(worse, material(), classes, lambda other: seen).result
    assert found.certainty["metallic"].level is Level.DETERMINED
    as_rich = replace(glow, result=replace(glow.result, recovered=layers | values | {"metallic": 0.5}))
    kept = module.with_plainer_glow(rich, material(), classes, lambda other: as_rich).result
    assert (kept.recovered, kept.certainty["metallic"].level) == (layers, Level.NOT_TOLD_APART)
    differs = fitted(0.2)
    kept = module.with_plainer_glow(rich, material(), classes, lambda other: differs).result
    assert (kept.recovered, kept.certainty) == (layers, sure)
    assert kept.seconds == 2.0

    def fails(other):
        raise np.linalg.LinAlgError("Singular matrix")

    assert module.with_plainer_glow(rich, material(), classes, fails) is rich


def of_whole_paths(visible, verdict, **values):
    """A result of such a fit, from a plain material."""
    found = fitted(visible, verdict, Status.CONVERGED)
    plain = {"metallic": 0.0, "coat_weight": 0.0, "coat_roughness": 0.03, "specular_ior_level": 0.5}
    stages = (StageReport(POLISH, Status.CONVERGED, 0.1, 0.0, 3, 1.0, {}),)
    sure = {name: Certainty((0.001,), Level.DETERMINED) for name in plain}
    values = plain | values
    return replace(found, result=replace(found.result, initial=plain, recovered=values, stages=stages, certainty=sure))


def test_new_layers_are_those_of_whole_light_paths_that_look_the_same():
    rich = of_whole_paths(0.001, Verdict.SAME, coat_weight=0.5, metallic=0.04).result
    assert new_layers(rich, "all") == ["coat_weight"]
    assert without_layers(rich.recovered, ["coat_weight"]) == ["metallic", "specular_ior_level"]
    assert new_layers(rich, ["coat_weight"]) == []  # which was asked for
    assert new_layers(replace(rich, stages=()), "all") == []
    assert new_layers(replace(rich, initial=rich.recovered), "all") == []
    assert new_layers(of_whole_paths(0.2, Verdict.DIFFERENT, coat_weight=0.5).result, "all") == []


def test_a_plainer_material_that_looks_the_same_is_the_result():
    rich = of_whole_paths(0.001, Verdict.SAME, coat_weight=0.5, specular_ior_level=0.2)
    plain = of_whole_paths(0.002, Verdict.SAME, specular_ior_level=0.5)
    found = module.with_plainer(rich, material(), lambda: plain).result
    assert found.recovered == plain.result.recovered
    assert (found.notes, found.seconds) == ((PLAINER,), 2.0)
    # as unsure as the two are apart
    assert found.certainty["specular_ior_level"].level is not Level.DETERMINED
    assert found.certainty["metallic"].level is Level.DETERMINED
    worse = of_whole_paths(0.02, Verdict.SAME, coat_weight=0.5)
    nearer = module.with_plainer(worse, material(), lambda: plain).result
    assert (nearer.recovered, nearer.certainty) == (plain.result.recovered, plain.result.certainty)
    for other in (of_whole_paths(0.02, Verdict.SAME), of_whole_paths(0.2, Verdict.DIFFERENT)):
        kept = module.with_plainer(rich, material(), lambda other=other: other).result
        assert (kept.recovered, kept.certainty) == (rich.result.recovered, rich.result.certainty)
        assert kept.seconds == 2.0

    def fails():
        raise MemoryError

    assert module.with_plainer(rich, material(), fails) is rich


@pytest.mark.parametrize("verdict", [Verdict.CLOSE, Verdict.DIFFERENT])
def test_a_class_may_hold_values_inside_nodes(verdict):
    """Also after one that holds none: they begin as in the scene."""
    clay, stop = named("as rough as clay"), "Color Ramp/Stop 0"
    first, glow, again = fitted(0.2, verdict), fitted(0.09, verdict), fitted(0.01, Verdict.SAME)
    inside = {"initial": {"metallic": 0.0, stop: 0.5}, "bounds": {stop: (0.0, 1.0)}}
    first = replace(first, result=replace(first.result, recovered={"metallic": 0.4, stop: 0.6}, **inside))
    sure = {stop: Certainty((0.004,), Level.DETERMINED)}
    values = {"metallic": 0.1, "diffuse_roughness": 0.9, stop: 0.8}
    again = replace(again, result=replace(again.result, recovered=values, certainty=sure, **inside))
    between = module.better(first, glow, named("glowing"), material())
    for before, was in ((first, 0.6), (between, 0.5)):
        found = module.better(before, again, clay, material()).result
        assert (found.recovered[stop], found.initial[stop]) == (0.8, 0.5)
        away = 0.8 - was if verdict is Verdict.CLOSE else 0.0
        assert found.certainty[stop].sd == pytest.approx((np.hypot(0.004, away),))


def test_what_a_class_has_held_is_part_of_its_result():
    glass = material(Transmission_Weight=1.0, Metallic=0.0)
    opaque = named("opaque", glass)
    found = module.better(fitted(0.2), fitted(0.01, Verdict.SAME), opaque, glass).result
    assert found.recovered == {"metallic": 0.4, "transmission_weight": 0.0}
    assert found.initial == {"metallic": 0.0, "transmission_weight": 1.0}


def best_of(ends):
    """What becomes of a fit whose glass and cut-out fits end so; None stands for a material that no fit holds."""

    def fit_from(other):
        end = ends[other.name]
        if end is None:
            raise UnrecordableError("It has a texture.")
        if isinstance(end, Exception):
            raise end
        return end

    def is_wanted(found):
        return is_worth_another(found.result, "all")

    classes = [other for other in other_classes(material(), 0.0) if other.name in ends]
    return module.with_other_classes(fitted(0.2), material(), classes, fit_from, is_wanted).result


def test_what_was_tried_in_vain_is_said():
    found = best_of({"of glass": fitted(0.19), "cut out": fitted(0.3)})
    assert found.notes == (
        "The material of the scene did not match. "
        "Fits that began again from one that is of glass or cut out came not clearly nearer.",
    )
    assert (found.seconds, found.passes) == (3.0, 6.0)
    early = best_of({"of glass": NoNearerError(0.5, 1.0), "cut out": fitted(0.3)})
    assert early.notes == found.notes
    assert (early.seconds, early.passes) == (2.5, 5.0)
    assert best_of({"of glass": None, "cut out": fitted(0.3)}).notes == (
        "The material of the scene did not match. Fits that began again from one that is cut out came not clearly "
        "nearer. No fit holds one that is of glass.",
    )


def test_a_trial_that_fails_does_not_lose_the_first_result(capsys):
    found = best_of({"of glass": ValueError("Singular matrix"), "cut out": fitted(0.3)})
    assert found.recovered == fitted(0.2).result.recovered
    assert found.notes == (
        "The material of the scene did not match. Fits that began again from one that is cut out came not clearly "
        "nearer. Fits that began again from one that is of glass failed: the log holds the details.",
    )
    assert "Singular matrix" in capsys.readouterr().err
    better = best_of({"of glass": MemoryError(), "cut out": fitted(0.02, Verdict.SAME, Status.CONVERGED)})
    assert better.notes == (named("cut out").note,)


def test_the_class_that_is_better_is_the_only_one_named():
    found = best_of({"of glass": fitted(0.02, Verdict.SAME, Status.CONVERGED), "cut out": None})
    assert found.notes == (named("of glass").note,)
    assert best_of({"of glass": fitted(0.08), "cut out": fitted(0.3)}).notes == found.notes


def test_a_fit_that_was_stopped_is_not_called_worse():
    stopped = fitted(0.3)
    stopped = replace(stopped, result=replace(stopped.result, status=Status.CANCELLED, judgement=None))
    assert best_of({"of glass": stopped, "cut out": stopped}).notes == ()


def job_that_ends(fitted, picture, *, film_exposure=1.0, should_stop=True):
    """A job on a linear picture, whose fit from the scene's material ends so."""
    return SimpleNamespace(
        request=SimpleNamespace(fit=SimpleNamespace(parameters="all"), film_exposure=film_exposure),
        graphs=(),
        load=lambda parameters, graphs: [SimpleNamespace(table=SimpleNamespace(names=()))],
        fit=lambda renderers: fitted,
        start=material(),
        pictures=[SimpleNamespace(reference=Image(picture, Encoding.LINEAR), view=DisplayView())],
        should_stop=lambda: should_stop,
    )


def test_pictures_that_contradict_each_other_are_fitted_from_other_classes_too(monkeypatch):
    """Those of glass contradict each other beside an opaque material."""
    wanted = []
    monkeypatch.setattr(fit_scene, "with_other_classes", lambda fitted, *given: wanted.append(given[-1]) or fitted)
    one = fitted(0.2)
    one = replace(one, result=replace(one.result, contradiction=Contradiction(("1",), "Picture 1 does not go.")))
    fit_scene._fit_and_other_classes(job_that_ends(one, one.result_image, should_stop=False))
    (is_wanted,) = wanted
    assert is_wanted(one)


@pytest.mark.parametrize("several", [False, True])
def test_a_glow_is_sought_below_what_the_first_picture_shows_of_the_target(several, monkeypatch):
    """On a sheet of several pictures, too, and as the scene's exposure makes the picture of the light."""
    of_target = np.array([[False, True, True]])
    sheet = ContactSheet(((1, 3), (1, 3)), (1.0, 0.5), ("1", "2")) if several else None
    counted = of_target if sheet is None else sheet.put([of_target, ~of_target])
    nothing = np.zeros((*counted.shape, 3), np.float32)
    asked = []
    monkeypatch.setattr(fit_scene, "other_classes", lambda start, glow: asked.append(glow) or [])
    monkeypatch.setattr(fit_scene, "with_other_classes", lambda fitted, *given: fitted)
    found = SimpleNamespace(judgement=None, recovered={}, notes=())
    fitted = module.Fitted(found, nothing, nothing, counted, sheet)
    picture = np.array([[[9.0, 9.0, 9.0], [1.0, 2.0, 4.0], [3.0, 2.0, 6.0]]], np.float32)
    job = job_that_ends(fitted, picture, film_exposure=2.0)
    assert fit_scene._fit_and_other_classes(job) == (fitted, ())
    assert asked == [MOST_GLOW * 5.0 / 2.0]
