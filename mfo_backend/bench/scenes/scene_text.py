# SPDX-License-Identifier: Apache-2.0
"""The parts of a bench scene as Mitsuba writes them. Y is up; azimuth 0 is +Z, angles in degrees."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...types.parameter import Value

_FIELD_OF_VIEW = 35.0
_LIGHT_DISTANCE, _INTENSITY = 4.0, 50.0  # about 3 units of irradiance


def on_sphere(azimuth: float, elevation: float, radius: float) -> str:
    """A point as Mitsuba writes it."""
    a, e = np.radians([azimuth, elevation])
    return ", ".join(f"{radius * v:.6f}" for v in (np.cos(e) * np.sin(a), np.sin(e), np.cos(e) * np.cos(a)))


def point_light(azimuth: float, elevation: float) -> str:
    """A point light far enough from an object of radius 1."""
    x, y, z = on_sphere(azimuth, elevation, _LIGHT_DISTANCE).split(", ")
    return (
        f'<emitter type="point"><point name="position" x="{x}" y="{y}" z="{z}"/>'
        f'<rgb name="intensity" value="{_INTENSITY}, {_INTENSITY}, {_INTENSITY}"/></emitter>'
    )


def probe_light(path: Path, turn: float, scale: float = 1.0) -> str:
    """A lat-long light probe turned about the vertical."""
    return (
        f'<emitter type="envmap"><string name="filename" value="{path.as_posix()}"/>'
        f'<float name="scale" value="{scale!r}"/>'
        f'<transform name="to_world"><rotate y="1" angle="{turn:.3f}"/></transform></emitter>'
    )


def principled(identifier: str, values: Mapping[str, Value], *, two_sided: bool) -> str:
    """Mitsuba's `principled` with these values."""
    inside = "".join(
        f'<rgb name="{name}" value="{", ".join(map(repr, value))}"/>'
        if isinstance(value, tuple)
        else f'<float name="{name}" value="{value!r}"/>'
        for name, value in values.items()
    )
    if not two_sided:
        return f'<bsdf type="principled" id="{identifier}">{inside}</bsdf>'
    return f'<bsdf type="twosided" id="{identifier}"><bsdf type="principled">{inside}</bsdf></bsdf>'


def scene_text(shape: str, mesh: Path, bsdf: str, others: Sequence[str], camera: str, size: int, max_depth: int) -> str:
    """A whole scene; `bsdf` has the id ``target_bsdf``, `others` are emitters and further shapes."""
    return f"""<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="{max_depth}"/></integrator>
<sensor type="perspective"><float name="fov" value="{_FIELD_OF_VIEW}"/>
<transform name="to_world"><lookat origin="{camera}" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/>
<rfilter type="box"/></film></sensor>
{bsdf}
<shape type="ply" id="{shape}"><string name="filename" value="{mesh.as_posix()}"/><ref id="target_bsdf"/></shape>
{"".join(others)}
</scene>
"""
