# SPDX-License-Identifier: Apache-2.0
"""What is said of the values that nodes give a job's target."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from mfo_backend.job.run.job_scene import MOST_NAMED, absent_notes, graph_notes, held_notes
from mfo_backend.types.verdict import Cause, Verdict

STAYED = tuple(f"Noise Texture/{number}" for number in range(MOST_NAMED + 2))


def notes(verdict: Verdict | None, stayed: tuple[str, ...]) -> tuple[str, ...]:
    material = SimpleNamespace(all_sockets=(("Roughness", SimpleNamespace(graph="graph/socket_00.npy")),))
    request: Any = SimpleNamespace(
        materials={"target_bsdf": material}, target=SimpleNamespace(bsdf_id="target_bsdf"),
        graph=SimpleNamespace(held=stayed, depths=1),
    )  # fmt: skip
    judgement = None if verdict is None else SimpleNamespace(verdict=verdict)
    result: Any = SimpleNamespace(model="blender_principled", notes=(), judgement=judgement)
    return graph_notes(request, result)


@pytest.mark.parametrize("verdict", [Verdict.CLOSE, Verdict.DIFFERENT])
def test_values_that_stayed_are_named_where_the_result_is_not_the_same(verdict: Verdict) -> None:
    (said,) = notes(verdict, STAYED[:2])
    assert "(Noise Texture/0, Noise Texture/1)" in said
    (said,) = notes(verdict, STAYED)
    assert said.count("Noise Texture") == MOST_NAMED
    assert ", ...)" in said


def test_nothing_is_said_where_it_is_the_same_or_nothing_stayed() -> None:
    assert notes(Verdict.SAME, STAYED) == notes(None, STAYED) == notes(Verdict.DIFFERENT, ()) == ()


def said_of_absent(
    verdict: Verdict,
    cause: Cause | None,
    parameters: str | list[str],
    leaves: tuple[Any, ...] = (),
    tried: frozenset[str] = frozenset(),
) -> tuple[str, ...]:
    amounts = {"Anisotropic": 0.0, "Thin Film Thickness": 420.0, "Subsurface Weight": 0.0, "Metallic": 0.0}
    sockets = {name: SimpleNamespace(value=value, linked=False) for name, value in amounts.items()}
    request: Any = SimpleNamespace(
        materials={"target_bsdf": SimpleNamespace(sockets=sockets, leaves=leaves)},
        target=SimpleNamespace(bsdf_id="target_bsdf", labels={}), fit=SimpleNamespace(parameters=parameters),
    )  # fmt: skip
    judgement = SimpleNamespace(verdict=verdict, cause=cause)
    result: Any = SimpleNamespace(
        model="blender_principled", judgement=judgement, recovered={"metallic": 1.0, "thin_film_thickness": 300.0}
    )
    return absent_notes(request, result, tried)


def test_what_the_material_has_none_of_is_named_where_it_does_not_match() -> None:
    """A brushed metal whose Anisotropic was 0 was close, and nothing said why."""
    (said,) = said_of_absent(Verdict.CLOSE, Cause.MATERIAL, "all")
    assert "(Anisotropic, Subsurface Weight)" in said
    # a car paint under a decal kept its coat of 0
    coat = {"Coat Weight": SimpleNamespace(value=0.0, linked=False)}
    leaves = (
        SimpleNamespace(name="Paint", sockets=coat, free={"Roughness": "r"}),
        SimpleNamespace(name="Held", sockets=coat, free={}),
    )
    (said,) = said_of_absent(Verdict.CLOSE, Cause.MATERIAL, "all", leaves)
    assert "(Anisotropic, Subsurface Weight, Paint/Coat Weight)" in said
    # a fit that began again from a brushed one has tried the first
    (said,) = said_of_absent(Verdict.CLOSE, Cause.MATERIAL, "all", tried=frozenset({"anisotropic"}))
    assert "(Subsurface Weight)" in said
    assert said_of_absent(Verdict.CLOSE, Cause.LIGHT, "all") == ()
    assert said_of_absent(Verdict.SAME, None, "all") == ()
    assert said_of_absent(Verdict.CLOSE, Cause.MATERIAL, ["roughness"]) == ()


@pytest.mark.parametrize(
    ("verdict", "color_linked", "strength", "said"),
    [
        (Verdict.DIFFERENT, True, 1.0, 1), (Verdict.SAME, True, 1.0, 0),
        (Verdict.DIFFERENT, False, 1.0, 0), (Verdict.DIFFERENT, True, 0.0, 0),
    ],
)  # fmt: skip
def test_a_glow_that_nodes_give_is_said_to_be_held(
    verdict: Verdict, color_linked: bool, strength: float, said: int
) -> None:
    """A screen of another brightness was said to stand under other lamps."""
    sockets = {
        "Emission Color": SimpleNamespace(value=[1.0] * 3, linked=color_linked),
        "Emission Strength": SimpleNamespace(value=strength, linked=False),
    }
    request: Any = SimpleNamespace(
        materials={"target_bsdf": SimpleNamespace(sockets=sockets, leaves=())},
        target=SimpleNamespace(bsdf_id="target_bsdf"),
        graph=SimpleNamespace(values=[SimpleNamespace(name="Ramp/Stop 0", sockets=["Emission Color"])]),
    )
    result: Any = SimpleNamespace(judgement=SimpleNamespace(verdict=verdict), recovered={})
    assert len(held_notes(request, result)) == said
    for recovered in ({"emission_strength": 2.0}, {"Ramp/Stop 0": (0.1, 0.2, 0.3)}):
        result.recovered = recovered
        assert held_notes(request, result) == ()


def test_other_shaders_of_a_mix_that_kept_their_values_are_named() -> None:
    """A lampshade whose Translucent BSDF was held lit its wall otherwise: that was all that was said."""
    leaves = tuple(
        SimpleNamespace(name=name, free=free, varies=False)
        for name, free in (("Silk", {}), ("Gloss", {"Roughness": "r"}))
    )
    request: Any = SimpleNamespace(
        materials={"target_bsdf": SimpleNamespace(sockets={}, leaves=leaves)},
        target=SimpleNamespace(bsdf_id="target_bsdf"),
        graph=None,
    )
    judged = (SimpleNamespace(verdict=verdict) for verdict in (Verdict.DIFFERENT, Verdict.SAME))
    different, same = (SimpleNamespace(judgement=each, recovered={}) for each in judged)
    (said,) = held_notes(request, different)  # type: ignore[arg-type]
    assert "(Silk)" in said
    assert held_notes(request, same) == ()  # type: ignore[arg-type]
