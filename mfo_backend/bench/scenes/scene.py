# SPDX-License-Identifier: Apache-2.0
"""One scene of the benchmark as Mitsuba files, everything in it drawn from its scenario's name and number."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...material.mitsuba_parameters import MITSUBA_PRINCIPLED
from ...material.principled.principled_parameters import BLENDER_PRINCIPLED, SOCKET_OF_PARAMETER
from ...types.parameter import Value
from .assets import Assets, Mesh, Probe
from .scenario import Scenario
from .scene_text import on_sphere, point_light, principled, probe_light, scene_text

SHAPE = "target"
TABLES = {"mitsuba_principled": MITSUBA_PRINCIPLED, "blender_principled": BLENDER_PRINCIPLED}
_DISTANCE = 3.6  # of the camera from an object of radius 1, which then fills nine tenths of the frame
_FURTHER = 1.5  # with neighbours in the frame
_RELIT_TURNS = (70.0, -70.0, 160.0)  # of a point light from the camera, degrees


@dataclass(frozen=True)
class BenchScene:
    """One scene on the disk.

    Attributes
    ----------
    file, relit
        Scenes that show the start's material: under the light of the reference, and under lights that no fit sees.
    true_files
        The same scenes with the true material where the fitted model has no values for it, else empty.
    truth
        The true values; empty where there are none.
    sockets, light_paths
        Of an exported scene: its materials and what Cycles does to indirect light.
    given
        Files of the reference and of the true picture where another renderer makes them.
    """

    scenario: Scenario
    number: int
    object: str
    light: str
    material: str
    file: Path
    relit: tuple[Path, ...]
    true_files: tuple[Path, ...]
    truth: Mapping[str, Value] = field(repr=False)
    start: Mapping[str, Value] = field(repr=False)
    sockets: Mapping[str, Any] | None = field(default=None, repr=False)
    light_paths: Any = None
    given: tuple[Path, Path] | None = None

    @property
    def materials(self) -> dict[str, Any]:
        """Sockets of the start, where the scenario's model has them."""
        return materials_of(self.scenario.model, self.start) if self.sockets is None else dict(self.sockets)


def write_scene(scenario: Scenario, number: int, size: int, assets: Assets, folder: Path) -> BenchScene:
    """Write scene `number` of a scenario, `size` x `size` pixels, into `folder`.

    Object, camera, lights and materials depend on the scenario's name, the number and the names of the assets that are
    there, not on the size.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([number, *scenario.name.encode()])
    truth, start = random_material(scenario, rng), random_material(scenario, rng)
    target = assets.place_object(rng, folder, "object.ply", closed_only=scenario.closed_only)
    azimuth, elevation = rng.uniform(-60.0, 60.0), rng.uniform(5.0, 35.0)
    light, emitters = _lights(scenario, azimuth, assets, rng, folder)
    around = _neighbours(scenario, azimuth, assets, rng, folder)
    camera = on_sphere(azimuth, elevation, _DISTANCE * (_FURTHER if around else 1.0))
    name, true_bsdf = ("", "") if not scenario.measured else assets.measured_material(rng)

    def write(file: str, bsdf: str, emitter: str) -> Path:
        text = scene_text(SHAPE, target.file, bsdf, [*around, emitter], camera, size, scenario.max_depth)
        (folder / file).write_text(text, "utf-8")
        return folder / file

    shown = shown_bsdf(scenario.model, start)
    files = [write("scene.xml", shown, emitters[0])]
    files += [write(f"relit_{n}.xml", shown, emitter) for n, emitter in enumerate(emitters[1:])]
    true_files = [write(f"true_{n}.xml", true_bsdf, emitter) for n, emitter in enumerate(emitters) if true_bsdf]
    return BenchScene(
        scenario, number, target.name, light, name, files[0], tuple(files[1:]), tuple(true_files),
        {} if scenario.measured else truth, start,
    )  # fmt: skip


def shown_bsdf(model: str, values: Mapping[str, Value]) -> str:
    """The target's BSDF; Blender's takes the place of this one when its sockets are given with the scene."""
    mitsuba = model == "mitsuba_principled"
    return principled("target_bsdf", values if mitsuba else {}, two_sided=mitsuba)


def materials_of(model: str, values: Mapping[str, Value]) -> dict[str, Any]:
    """What a renderer is told beside the scene: the sockets of Blender's model, nothing for Mitsuba's."""
    if model == "mitsuba_principled":
        return {}
    sockets = {SOCKET_OF_PARAMETER[name]: {"value": value, "linked": False} for name, value in values.items()}
    return {"target_bsdf": {"sockets": sockets}}


def random_material(scenario: Scenario, rng: np.random.Generator) -> dict[str, Value]:
    """Values of the scenario's drawn parameters, uniform in their ranges, and its constant ones."""
    values: dict[str, Value] = dict(scenario.constant)
    for name in scenario.drawn:
        parameter = TABLES[scenario.model][name]
        low, high = scenario.ranges.get(name, (parameter.lower, parameter.upper))
        low, high = max(low, parameter.lower), min(high, parameter.upper)
        drawn = rng.uniform(low, high, parameter.size)
        values[name] = float(drawn[0]) if parameter.size == 1 else tuple(float(v) for v in drawn)
    return values


def _lights(
    scenario: Scenario, azimuth: float, assets: Assets, rng: np.random.Generator, folder: Path
) -> tuple[str, list[str]]:
    """Name of the reference's light, and the emitters: that one and those of the judge."""
    if scenario.light == "point":
        turns = (rng.uniform(-50.0, 50.0), *_RELIT_TURNS[: scenario.relights])
        return "point", [point_light(azimuth + turn, rng.uniform(10.0, 60.0)) for turn in turns]
    probes: list[Probe] = []
    for index in range(1 + scenario.relights):
        file = "relit_probe.exr" if index == 1 else f"probe_{index}.exr" if index else "probe.exr"
        probes.append(assets.place_probe(rng, folder, file, other_than=[probe.name for probe in probes]))
    return probes[0].name, [probe_light(p.file, rng.uniform(0.0, 360.0), p.scale) for p in probes]


def _neighbours(
    scenario: Scenario, azimuth: float, assets: Assets, rng: np.random.Generator, folder: Path
) -> list[str]:
    """A floor and objects of random materials beside and behind the target, none before the camera."""
    parts: list[str] = []
    for index in range(scenario.neighbours):
        mesh: Mesh = assets.place_object(rng, folder, f"neighbour_{index}.ply", closed_only=False)
        turn = azimuth + (90.0, -90.0, 180.0)[index % 3] + rng.uniform(-25.0, 25.0)
        scale, distance = rng.uniform(0.5, 0.8), rng.uniform(1.5, 1.9)
        a = np.radians(turn)
        x, z = distance * np.sin(a), distance * np.cos(a)
        values = random_material(scenario, rng)
        parts.append(
            f'<shape type="ply"><string name="filename" value="{mesh.file.as_posix()}"/>'
            f'<transform name="to_world"><scale value="{scale:.6f}"/>'
            f'<translate x="{x:.6f}" y="{scale - 1.0:.6f}" z="{z:.6f}"/></transform>'
            f"{principled(f'neighbour_{index}_bsdf', values, two_sided=True)}</shape>"
        )
    if parts:
        parts.append(
            '<shape type="rectangle"><transform name="to_world"><scale value="6"/><rotate x="1" angle="-90"/>'
            '<translate y="-1"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="0.4"/></bsdf></shape>'
        )
    return parts
