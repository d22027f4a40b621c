# SPDX-License-Identifier: Apache-2.0
"""Random materials and directions, the same in Cycles and in our evaluation, and the table of their differences.

`python tests/material/parity.py` rewrites docs/reference/material_parity.md; further arguments
`LABEL=MAJOR.MINOR=COMMAND` add other Blender versions, e.g. "4.2.23=4.2=/path/to/python" or
"5.2=5.2=blender -b --factory-startup -P".
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))

from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED, SOCKET_OF_PARAMETER  # noqa: E402
from tools.cycles_probe import ask_cycles  # noqa: E402

Array = NDArray[np.float64]
REFLECTED_ANGLES = (15.0, 50.0, 85.0, 120.0)  # between view and light, degrees
REFRACTED_ANGLES = (110.0, 140.0, 165.0, 176.0)


@dataclass(frozen=True)
class Group:
    """A family of materials: ranges of the parameters that vary, values of those that do not."""

    name: str
    ranges: dict[str, tuple[float, float]]
    fixed: dict[str, float]
    refracted: bool = False
    distribution: str = "MULTI_GGX"
    since: tuple[int, int] = (4, 2)
    most: float = 2e-5  # bound on 99 % of the cases
    worst: float = 2e-4


BASE = {"base_color": (0.0, 1.0), "roughness": (0.15, 1.0)}
PLASTIC = {**BASE, "ior": (1.05, 2.5), "specular_ior_level": (0.0, 1.0), "specular_tint": (0.0, 1.0)}
COAT = {"coat_weight": (0.0, 1.0), "coat_roughness": (0.15, 1.0), "coat_ior": (1.05, 2.5), "coat_tint": (0.05, 1.0)}
SHEEN = {"sheen_weight": (0.0, 1.0), "sheen_roughness": (0.1, 1.0), "sheen_tint": (0.0, 1.0)}
TURN = {"anisotropic": (0.0, 1.0), "anisotropic_rotation": (0.0, 1.0)}
# Below these reflectances the metal's extinction is the small difference of large numbers in Cycles' single precision
SHINY = {"base_color": (0.05, 1.0), "roughness": (0.15, 1.0), "metallic": (0.0, 1.0), "specular_tint": (0.2, 1.0)}
METAL = {"metallic": (0.0, 1.0), "specular_tint": (0.0, 1.0)}
FILM = {"thin_film_thickness": (0.0, 1200.0), "thin_film_ior": (1.05, 2.2)}

GROUPS = (
    Group("plastic", PLASTIC, {}),
    Group("plastic, GGX", PLASTIC, {}, distribution="GGX"),
    Group("rough diffuse", {**BASE, "diffuse_roughness": (0.0, 1.0)}, {}, since=(4, 3)),
    Group("metal", {**BASE, **METAL}, {}),
    Group("anisotropic metal", {**BASE, **METAL, **TURN}, {}),
    Group("coat", {**PLASTIC, **COAT, "metallic": (0.0, 1.0)}, {}),
    Group("sheen", {**PLASTIC, **SHEEN, "metallic": (0.0, 1.0)}, {}),
    Group("everything opaque", {**PLASTIC, **COAT, **SHEEN, **TURN, "metallic": (0.0, 1.0), "alpha": (0.0, 1.0)}, {}),
    Group("glass, reflected", {**BASE, "ior": (1.05, 2.5), "specular_tint": (0.0, 1.0)}, {"transmission_weight": 1.0}),
    Group(
        "glass, refracted",
        {**BASE, "ior": (1.05, 2.5), "specular_tint": (0.0, 1.0)},
        {"transmission_weight": 1.0},
        refracted=True,
        worst=5e-4,
    ),
    Group("half glass", {**PLASTIC, **COAT, "transmission_weight": (0.0, 1.0), "metallic": (0.0, 1.0)}, {}, worst=5e-4),
    Group("film on plastic", {**PLASTIC, **FILM}, {}, worst=5e-4),
    Group("film on metal", {**SHINY, **FILM}, {}, since=(5, 0), worst=5e-4),
    Group("film on glass", {**BASE, **FILM, "ior": (1.05, 2.5)}, {"transmission_weight": 1.0}, worst=5e-4),
    Group(
        "film on glass, refracted",
        {**BASE, **FILM, "ior": (1.05, 2.5)},
        {"transmission_weight": 1.0},
        refracted=True,
        worst=5e-4,
    ),
)


@dataclass(frozen=True)
class Cases:
    """Directions (cases, 3) and parameter values, (cases,) or (cases, 3), of one group."""

    view: Array
    light: Array
    values: dict[str, Array]

    @property
    def batch(self) -> dict[str, Any]:
        """The question for `ask_cycles`, without the distribution."""
        sockets = {SOCKET_OF_PARAMETER[name]: value for name, value in self.values.items()}
        return {"view": self.view, "light": self.light, "sockets": sockets}


def random_cases(group: Group, materials: int, seed: int) -> Cases:
    """`materials` parameter sets, four direction pairs each; directions at most 84 degrees off the normal.

    A tenth of the views of transparent groups come from inside.
    """
    rng = np.random.default_rng(seed)
    angles = np.radians(REFRACTED_ANGLES if group.refracted else REFLECTED_ANGLES)
    views, lights = [], []
    for _ in range(materials):
        for angle in angles:
            while True:
                view = rng.normal(size=3)
                view /= np.linalg.norm(view)
                view[2] = abs(view[2])
                side = np.cross(view, rng.normal(size=3))
                light = np.cos(angle) * view + np.sin(angle) * side / np.linalg.norm(side)
                if view[2] > 0.1 and (-light[2] if group.refracted else light[2]) > 0.1:
                    break
            views.append(view)
            lights.append(light)
    view, light = np.array(views), np.array(lights)
    if "transmission_weight" in {**group.ranges, **group.fixed}:
        inside = rng.random(len(view)) < 0.1
        view[inside, 2] *= -1
        light[inside, 2] *= -1
    values = {}
    for name in {**group.ranges, **group.fixed}:
        low, high = group.ranges.get(name, (group.fixed.get(name, 0.0),) * 2)
        size = BLENDER_PRINCIPLED[name].size
        drawn = rng.uniform(low, high, (materials, size)).repeat(len(angles), axis=0)
        # Both sides must see the same numbers: sockets are float32
        values[name] = (drawn if size == 3 else drawn[:, 0]).astype(np.float32).astype(np.float64)
    return Cases(view, light, values)


def evaluate_cases(cases: Cases, group: Group, version: Sequence[int], double: bool = False) -> Array:
    """Our f_r |cos|, (cases, 3), in single or double precision (LLVM)."""
    import drjit as dr

    from mfo_backend.material.arrays.own_memory import own_memory
    from mfo_backend.material.cycles_model import cycles_model
    from mfo_backend.material.principled.blender_principled import blender_principled

    vector, kind = (dr.llvm.ad.Array3f64, dr.llvm.ad.Float64) if double else (dr.llvm.ad.Array3f, dr.llvm.ad.Float)

    def number(values: Array) -> Any:
        return own_memory(values, kind)

    parameters = {
        name: vector(*(number(value[:, k]) for k in range(3))) if value.ndim == 2 else number(value)
        for name, value in cases.values.items()
    }
    view, light = (vector(*(number(d[:, k]) for k in range(3))) for d in (cases.view, cases.light))
    return np.array(
        blender_principled(parameters, view, light, model=cycles_model(version, group.distribution)), float
    ).T


def relative_difference(ours: Array, theirs: Array) -> Array:
    """Largest component difference over the largest component, (cases,)."""
    scale = np.maximum(np.abs(theirs).max(axis=1), 1e-6)
    return np.abs(ours - theirs).max(axis=1) / scale


def at_total_reflection(cases: Cases) -> NDArray[np.bool_]:
    """Cases at the onset of total reflection, where 1 - F is the root of a difference that single precision loses."""
    index = np.where(cases.view[:, 2] < 0, 1 / cases.values["ior"], cases.values["ior"])
    half = cases.view + index[:, None] * cases.light
    cosine = np.sum(half * cases.view, axis=1) / np.linalg.norm(half, axis=1)
    return np.abs(index**2 - 1 + cosine**2) < 5e-3


TABLE = ROOT / "docs" / "reference" / "material_parity.md"
TABLE_VERSION = "5.0.1"
INTRODUCTION = """# Blender's Principled BSDF here and in Cycles

`python tests/material/parity.py` writes this file; `tests/material/principled/test_cycles_parity.py` holds the rows of
5.0.1. Each row: {materials} random materials with four direction pairs each, one noise-free Cycles pixel per case
(`tools/cycles_probe.py`), our function in single precision on the CPU. The error of a case is the largest difference of
a colour component over the largest component.

| materials | Blender | median | 99 % below | worst | share below 2e-5 |
|---|---|---|---|---|---|
"""


def table_row(group: Group, cases: Cases, theirs: Array, version: Sequence[int], label: str = TABLE_VERSION) -> str:
    """One line of the parity table."""
    error = relative_difference(evaluate_cases(cases, group, version), theirs)
    numbers = f"{np.median(error):.1e} | {np.quantile(error, 0.99):.1e} | {error.max():.1e}"
    return f"| {group.name} | {label} | {numbers} | {np.mean(error < 2e-5):.3f} |"


def main(others: Sequence[str]) -> None:
    """Measure the installed `bpy` and the named other versions, and write the table."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    materials, rows = 200, []
    for spec in (f"{TABLE_VERSION}=5.0={sys.executable}", *others):
        label, number, command = spec.split("=", 2)
        version = tuple(int(part) for part in number.split("."))
        groups = [(seed, group) for seed, group in enumerate(GROUPS) if version >= group.since]
        cases = [random_cases(group, materials, seed) for seed, group in groups]
        batches = [{**c.batch, "distribution": g.distribution} for c, (_, g) in zip(cases, groups, strict=True)]
        answers = ask_cycles(batches, command.split())
        rows += [table_row(g, c, a, version, label) for (_, g), c, a in zip(groups, cases, answers, strict=True)]
    rows.sort(key=lambda row: [group.name for group in GROUPS].index(row.split("|")[1].strip()))
    TABLE.write_text(INTRODUCTION.format(materials=materials) + "\n".join(rows) + "\n" + (NOTES), "utf-8")


NOTES = """
What is left:

- Roughness below 0.3: Cycles computes the isotropic distribution from 1 - (N.H)^2 in single precision; the anisotropic
  form, without that difference, agrees to 2e-6 on the same materials.
- Light through glass at the onset of total reflection, where 1 - F goes as the root of a difference.
- Film on metal with reflectances below 0.05: the extinction is the small difference of large numbers.
- Sheen near the normal, where its albedo, a table of five decimals, is a few hundred times the last decimal.
"""

if __name__ == "__main__":
    main(sys.argv[1:])
