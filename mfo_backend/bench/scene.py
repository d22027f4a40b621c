# SPDX-License-Identifier: Apache-2.0
"""One scene of the benchmark as Mitsuba files, everything in it drawn from its scenario's name and number."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..material.mitsuba_parameters import MITSUBA_PRINCIPLED
from ..types.parameter import Value
from .assets import Assets
from .scenario import Scenario

SHAPE = "target"
_FIELD_OF_VIEW = 35.0
_DISTANCE = 3.6  # of the camera from an object of radius 1, which then fills nine tenths of the frame
_LIGHT_DISTANCE, _INTENSITY = 4.0, 50.0  # about 3 units of irradiance


@dataclass(frozen=True)
class BenchScene:
    """`file` shows the start's material; `relit` is the same under a light that no fit sees."""

    scenario: Scenario
    number: int
    object: str
    light: str
    file: Path
    relit: Path
    truth: Mapping[str, Value] = field(repr=False)
    start: Mapping[str, Value] = field(repr=False)


def write_scene(scenario: Scenario, number: int, size: int, assets: Assets, folder: Path) -> BenchScene:
    """Write scene `number` of a scenario, `size` x `size` pixels, into `folder`.

    Object, camera, lights and both materials depend on the scenario's name, the number and the names of the assets
    that are there, not on the size.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([number, *scenario.name.encode()])
    truth, start = _random_material(scenario, rng), _random_material(scenario, rng)
    name, mesh = assets.place_object(rng, folder, closed_only=scenario.closed_only)
    azimuth, elevation = rng.uniform(-60.0, 60.0), rng.uniform(5.0, 35.0)
    if scenario.light == "point":
        light, lights = "point", [_point_light(azimuth + turn, rng) for turn in (rng.uniform(-50.0, 50.0), 70.0)]
    else:
        light, probe = assets.place_probe(rng, folder, "probe.exr")
        _, other = assets.place_probe(rng, folder, "relit_probe.exr", other_than=light)
        lights = [_probe_light(path, rng) for path in (probe, other)]
    files = folder / "scene.xml", folder / "relit.xml"
    for file, emitter in zip(files, lights, strict=True):
        camera = _on_sphere(azimuth, elevation, _DISTANCE)
        file.write_text(_xml(scenario, start, mesh, camera, emitter, size), "utf-8")
    return BenchScene(scenario, number, name, light, *files, truth, start)


def _random_material(scenario: Scenario, rng: np.random.Generator) -> dict[str, Value]:
    values: dict[str, Value] = dict(scenario.constant)
    for name in scenario.drawn:
        parameter = MITSUBA_PRINCIPLED[name]
        low, high = scenario.ranges.get(name, (parameter.lower, parameter.upper))
        low, high = max(low, parameter.lower), min(high, parameter.upper)
        drawn = rng.uniform(low, high, parameter.size)
        values[name] = float(drawn[0]) if parameter.size == 1 else tuple(float(v) for v in drawn)
    return values


def _on_sphere(azimuth: float, elevation: float, radius: float) -> str:
    """A point as Mitsuba writes it; angles in degrees, azimuth 0 is +Z, Y is up."""
    a, e = np.radians([azimuth, elevation])
    return ", ".join(f"{radius * v:.6f}" for v in (np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)))


def _point_light(azimuth: float, rng: np.random.Generator) -> str:
    x, y, z = _on_sphere(azimuth, rng.uniform(10.0, 60.0), _LIGHT_DISTANCE).split(", ")
    return (
        f'<emitter type="point"><point name="position" x="{x}" y="{y}" z="{z}"/>'
        f'<rgb name="intensity" value="{_INTENSITY}, {_INTENSITY}, {_INTENSITY}"/></emitter>'
    )


def _probe_light(path: Path, rng: np.random.Generator) -> str:
    return (
        f'<emitter type="envmap"><string name="filename" value="{path.as_posix()}"/>'
        f'<transform name="to_world"><rotate y="1" angle="{rng.uniform(0.0, 360.0):.3f}"/></transform></emitter>'
    )


def _xml(scenario: Scenario, start: Mapping[str, Value], mesh: Path, camera: str, emitter: str, size: int) -> str:
    values = "".join(
        f'<rgb name="{name}" value="{", ".join(map(repr, value))}"/>'
        if isinstance(value, tuple)
        else f'<float name="{name}" value="{value!r}"/>'
        for name, value in start.items()
    )
    glass = "spec_trans" in start
    if glass:
        bsdf = f'<bsdf type="principled" id="target_bsdf">{values}</bsdf>'
    else:
        bsdf = f'<bsdf type="twosided" id="target_bsdf"><bsdf type="principled">{values}</bsdf></bsdf>'
    return f"""<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="{scenario.max_depth}"/></integrator>
<sensor type="perspective"><float name="fov" value="{_FIELD_OF_VIEW}"/>
<transform name="to_world"><lookat origin="{camera}" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/>
<rfilter type="box"/></film></sensor>
{bsdf}
<shape type="ply" id="{SHAPE}"><string name="filename" value="{mesh.as_posix()}"/><ref id="target_bsdf"/></shape>
{emitter}
</scene>
"""
