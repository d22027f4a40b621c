# SPDX-License-Identifier: Apache-2.0
"""A second fit of the same kind compiles nothing: seeds, values, lights and directions are data of its kernels."""

from __future__ import annotations

from functools import cache

import drjit as dr
import pytest

from mfo_backend.render.machine.variant import load_variant

load_variant()

from mfo_backend.fit.recover_material import recover_material  # noqa: E402  after the variant is set
from mfo_backend.fit.settings import FitSettings  # noqa: E402
from mfo_backend.render.pictures.renderer import load_renderer  # noqa: E402
from mfo_backend.types.image import Encoding, Image  # noqa: E402
from mfo_backend.types.light_paths import LightPaths  # noqa: E402
from tests.render.scenes import FLOOR, write_scene  # noqa: E402


def lamp(place: str, power: str) -> str:
    return f'<emitter type="point"><point name="position" {place}/><rgb name="intensity" value="{power}"/></emitter>'


def area(centre: str, radius: float, radiance: str) -> str:
    return (
        f'<shape type="sphere"><point name="center" {centre}/><float name="radius" value="{radius}"/>'
        f'<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>'
    )


LAMPS = (lamp('x="2" y="-3" z="3"', "40, 36, 30"), lamp('x="-3" y="-2" z="1.5"', "9, 30, 50"))
ROOMS = (
    FLOOR + area('x="2" y="-2" z="2"', 0.4, "15, 14, 12"),
    FLOOR.replace("0.8, 0.3, 0.2", "0.3, 0.5, 0.6") + area('x="-3" y="-2" z="1"', 0.6, "4, 6, 8"),
)
SOCKETS = (
    {"Base Color": (0.6, 0.3, 0.2), "Roughness": 0.3, "Metallic": 0.2},
    {"Base Color": (0.1, 0.3, 0.7), "Roughness": 0.55, "Metallic": 0.7},
)
GLASS = (
    {"Base Color": (0.8, 0.9, 0.9), "Roughness": 0.3, "Transmission Weight": 0.8, "IOR": 1.4},
    {"Base Color": (0.9, 0.6, 0.7), "Roughness": 0.5, "Transmission Weight": 0.9, "IOR": 1.6},
)
SOME_LIGHT_PATHS = LightPaths(1.0, 10.0, 4, 4, 12)
# name: lights, sockets, light paths, depth, free values, preset
CASES = {
    "lamp": (LAMPS, None, None, 2, "all", "balanced"),
    "room": (ROOMS, None, None, 3, "all", "balanced"),
    "room, best": (ROOMS, None, None, 3, "reduced", "best"),
    "room, prb": (ROOMS, None, None, 3, "reduced", "paper"),
    "Blender's room": (ROOMS, SOCKETS, SOME_LIGHT_PATHS, 4, "all", "balanced"),
    "glass": (ROOMS, GLASS, None, 6, ("base_color", "roughness", "ior"), "fast"),
}


def fit(folder, lights, sockets, light_paths, depth, parameters, preset, seed, size=32) -> None:
    folder.mkdir()
    materials = {}
    if sockets is not None:
        materials = {"target_bsdf": {"sockets": {n: {"value": v, "linked": False} for n, v in sockets.items()}}}
    scene = write_scene(folder, lights, size=size, depth=depth)
    renderer = load_renderer(
        scene,
        "target",
        model="mitsuba_principled" if sockets is None else "blender_principled",
        parameters=parameters,
        materials=materials,
        light_paths=light_paths,
    )
    other = renderer.table.lower + (0.3 + 0.1 * seed) * (renderer.table.upper - renderer.table.lower)
    reference = Image(renderer.image(other, seed=100 + seed, spp=8), Encoding.LINEAR)
    settings = FitSettings(preset=preset, seed=seed, verify_spp=8, max_iterations=4, spp=2, parameters=parameters)
    recover_material(renderer, reference, settings, listener=lambda event: None, should_stop=lambda: False)


@pytest.fixture(scope="module")
def first_fit(tmp_path_factory):
    """Make the first fit of a kind, once for the tests of this process."""

    @cache
    def made(case) -> None:
        lights, sockets, *rest = CASES[case]
        fit(tmp_path_factory.mktemp("first") / "0", lights[0], sockets and sockets[0], *rest, seed=0)

    return made


@pytest.mark.parametrize("case", CASES)
def test_another_fit_of_the_same_kind_compiles_nothing(case, first_fit, tmp_path):
    first_fit(case)
    lights, sockets, *rest = CASES[case]
    assert new_kernels(tmp_path / "1", lights[1], sockets and sockets[1], *rest, seed=1) == []


@pytest.mark.parametrize("case", ["lamp", "glass"])
def test_a_picture_of_another_size_compiles_nothing_of_the_material(case, first_fit, tmp_path):
    first_fit(case)
    lights, sockets, *rest = CASES[case]
    new = new_kernels(tmp_path / "40", lights[0], sockets and sockets[0], *rest, seed=0, size=40)
    # the sensor of several cameras, by which further pictures are proposed, is Mitsuba's
    assert all(operations < 600 for operations, _ in new)


def new_kernels(*given, **named) -> list[tuple[int, int]]:
    """Operations and size of what a fit compiles, or finds in the cache on disk as an earlier run has compiled it."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        dr.kernel_history_clear()
        fit(*given, **named)
        return [
            (k["operation_count"], k["size"])
            for k in dr.kernel_history()
            if k["type"] == dr.KernelType.JIT and (not k["cache_hit"] or k["cache_disk"])
        ]


def test_no_picture_is_rendered_for_a_material_that_recorded_paths_refuse(tmp_path, monkeypatch):
    """The picture of the start is begun early, but not before it is known that the fit goes this way."""
    from mfo_backend.fit.judge.fit_task import check_task
    from mfo_backend.fit.recorded.fit import RecordedRoute
    from mfo_backend.types.errors import UnrecordableError

    sockets = {n: {"value": v, "linked": False} for n, v in GLASS[0].items()}
    renderer = load_renderer(
        write_scene(tmp_path, ROOMS[0], size=16, depth=4),
        "target",
        model="blender_principled",
        parameters="all",
        materials={"target_bsdf": {"sockets": sockets}},
    )
    reference = Image(renderer.image(renderer.start, seed=1, spp=4), Encoding.LINEAR)
    before = renderer.passes
    with pytest.raises(UnrecordableError):
        RecordedRoute(
            check_task(renderer, reference, FitSettings(), None, lambda event: None, lambda: False), renderer, None
        )
    assert renderer.passes == before
